#define _GNU_SOURCE
/* Pictures go to files and come back the same; what cannot be written leaves nothing behind. */
#include "host/scene/image.h"
#include "tests/check.h"

#include <dirent.h>
#include <string.h>
#include <unistd.h>

static void round_trip(const char *folder, const char *name, const qp_image *image) {
    char path[300];
    qp_error err;
    qp_image back;
    double difference = -1;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    CHECK_OK(qp_image_write(path, image, &err), err);
    CHECK_OK(qp_image_write(path, image, &err), err); /* over an old one */
    if (!CHECK_OK(qp_image_read(path, &back, &err), err)) return;
    CHECK_OK(qp_image_compare(image, &back, &difference, &err), err);
    CHECK(difference == 0);
    qp_image_free(&back);
    unlink(path);
}

static size_t count_entries(const char *folder) {
    size_t n = 0;
    DIR *entries = opendir(folder);
    if (entries == NULL) return 0;
    while (readdir(entries) != NULL) n++;
    closedir(entries);
    return n;
}

int main(void) {
    char folder[] = "/tmp/quadplan-image-XXXXXX";
    qp_error err;
    qp_image image, other;
    if (!CHECK(mkdtemp(folder) != NULL) || !CHECK_OK(qp_image_create(37, 23, &image, &err), err))
        return check_report();
    for (size_t k = 0; k < 4 * 37 * 23; k++) {
        image.rgba[k] = (uint8_t)(k * 7919 >> 3);
        image.rgba_f[k] = (float)(k % 101) * 0.37f - 3.0f;
    }
    image.rgba[3] = 0; /* colour under no alpha stays */
    round_trip(folder, "a.png", &image);
    round_trip(folder, "a.EXR", &image);

    CHECK(qp_image_write("a.jpg", &image, &err) == QP_BAD_INPUT && strstr(err.message, "a.jpg") != NULL);
    CHECK(qp_image_check_path("x.PNG", &err) == QP_OK && qp_image_check_path("png", &err) == QP_BAD_INPUT);
    CHECK(qp_image_write("/nonexistent/folder/a.png", &image, &err) == QP_SYSTEM);
    CHECK(qp_image_read("/nonexistent/a.png", &other, &err) == QP_BAD_INPUT && other.rgba == NULL);
    CHECK(qp_image_create(0, 5, &other, &err) == QP_BAD_INPUT);
    CHECK(qp_image_create(5, QP_IMAGE_SIDE_MAX + 1, &other, &err) == QP_BAD_INPUT);

    /* A picture cannot replace a folder. */
    char path[300];
    snprintf(path, sizeof path, "%s/d.png", folder);
    char command[800];
    snprintf(command, sizeof command, "mkdir -p %s/full && touch %s/full/x", path, path);
    CHECK(system(command) == 0);
    CHECK(qp_image_write(path, &image, &err) == QP_SYSTEM);
    CHECK(count_entries(folder) == 3); /* ".", ".." and the folder: no temporary file */
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(system(command) == 0);

    if (CHECK_OK(qp_image_create(37, 22, &other, &err), err)) {
        double difference;
        CHECK(qp_image_compare(&image, &other, &difference, &err) == QP_BAD_INPUT);
        qp_image_free(&other);
    }
    qp_image_free(&image);
    return check_report();
}
