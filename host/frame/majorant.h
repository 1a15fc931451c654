/* How much the surface of a patch bends: what bounds its distance from triangles whose corners lie on it (docs/tolerance.md). */
#ifndef QP_FRAME_MAJORANT_H
#define QP_FRAME_MAJORANT_H

#include "host/plan/plan.h"

/* A convex function of one coordinate in [0,1], quadratic between the places .at; the last piece begins, and ends, at 1. */
typedef struct qp_majorant {
    uint32_t count; /* pieces, the last one included */
    struct qp_majorant_piece {
        double at, bend; /* second derivative from here to the next piece */
        double slope, value;
    } * pieces;
} qp_majorant;

/* Of a patch: for any triangle of (u,v) with corners t_0, t_1, t_2 in [0,1]^2 and any x in it with barycentric weights w_i,
 *   | sum w_i S(t_i) - S(x) | <= gap of u + gap of v + rest,
 * gaps over the ranges that u and v have in the triangle. Units of the positions. */
typedef struct qp_patch_majorant {
    qp_majorant u, v;
    double rest;
} qp_patch_majorant;

/* Those of all patches, from the mesh's positions as they are now. A patch without surface has no pieces. Errors: QP_SYSTEM for
 * memory. Linear time, in parallel; makes deep plans for what has extraordinary corners. */
qp_status qp_majorants_make(const qp_surface *surface, qp_patch_majorant **majorants, qp_error *err);
void qp_majorants_free(qp_patch_majorant *majorants, uint32_t n_patches);

/* The most by which the chord over [from, to] lies above the function: what linear interpolation errs by. */
double qp_majorant_gap(const qp_majorant *majorant, double from, double to);

#endif
