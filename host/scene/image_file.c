/* Picture files: what to read and write; how is up to the module quadplan_images (codec.h). */
#include "host/base/module.h"
#include "host/base/output.h"
#include "host/scene/codec.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static const qp_image_codec *codec;

static qp_status get_codec(const qp_image_codec **found, qp_error *err) {
    pthread_mutex_lock(&lock);
    qp_status status = QP_OK;
    if (codec == NULL) {
        const void *symbol;
        status = qp_module_load("pictures", "quadplan_images.so", QP_IMAGE_MODULE_FOLDER,
                                QP_IMAGE_MODULE_SYMBOL, &symbol, err);
        codec = symbol;
    }
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
