/* Corners whose rings shrink unevenly.
 *
 * Around a sharp apex with smooth edges, say, the offsets of the rings tend to one vector A times numbers c, for the dominant
 * eigenvalue has a single mode: cells become slivers along A, and du and dv parallel, like the powers of the next eigenvalue's
 * ratio to it. Offsets in float then say nothing about what is left beside A, and normals are made of that. So those rings are kept
 * as p = c A + R: row = share * mode + rest with the mode a point of its own, the share in the points' fourth number, and the rest
 * taken in double, where it still has digits enough. With w the same combination of c as p is of the points,
 *
 *   p_u x p_v = (w_u A + R_u) x (w_v A + R_v) = p_u x (p_v - t p_u) for any t, and with t = w_v / w_u
 *   p_v - t p_u = R_v - t R_u,
 *
 * which no longer holds A, so that nothing cancels (kernels/domain.cl; with u and v exchanged where |w_v| > |w_u|). */
#include "host/plan/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rings are split when what the mode leaves of the last one is below this part of it; else nothing is to be gained. */
static const double most_rest = 0.125;

static double dot(const double *a, const double *b, uint32_t width) {
    double sum = 0.0;
    for (uint32_t w = 0; w < width; ++w) sum += a[w] * b[w];
    return sum;
}

/* One step of power iteration for the largest singular vector of a ring's rows; tells what part of the rows it left before. */
static double step(qp_builder *b, const uint32_t *points, double *mode, double *next) {
    const uint32_t width = b->local.width;
    const double square = dot(mode, mode, width);
    double all = 0.0, taken = 0.0, largest = 0.0;
    memset(next, 0, width * sizeof *next);
    for (uint32_t k = 0; k < 24; ++k) {
        const double *row = qp_plan_final_row(b, points[k]);
        const double share = dot(row, mode, width);
        all += dot(row, row, width);
        taken += share * share / square;
        for (uint32_t w = 0; w < width; ++w) next[w] += share * row[w];
    }
    for (uint32_t w = 0; w < width; ++w) largest = fmax(largest, fabs(next[w]));
    for (uint32_t w = 0; w < width && largest > 0.0; ++w) mode[w] = next[w] / largest;
    return all > taken && largest > 0.0 ? sqrt((all - taken) / all) : 0.0;
}

/* The vector that the last ring tends to, with a largest weight of 1; false where there is not one. */
static bool find_mode(qp_builder *b, const qp_chain *chain, double *mode, double *work) {
    const uint32_t *last = chain->points[chain->rings - 1], width = b->local.width;
    uint32_t longest = 0;
    double most = 0.0;
    for (uint32_t k = 0; k < 24; ++k) {
        const double *row = qp_plan_final_row(b, last[k]), square = dot(row, row, width);
        if (square > most) most = square, longest = k;
    }
    if (most == 0.0) return false;
    memcpy(mode, qp_plan_final_row(b, last[longest]), width * sizeof *mode);
    /* Squares of numbers like 4^-60 would be too small to work with. */
    const double scale = 1.0 / sqrt(most);
    for (uint32_t w = 0; w < width; ++w) mode[w] *= scale;
    double rest = 1.0;
    for (int k = 0; k < 12 && (k < 2 || rest < 4.0 * most_rest); ++k) rest = step(b, last, mode, work);
    return rest < most_rest;
}

static void split_ring(qp_builder *b, const uint32_t *points, uint32_t mode) {
    const uint32_t width = b->local.width;
    const double *row = qp_plan_final_row(b, mode), square = dot(row, row, width);
    for (uint32_t k = 0; k < 24; ++k) {
        qp_final_point *p = &b->points[points[k]];
        p->mode = (uint16_t)mode;
        p->share = dot(qp_plan_final_row(b, points[k]), row, width) / square;
        qp_plan_lower_need(b, mode, p->need);
    }
}

/* Smooth vertices have two modes alike. */
static bool is_smooth(const qp_fan *fan) {
    bool sharp = !fan->closed || fan->sharpness > 0.0f || fan->through;
    for (uint32_t j = 0; j < qp_fan_spokes(fan) && !sharp; ++j) sharp = fan->sharp[j] > 0.0f;
    return !sharp;
}

uint32_t qp_plan_split_mode(qp_builder *b, const qp_chain *chain, const qp_fan *fan, uint32_t level) {
    const uint32_t width = b->local.width;
    if (chain->rings <= chain->absolute_rings || is_smooth(fan)) return QP_NO_POINT;
    double *mode = qp_alloc(2 * (size_t)width, sizeof *mode, false);
    if (mode == NULL) {
        b->failed = true;
        return QP_NO_POINT;
    }
    uint32_t point = QP_NO_POINT;
    if (find_mode(b, chain, mode, mode + width)) {
        point = qp_plan_new_final(b, QP_LEVELS - 1, QP_POINT_MODE | level << 2);
        if (!b->failed && !b->too_large) {
            memcpy(qp_plan_final_row(b, point), mode, width * sizeof *mode);
            for (uint32_t ring = chain->absolute_rings; ring < chain->rings; ++ring)
                split_ring(b, chain->points[ring], point);
        }
    }
    free(mode);
    return point;
}
