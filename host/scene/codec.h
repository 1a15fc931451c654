/* Between image_file.c and image.cpp, the face of OpenImageIO. That is a module of its own, loaded when the first
 * picture is read or written: OpenImageIO brings some 250 shared libraries along, a quarter of a second at the
 * start of every subcommand, most of which have no pictures. */
#ifndef QP_SCENE_CODEC_H
#define QP_SCENE_CODEC_H

#include "host/scene/image.h"

typedef struct qp_image_codec {
    /* The file that holds the form which png asks for, in memory for the caller to free(); path is for messages.
     * In memory, because OpenImageIO's PNG writer does not notice a full disk. */
    qp_status (*encode)(const char *path, const qp_image *image, bool png, void **bytes, size_t *size,
                        qp_error *err);
    /* As qp_image_read, into a zeroed image. */
    qp_status (*read)(const char *path, qp_image *image, bool png, qp_error *err);
} qp_image_codec;

/* The module's one symbol: `const qp_image_codec qp_image_module`. */
#define QP_IMAGE_MODULE_SYMBOL "qp_image_module"

#endif
