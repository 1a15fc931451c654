/* The tessellator's grids, each distinct one once. */
#ifndef QP_FRAME_GRIDS_H
#define QP_FRAME_GRIDS_H

#include "host/frame/share.h"
#include "host/frame/tessellator.h"

/* What a grid depends on: outer factors 0..3, inner factors u, v, and WHOLE or which quarter of its patch it covers. */
enum { QP_GRID_FACTORS = 7, QP_GRID_WHOLE = 4 };

typedef struct qp_grid {
    qp_tess_grid tess; /* (u,v) in the patch's coordinates */
    qp_rim rim;
    uint32_t level; /* below QP_LEVELS: rows that are enough for all points */
    double
        nearest; /* distance (of the larger coordinate) between a corner of the patch and the point next to it; > 1: none */
    size_t first;  /* of its points in the layout being made */
    uint64_t used; /* number of the layout that has it, from 1 on */
} qp_grid;

/* Zero-initialise, but for spacing and triangles. */
typedef struct qp_grids {
    qp_spacing spacing;
    bool triangles; /* are wanted */
    float *factors; /* [QP_GRID_FACTORS * count] */
    qp_grid *list;  /* [count], of which the first `made` are made */
    size_t count, made, factor_capacity, capacity;
    uint64_t points; /* of those that are made */
    uint32_t *slots; /* [n_slots], a power of two: a hash table of indices */
    size_t n_slots;
} qp_grids;

/* Index of a grid, entered if it is new; QP_NONE when memory is out. */
uint32_t qp_grids_find(qp_grids *grids, const float factors[QP_GRID_FACTORS]);
/* Makes those that are new, in parallel. Errors: QP_SYSTEM for memory. */
qp_status qp_grids_make(qp_grids *grids, qp_error *err);
/* Forgets all; spacing and triangles stay. */
void qp_grids_clear(qp_grids *grids);

#endif
