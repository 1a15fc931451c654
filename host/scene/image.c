#include "host/scene/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

qp_status qp_image_create(uint32_t width, uint32_t height, qp_image *image, qp_error *err) {
    memset(image, 0, sizeof *image);
    if (width == 0 || height == 0 || width > QP_IMAGE_SIDE_MAX || height > QP_IMAGE_SIDE_MAX)
        return qp_fail(err, QP_BAD_INPUT, "a picture of %u x %u pixels; sides are 1 to %u", width, height,
                       QP_IMAGE_SIDE_MAX);
    size_t count = (size_t)width * height;
    image->rgba = qp_alloc(count, 4, true);
    image->rgba_f = qp_alloc(count, 4 * sizeof(float), true);
    if (image->rgba == NULL || image->rgba_f == NULL) {
        qp_image_free(image);
        return qp_fail_memory(err, count * (4 + 4 * sizeof(float)), "a picture");
    }
    image->width = width;
    image->height = height;
    return QP_OK;
}

void qp_image_free(qp_image *image) {
    if (image == NULL) return;
    free(image->rgba);
    free(image->rgba_f);
    memset(image, 0, sizeof *image);
}

qp_status qp_image_compare(const qp_image *a, const qp_image *b, double *max_difference, qp_error *err) {
    if (a->width != b->width || a->height != b->height)
        return qp_fail(err, QP_BAD_INPUT, "pictures of %u x %u and %u x %u pixels", a->width, a->height,
                       b->width, b->height);
    size_t count = (size_t)a->width * a->height * 4;
    double most = 0;
    if (a->rgba != NULL && b->rgba != NULL) {
        for (size_t k = 0; k < count; k++) most = fmax(most, abs(a->rgba[k] - b->rgba[k]));
    } else if (a->rgba_f != NULL && b->rgba_f != NULL) {
        for (size_t k = 0; k < count; k++) {
            double d = fabs((double)a->rgba_f[k] - (double)b->rgba_f[k]);
            if (!(d <= most)) most = d; /* NaN is a difference */
        }
    } else {
        return qp_fail(err, QP_BAD_INPUT, "one picture has bytes and the other floats");
    }
    *max_difference = most;
    return QP_OK;
}
