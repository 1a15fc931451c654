/* Drawing of triangles into a picture of linear light. */
#ifndef QP_GL_DRAW_H
#define QP_GL_DRAW_H

#include "gl/context.h"
#include "gl/view.h"

/* One corner of a triangle as the vertex shader reads it. */
typedef struct qp_corner {
    float position[3], normal[3], uv[2];
    uint8_t colour[4]; /* the square root of linear light, for which 8 bits are enough */
} qp_corner;

typedef struct qp_draw_input {
    const qp_scene *scene;
    const qp_view *view;
    uint64_t n_points, n_triangles;
    const float *positions;    /* 3 a point */
    const uint32_t *triangles; /* 3 points a triangle */
    /* Fills the corners of triangles [first, first + count). */
    void (*fill)(const void *context, uint64_t first, uint64_t count, qp_corner *corners);
    const void *context;
} qp_draw_input;

/* Draws with 4x multisampling into pixels, 4 floats a pixel (linear light, alpha premultiplied), rows from the
 * top; width and height are the scene's. */
qp_status qp_gl_draw(qp_gl *gl, const qp_draw_input *input, float *pixels, qp_error *err);

#endif
