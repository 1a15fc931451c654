/* Drawing of a surface into a picture of linear light. */
#ifndef QP_GL_DRAW_H
#define QP_GL_DRAW_H

#include "gl/context.h"
#include "gl/view.h"

typedef enum qp_gl_pass {
    QP_GL_PASS_SHADE,  /* fragments of geometry.frag.glsl */
    QP_GL_PASS_SHADOW, /* depth only */
    QP_GL_PASS_CAPTURE /* no fragments */
} qp_gl_pass;

/* What draws the surface: the one thing in which the back ends differ. */
typedef struct qp_drawer qp_drawer;
struct qp_drawer {
    /* Draws the surface in a pass, after calling set(context, program) for every program it uses, which is current then, to
     * tell it its uniforms: mat4 view_projection, and, for geometry.frag.glsl, eye and the widths of lines. */
    qp_status (*draw)(qp_drawer *drawer, qp_gl_pass pass, void (*set)(void *context, GLuint program),
                      void *context, qp_error *err);
    void (*close)(qp_drawer *drawer);
};

typedef struct qp_draw_input {
    const qp_scene *scene;
    const qp_view *view;
    uint64_t n_triangles; /* about how many, which limits the shadows */
    qp_drawer *drawer;
} qp_draw_input;

/* Draws with 4x multisampling into pixels, 4 floats a pixel (linear light, alpha premultiplied), rows from the
 * top; width and height are the scene's. */
qp_status qp_gl_draw(qp_gl *gl, const qp_draw_input *input, float *pixels, qp_error *err);

#endif
