/* Tessellation factors from a tolerance (docs/tolerance.md). */
#ifndef QP_FRAME_TOLERANCE_H
#define QP_FRAME_TOLERANCE_H

#include "host/plan/plan.h"

typedef struct qp_tolerance_report {
    double
        bound; /* of the diagonal: no point of a triangle is farther from the limit surface at the same (u,v) */
    uint64_t over; /* patches whose bound is larger than the tolerance */
    float factor_min, factor_mean,
        factor_max; /* of the edges of faces with a surface; 0 where there is none */
} qp_tolerance_report;

/* The least factors, to the next whole number and one an edge of the mesh, with which every patch stays within
 * tessellation->tolerance times the diagonal, for the positions as they are now; none beyond tessellation->factor (0: 64). Reads the
 * spacing too. edge_factors: [n_edges]. The bound counts what rounding to `precision` adds. Errors: QP_BAD_INPUT for a tolerance that
 * is not positive or a factor out of range, QP_SYSTEM for memory. */
qp_status qp_tolerance_factors(const qp_surface *surface, const qp_tessellation *tessellation,
                               qp_precision precision, float *edge_factors, qp_tolerance_report *report,
                               qp_error *err);

/* What rounding moves a sample by at most: a part of the diagonal, and a unit of the last place of the largest coordinate. */
double qp_tolerance_rounding(const qp_mesh *mesh, qp_precision precision);

#endif
