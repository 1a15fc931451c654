/* GL's vertices against a vertex stream. */
#ifndef QP_GL_COMPARE_H
#define QP_GL_COMPARE_H

#include "gl/tessellation.h"

typedef struct qp_gl_difference {
    uint64_t points;  /* GL's */
    uint64_t missing; /* samples of the stream that GL's tessellator has not, by the bits of (u,v) */
    uint64_t added;   /* GL's points that the stream has not, or has only once */
    double
        position_ulp; /* largest difference of a coordinate, in units of the last place of the largest coordinate of the mesh */
    double normal_max_deg;      /* at samples with a normal whose tangents are well apart */
    uint64_t normals, unjudged; /* such samples, and the others */
    uint32_t worst_patch, worst_normal_patch;
    double worst_u, worst_v, worst_normal_u, worst_normal_v;
} qp_gl_difference;

/* The stream is of qp_frame_eval with the tessellation that the surface was opened with, in float, and belongs to `frame`. Errors: of
 * GL; QP_SYSTEM for memory. A difference is no error. */
qp_status qp_gl_compare(qp_gl_surface *surface, const qp_frame *frame, const qp_stream *stream,
                        qp_gl_difference *difference, qp_error *err);

#endif
