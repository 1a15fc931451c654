/* Picture files: what to read and write; how is up to the module quadplan_images (codec.h). */
#define _GNU_SOURCE
#include "host/base/output.h"
#include "host/scene/codec.h"

#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

/* Where the module may lie, relative to the folder of the program: beside it (build folder), above it (tests in
 * the build folder), installed. */
static const char *const places[] = {"", "../", QP_IMAGE_MODULE_FOLDER "/"};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static const qp_image_codec *codec;

static qp_status load_codec(qp_error *err) {
    char folder[4096];
    ssize_t length = readlink("/proc/self/exe", folder, sizeof folder - 1);
    if (length < 0) return qp_fail(err, QP_SYSTEM, "cannot tell where the program lies: %s", strerror(errno));
    folder[length] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash != NULL) slash[1] = '\0';
    for (size_t i = 0; i < sizeof places / sizeof *places && codec == NULL; ++i) {
        char path[sizeof folder + 256];
        snprintf(path, sizeof path, "%s%squadplan_images.so", folder, places[i]);
        if (access(path, R_OK) != 0) continue;
        void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (module == NULL) return qp_fail(err, QP_SYSTEM, "pictures: %s", dlerror());
        codec = dlsym(module, QP_IMAGE_MODULE_SYMBOL);
    }
    if (codec == NULL)
        return qp_fail(err, QP_SYSTEM, "pictures: there is no quadplan_images.so near %s", folder);
    return QP_OK;
}

static qp_status get_codec(const qp_image_codec **found, qp_error *err) {
    pthread_mutex_lock(&lock);
    qp_status status = codec != NULL ? QP_OK : load_codec(err);
    *found = codec;
    pthread_mutex_unlock(&lock);
    return status;
}

static bool has_extension(const char *path, const char *extension) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, extension) == 0;
}

qp_status qp_image_check_path(const char *path, qp_error *err) {
    if (has_extension(path, ".png") || has_extension(path, ".exr")) return QP_OK;
    return qp_fail(err, QP_BAD_INPUT, "%s: a picture must be named .png or .exr", path);
}

qp_status qp_image_write(const char *path, const qp_image *image, qp_error *err) {
    const qp_image_codec *c;
    qp_status status = qp_image_check_path(path, err);
    if (status != QP_OK) return status;
    bool png = has_extension(path, ".png");
    if (image->width == 0 || image->height == 0 || (png ? image->rgba == NULL : image->rgba_f == NULL))
        return qp_fail(err, QP_BAD_INPUT, "%s: there are no pixels to write", path);
    status = get_codec(&c, err);
    if (status != QP_OK) return status;
    void *bytes;
    size_t size;
    status = c->encode(path, image, png, &bytes, &size, err);
    if (status != QP_OK) return status;
    qp_output output;
    status = qp_output_open(&output, path, err);
    if (status == QP_OK) {
        fwrite(bytes, 1, size, output.file);
        status = qp_output_commit(&output, err);
    }
    free(bytes);
    return status;
}

qp_status qp_image_read(const char *path, qp_image *image, qp_error *err) {
    const qp_image_codec *c;
    memset(image, 0, sizeof *image);
    qp_status status = qp_image_check_path(path, err);
    if (status == QP_OK) status = get_codec(&c, err);
    if (status == QP_OK) status = c->read(path, image, has_extension(path, ".png"), err);
    if (status != QP_OK) qp_image_free(image);
    return status;
}
