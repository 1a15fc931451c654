/* The back ends: what can draw a surface. Each is made for one GL context and one evaluated frame, and closed by its own close. */
#ifndef QP_GL_DRAWERS_H
#define QP_GL_DRAWERS_H

#include "gl/draw.h"
#include "host/frame/frame.h"

/* What they draw. All pointers outlive the drawer. */
typedef struct qp_drawn {
    const qp_scene *scene;
    const qp_frame *frame;
    const qp_surface *surface;
    const qp_tessellation *tessellation;
    const qp_stream *stream;    /* with triangles */
    const float *positions;     /* 3 a sample of the stream, finite */
    const uint32_t *components; /* of each patch, where the scene colours by them */
} qp_drawn;

/* Number k of a sample (position, then normal), as GL takes it. */
static inline float qp_drawn_number(const qp_stream *stream, size_t sample, size_t k) {
    return stream->precision == QP_DOUBLE ? (float)((const double *)stream->vertices)[6 * sample + k]
                                          : ((const float *)stream->vertices)[6 * sample + k];
}

/* Triangles of the vertex stream. */
qp_status qp_drawer_stream(qp_gl *gl, const qp_drawn *drawn, qp_drawer **drawer, qp_error *err);
/* GL's own tessellator and shaders (tessellation.h). */
qp_status qp_drawer_tessellation(qp_gl *gl, const qp_drawn *drawn, qp_drawer **drawer, qp_error *err);

#endif
