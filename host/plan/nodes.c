/* Which cells are leaves of the quadtree, and their 16 control points. */
#include "host/plan/build.h"

#include <math.h>
#include <string.h>

static bool is_quad(const qp_corner *corner, int step) {
    uint32_t j = qp_corner_face(corner, step);
    return j != QP_NONE && corner->fan->diagonal[j] != QP_NONE;
}

static bool smooth_four(const qp_corner *c) {
    const qp_fan *fan = c->fan;
    if (!fan->closed || fan->faces != 4 || fan->sharpness > 0.0f) return false;
    uint32_t infinite;
    return qp_fan_sharp_edges(fan, &infinite) == 0 && is_quad(c, 0) && is_quad(c, 1) && is_quad(c, 2) &&
           is_quad(c, 3);
}

/* A corner of a cell that is regular on its own side of infinitely sharp edges: smooth with four quads; or on
 * a crease with two quads on the cell's side; or a corner between two sharp edges. What lies beyond does not
 * matter there. */
static bool corner_is_regular(const qp_corner *c) {
    float s0 = qp_corner_sharp(c, 0), s1 = qp_corner_sharp(c, 1);
    if (qp_sharp_is_semi(s0) || qp_sharp_is_semi(s1)) return false;
    if (s0 <= 0.0f && s1 <= 0.0f) return smooth_four(c);
    uint32_t infinite, sharp = qp_fan_sharp_edges(c->fan, &infinite);
    if (s0 > 0.0f && s1 > 0.0f) return qp_sharp_is_infinite(c->fan->sharpness) || infinite >= 3;
    if (c->fan->sharpness > 0.0f || sharp != 2 || infinite != 2 || c->fan->beside) return false;
    /* The second sharp edge must bound the next face over. */
    int other = s0 > 0.0f ? 2 : -1, neighbour = s0 > 0.0f ? 1 : -1;
    return qp_sharp_is_infinite(qp_corner_sharp(c, other)) && is_quad(c, neighbour);
}

bool qp_cell_is_regular(const qp_cell *cell) {
    if (cell->n != 4) return false;
    for (uint32_t i = 0; i < 4; ++i) {
        if (!corner_is_regular(&cell->corner[i])) return false;
    }
    return true;
}

/* A corner at which the crease of sharpness s runs straight on: valence 4, two sharp spokes opposite each
 * other. */
static bool crease_goes_on(const qp_corner *c, int step, float s) {
    const qp_fan *fan = c->fan;
    if (!fan->closed || fan->faces != 4 || fan->sharpness > 0.0f) return false;
    uint32_t infinite;
    /* Chaikin: its far half must decay as the near one does, or the crease is not constant. */
    bool constant = fan->far_sharp[qp_corner_spoke(c, step + 2)] == qp_sharp_decrement(s);
    return constant && qp_fan_sharp_edges(fan, &infinite) == 2 && qp_corner_sharp(c, step) == s &&
           qp_corner_sharp(c, step + 2) == s && is_quad(c, 0) && is_quad(c, 1) && is_quad(c, 2) &&
           is_quad(c, 3);
}

int qp_cell_crease_edge(const qp_cell *cell) {
    if (cell->n != 4) return -1;
    for (uint32_t i = 0; i < 4; ++i) {
        float s = qp_corner_sharp(&cell->corner[i], 0);
        if (!qp_sharp_is_semi(s)) continue;
        const qp_corner *next = &cell->corner[(i + 1) & 3];
        bool goes_on = crease_goes_on(&cell->corner[i], 0, s) && crease_goes_on(next, 1, s);
        if (goes_on && smooth_four(&cell->corner[(i + 2) & 3]) && smooth_four(&cell->corner[(i + 3) & 3])) {
            return (int)i;
        }
        return -1;
    }
    return -1;
}

/* 2a - b: the point beyond a sharp edge that makes the uniform B-spline end there. Subdividing the
 * extrapolated row by the regular rules gives the crease rules on the edge and the extrapolated row of the
 * next level, so no other case is needed. */
static uint32_t phantom(qp_local *local, qp_level *level, uint32_t a, uint32_t b) {
    bool fresh;
    uint32_t point = qp_level_point(local, level, QP_KEY_PHANTOM, a, b, &fresh);
    if (!fresh || local->failed) return point;
    double *row = qp_level_row(local, level, point);
    const double *ra = qp_level_row(local, level, a), *rb = qp_level_row(local, level, b);
    for (uint32_t k = 0; k < local->width; ++k) row[k] = 2.0 * ra[k] - rb[k];
    return point;
}

