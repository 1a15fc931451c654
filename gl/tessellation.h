/* The tessellation path: a surface drawn by GL's own pipeline from the plans' bytes. A compute shader is the hull stage, the evaluation
 * shader walks the quadtree (sections 5 to 7 of the paper, in GLSL of its own; nothing of kernels/ runs here), so that it is an
 * independent check of the OpenCL path. */
#ifndef QP_GL_TESSELLATION_H
#define QP_GL_TESSELLATION_H

#include "gl/draw.h"
#include "host/frame/frame.h"

typedef struct qp_gl_surface qp_gl_surface;

/* Takes plans, factors and positions from a frame after qp_frame_eval with this tessellation (copied; the frame may go on). colours: 3
 * floats of linear light a patch, or NULL for white. Errors: QP_SYSTEM where the GL is older than 4.5, its buffers are too small, or
 * memory is short; what qp_factors_make refuses. */
qp_status qp_gl_surface_open(qp_gl *gl, const qp_frame *frame, const qp_tessellation *tessellation,
                             const float *colours, qp_gl_surface **surface, qp_error *err);
void qp_gl_surface_close(qp_gl_surface *surface);

/* ---- Drawing ---- */

enum { QP_GL_GENERAL = 0, QP_GL_REGULAR = 1, QP_GL_KINDS = 2 };

/* Has it no patches of a kind? */
bool qp_gl_surface_is_empty(const qp_gl_surface *surface, int kind);
/* The program of a pass for regular patches or all others, made when it is first asked for; the caller sets its uniforms but for those
 * that place the local frame. */
qp_status qp_gl_surface_program(qp_gl_surface *surface, qp_gl_pass pass, int kind, GLuint *program,
                                qp_error *err);
/* Draws all patches of a kind with that program, which is current afterwards. */
qp_status qp_gl_surface_draw(qp_gl_surface *surface, qp_gl_pass pass, int kind, qp_error *err);

/* ---- Reading back ---- */

/* A vertex as the evaluation shader made it. */
typedef struct qp_gl_vertex {
    float position[3], normal[3]; /* normal 0 0 0: none found */
    float uv[2];                  /* in the patch */
    int32_t part;                 /* item of the frame's layout */
    float sine; /* of the angle between the tangents; where it is small the normal says little */
} qp_gl_vertex;

/* Hands all of the tessellator's points, each once, to `take`, some patches at a time in the order of parts within each kind. Stops at
 * the first status that is not QP_OK. */
typedef qp_status (*qp_gl_take)(void *context, const qp_gl_vertex *vertices, size_t count, qp_error *err);
qp_status qp_gl_surface_capture(qp_gl_surface *surface, qp_gl_take take, void *context, qp_error *err);

#endif
