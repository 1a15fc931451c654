/* Tessellation factors of every patch, from a uniform factor, one a mesh edge, or as given. */
#ifndef QP_FRAME_FACTORS_H
#define QP_FRAME_FACTORS_H

#include "host/plan/plan.h"

/* A patch is tessellated in parts: none (no surface, or discarded), itself, or its four quarters. Quarter q is the patch's
 * [x, x + 1/2] x [y, y + 1/2] with x = (q & 1) / 2, y = (q >> 1) / 2. */
typedef struct qp_part_factors {
    uint64_t *first; /* [n_patches + 1] parts of the patches before; a patch has 0, 1 or 4 */
    float *values;   /* [6 * parts]: outer 0..3 (edges u=0, v=0, u=1, v=1 of the part), inner u, v */
} qp_part_factors;

/* The factors of one patch after the other, which takes a byte or two a face and edge. */
typedef struct qp_factors qp_factors;
enum { QP_FACTORS_MOST = 24 }; /* of four quarters */

/* Keeps the pointers, which must outlive it. Errors: QP_BAD_INPUT for a uniform or edge factor that is not in [1, 64] and for an
 * unknown spacing, QP_SYSTEM for memory. */
qp_status qp_factors_open(const qp_surface *surface, const qp_tessellation *tessellation, qp_factors **factors,
                          qp_error *err);
/* Parts of a patch: 0, 1 or 4, with 6 values each, as below. Patches of one face are best asked for one after the other. */
uint32_t qp_factors_of(qp_factors *factors, uint32_t patch, float values[QP_FACTORS_MOST]);
void qp_factors_close(qp_factors *factors);

/* Of all patches. Errors as above. Frees what it made when it fails. */
qp_status qp_factors_make(const qp_surface *surface, const qp_tessellation *tessellation,
                          qp_part_factors *factors, qp_error *err);
void qp_factors_free(qp_part_factors *factors);

#endif
