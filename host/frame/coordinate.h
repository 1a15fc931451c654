/* Signed coordinates, as kernels/frame_layout.h defines them, on the host. All of this is exact. */
#ifndef QP_FRAME_COORDINATE_H
#define QP_FRAME_COORDINATE_H

#include <math.h>
#include <stdbool.h>

/* 1 - x */
static inline double qp_coordinate_mirrored(double x) {
    return x == 0.5 ? x : -x;
}

/* 2x - upper: the place in that half of [0,1]. */
static inline double qp_coordinate_in_half(double x, bool upper) {
    const double t = 2.0 * fabs(x), lower = t <= 0.5 ? t : -(1.0 - t);
    return upper ? qp_coordinate_mirrored(lower) : lower;
}

#endif
