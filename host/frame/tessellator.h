/* The fixed-function tessellator of the OpenGL / D3D11 quad domain, on the host. */
#ifndef QP_FRAME_TESSELLATOR_H
#define QP_FRAME_TESSELLATOR_H

#include "host/base/status.h"

typedef struct qp_tess_grid {
    uint32_t n_points, n_triangles;
    float *uv;                                /* 2 a point */
    uint32_t *triangles;                      /* 3 a triangle, counter-clockwise in (u,v) */
    size_t point_capacity, triangle_capacity; /* in elements of the arrays */
} qp_tess_grid;

/* Points and triangles of one patch, bit for bit and in the order in which a GL implementation makes them
 * (Mesa's llvmpipe). outer: edges u=0, v=0, u=1, v=1; inner: along u, along v. Factors are clamped to [1,64]
 * as GL does for each spacing; any outer <= 0 or NaN gives an empty grid. Reuses grid's arrays;
 * zero-initialise it first. QP_SYSTEM when memory is out. */
qp_status qp_tessellate(qp_spacing spacing, const float outer[4], const float inner[2], qp_tess_grid *grid,
                        qp_error *err);
void qp_tess_grid_free(qp_tess_grid *grid);

/* Level whose plan rows are enough for every point of the grid: the smallest n such that each (u,v)
 * coordinate is 0, 1 or at least 2^-n away from both (for equal spacing, ceil(log2 f), the paper's
 * section 4.2). */
uint32_t qp_tess_grid_level(const qp_tess_grid *grid);

#endif
