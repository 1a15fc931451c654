/* Pictures in memory and in files (PNG and OpenEXR through OpenImageIO). */
#ifndef QP_SCENE_IMAGE_H
#define QP_SCENE_IMAGE_H

#include "host/base/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Both forms of one picture, rows from the top; either may be NULL. Zero-initialise before use. */
typedef struct qp_image {
    uint32_t width, height;
    uint8_t *rgba; /* 4 a pixel, sRGB, alpha not premultiplied: what a PNG holds */
    float *rgba_f; /* 4 a pixel, linear light, alpha premultiplied: what an EXR holds */
} qp_image;

/* Allocates both forms, zeroed. QP_BAD_INPUT when a side is 0 or above QP_IMAGE_SIDE_MAX. */
#define QP_IMAGE_SIDE_MAX 16384u
qp_status qp_image_create(uint32_t width, uint32_t height, qp_image *image, qp_error *err);
/* Frees the pixels and zeroes the struct. */
void qp_image_free(qp_image *image);

/* QP_BAD_INPUT, naming the path, unless it ends in .png or .exr (any case). For a check before work. */
qp_status qp_image_check_path(const char *path, qp_error *err);

/* Writes image to path; the extension decides: .png the 8-bit form, .exr the float form (32-bit). Written
 * beside its place and renamed into it, so that path is never half a picture. QP_BAD_INPUT for another
 * extension, QP_SYSTEM when it cannot be written. */
qp_status qp_image_write(const char *path, const qp_image *image, qp_error *err);

/* Reads a PNG or EXR file of one to four channels into the form that its extension implies (the other stays
 * NULL); missing colour channels repeat the first, missing alpha is 1. */
qp_status qp_image_read(const char *path, qp_image *image, qp_error *err);

/* Largest difference of a channel: of the 8-bit forms in steps of 1, else of the float forms. QP_BAD_INPUT
 * when sizes or forms do not match. */
qp_status qp_image_compare(const qp_image *a, const qp_image *b, double *max_difference, qp_error *err);

#ifdef __cplusplus
}
#endif
#endif
