/* What GL's own tessellator makes of a quad patch, captured by transform feedback. */
#ifndef QP_GL_CAPTURE_H
#define QP_GL_CAPTURE_H

#include "gl/context.h"

typedef struct qp_gl_capture {
    qp_gl *gl;
    GLuint program[3][2]; /* [spacing][points] made when first used; 0: not yet */
    GLuint vertex_array, buffer, query;
    GLuint framebuffer, renderbuffer; /* nothing is drawn, but GL wants somewhere to draw */
} qp_gl_capture;

/* Coordinates in the order in which GL made them. Free both arrays with free(). */
typedef struct qp_gl_captured {
    uint32_t n_points, n_triangles;
    float *points;    /* 2 a point (point mode: each point once) */
    float *triangles; /* 6 a triangle: (u,v) of its three vertices */
} qp_gl_captured;

/* gl must outlive the capture. */
qp_status qp_gl_capture_open(qp_gl *gl, qp_gl_capture *capture, qp_error *err);
void qp_gl_capture_close(qp_gl_capture *capture);

/* Tessellates one patch with the given levels, counter-clockwise, once as triangles and once as points. */
qp_status qp_gl_capture_quad(qp_gl_capture *capture, qp_spacing spacing, const float outer[4],
                             const float inner[2], qp_gl_captured *captured, qp_error *err);
void qp_gl_captured_free(qp_gl_captured *captured);

#endif
