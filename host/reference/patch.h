/* The uniform bicubic B-spline of a regular cell. */
#ifndef QP_REFERENCE_PATCH_H
#define QP_REFERENCE_PATCH_H

#include <float.h>

#include "host/reference/piece.h"

/* The last sum over 16 points: relative to one of them, subtracted in qp_quad before, a 64-bit significand
 * keeps 1e-19 of the cell's size, whatever its depth. */
#if LDBL_MANT_DIG >= 64
typedef long double qp_leaf_real;
#else
typedef qp_quad qp_leaf_real;
#endif

typedef struct qp_leaf {
    qp_quad origin[3];
    qp_leaf_real points[4][4][3]; /* [v][u], relative to origin; (1,1) .. (2,2) are the cell's corners */
} qp_leaf;

/* Fills *leaf when the surface over the quad is one bicubic patch: every corner regular, or a regular crease
 * or corner of infinitely sharp edges, behind which points are extrapolated. The quad's vertices must be
 * complete. */
bool qp_leaf_make(const qp_piece *mesh, uint32_t face, qp_leaf *leaf);

/* Position and derivatives at (u,v) in [0,1]^2 of the cell. */
void qp_leaf_eval(const qp_leaf *leaf, double u, double v, qp_quad p[3], qp_leaf_real du[3],
                  qp_leaf_real dv[3]);

#endif
