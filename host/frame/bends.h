/* Bounds of a bicubic spline's second derivatives. */
#ifndef QP_FRAME_BENDS_H
#define QP_FRAME_BENDS_H

/* |D2S[d, d]| <= u du^2 + v dv^2. */
typedef struct qp_bend {
    double u, v;
} qp_bend;

/* Of the uniform B-spline with the points p (row-major, v outer) over the unit square, by its quarters: x + 2 y is that of
 * [x/2, x/2 + 1/2] x [y/2, y/2 + 1/2]. width_u, width_v: what the unit square's sides are in the units of du and dv. r > 0 says what is
 * to be small: bound.u / r + bound.v r. */
void qp_spline_bends(double p[16][3], double width_u, double width_v, double r, qp_bend quarters[4]);

/* Rough mean of |S_uu| and |S_vv| of the same. */
qp_bend qp_spline_mean_bend(double p[16][3], double width_u, double width_v);

#endif