void qp_cell_points(qp_local *local, qp_level *level, const qp_cell *cell, uint32_t rotation,
                    uint32_t points[16]) {
    const qp_corner *c[4];
    bool sharp[4];
    for (uint32_t i = 0; i < 4; ++i) {
        c[i] = &cell->corner[(rotation + i) & 3];
        sharp[i] = qp_sharp_is_infinite(qp_corner_sharp(c[i], 0));
        points[qp_grid_inner[i]] = c[i]->fan->vertex;
    }
    for (uint32_t i = 0; i < 4; ++i) {
        uint32_t next = (i + 1) & 3, prev = (i + 3) & 3, far = (i + 2) & 3;
        if (sharp[i]) {
            points[qp_grid_beyond_a[i]] =
                phantom(local, level, points[qp_grid_inner[i]], points[qp_grid_inner[prev]]);
            points[qp_grid_beyond_b[i]] =
                phantom(local, level, points[qp_grid_inner[next]], points[qp_grid_inner[far]]);
        } else {
            points[qp_grid_beyond_a[i]] = c[i]->fan->spoke[qp_corner_spoke(c[i], -1)];
            points[qp_grid_beyond_b[i]] = c[next]->fan->spoke[qp_corner_spoke(c[next], 2)];
        }
    }
    for (uint32_t i = 0; i < 4; ++i) {
        uint32_t prev = (i + 3) & 3;
        if (sharp[i]) {
            points[qp_grid_outer[i]] =
                phantom(local, level, points[qp_grid_beyond_b[prev]], points[qp_grid_beyond_a[prev]]);
        } else if (sharp[prev]) {
            points[qp_grid_outer[i]] =
                phantom(local, level, points[qp_grid_beyond_a[i]], points[qp_grid_beyond_b[i]]);
        } else {
            points[qp_grid_outer[i]] = c[i]->fan->diagonal[qp_corner_face(c[i], 2)];
        }
    }
}

/* ---- single semi-sharp creases ----
 * Niessner, Loop, Greiner 2012, "Efficient evaluation of semi-smooth creases". A straight crease of constant
 * sharpness s makes the surface a tensor product: along it the uniform B-spline, across it a curve with
 * points q_-1, q_0 (on the crease), q_1, q_2, whose rule at q_0 is sharp for m = floor(s) steps, then a blend
 * of share f = s - m, then smooth. The cell [2^-(k+1), 2^-k] of parameter v needs the points of level k only:
 *   v >= 2^-m:                 no step but sharp ones has touched it: as if infinitely sharp, q_-1 = 2 q_0 -
 * q_1 2^-(m+1) <= v < 2^-m:      one step with the blend: f times the infinitely sharp curve plus 1-f times
 * the smooth one of level m below:                     the smooth curve of level m+1 */

static void multiply(const double a[16], const double b[16], double out[16]) {
    double r[16];
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
            r[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j] +
                           a[4 * i + 3] * b[12 + j];
        }
    }
    memcpy(out, r, sizeof r);
}

void qp_crease_constants(float s, double *constants) {
    static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    static const double infinite[16] = {0, 2, -1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    static const double sharp_step[16] = {.5, .5, 0, 0, 0, 1, 0, 0, 0, .5, .5, 0, 0, .125, .75, .125};
    int m = (int)floorf(s);
    double f = (double)s - m;
    double steps[16], blend[16], last[16];
    memcpy(steps, identity, sizeof steps);
    for (int i = 0; i < m; ++i) multiply(sharp_step, steps, steps);
    for (int i = 0; i < 16; ++i) blend[i] = (1.0 - f) * identity[i] + f * infinite[i];
    memcpy(last, sharp_step, sizeof last);
    last[4] = (1.0 - f) * 0.125;
    last[5] = (1.0 - f) * 0.75 + f;
    last[6] = (1.0 - f) * 0.125;
    constants[0] = ldexp(1.0, -m);
    constants[1] = f > 0.0 ? ldexp(1.0, -(m + 1)) : constants[0];
    constants[2] = 1.0;
    constants[3] = ldexp(1.0, m);
    constants[4] = f > 0.0 ? ldexp(1.0, m + 1) : constants[3];
    memcpy(constants + 5, infinite, sizeof infinite);
    multiply(blend, steps, constants + 21);
    if (f > 0.0) {
        multiply(last, steps, constants + 37);
    } else {
        memcpy(constants + 37, steps, sizeof steps);
    }
}
