/* What the points of a plan are computed relative to.
 *
 * A control point is a sum of weights times differences of positions. Taken from the patch's own origin, two patches that share a
 * point would round it differently. So every point has an *anchor* that belongs to the surface and not to the patch: the corner
 * whose terminal node holds the point, which all patches around that corner agree upon. Points that no terminal holds take the
 * patch's base, the first corner with a terminal (whatever the plan's depth, so that deeper plans have the same bits). Points that are
 * positions are then moved from their anchor to the base. With sums in the
 * order of global vertices (host/frame/rings.c) a shared point has the same bits in all of these patches, so that
 * a cache may hand it on (section 8.2 of the paper). */
#include "host/plan/parts.h"

#include <stdlib.h>

enum { NO_ANCHOR = 255 };

typedef struct walk {
    const uint32_t *tree;
    uint8_t *anchors;
} walk;

static void claim(const walk *w, uint32_t point, uint8_t corner) {
    if (point != QP_NO_POINT && corner < w->anchors[point]) w->anchors[point] = corner;
}

/* Where (0,0) of a frame turned by a rotation lies in the frame before: corners counter-clockwise from (0,0). */
static const double turned[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

static uint8_t nearest_corner(double u, double v) {
    return v < 0.5 ? (u < 0.5 ? 0 : 1) : (u < 0.5 ? 3 : 2);
}

/* The terminal at `node` of the cell from (u,v) on. */
static void claim_terminal(const walk *w, const uint32_t *node, double u, double v, double size) {
    const double *at = turned[QP_NODE_ROTATION(node[0])];
    const uint8_t corner = nearest_corner(u + size * at[0], v + size * at[1]);
    const uint32_t rings = QP_NODE_RINGS(node[0]);
    claim(w, node[1], corner);
    for (uint32_t k = 0; k < 24 * rings; ++k) claim(w, node[3 + k / 2] >> (k % 2 * 16) & 0xffffu, corner);
    const uint32_t *tail = w->tree + node[2];
    if (QP_NODE_KIND(tail[0]) != QP_NODE_EXTRAORDINARY) return;
    for (uint32_t k = 1; k <= 3; ++k) claim(w, tail[k], corner);
    claim(w, tail[5], corner);
}

static void claim_cell(const walk *w, uint32_t at, double u, double v, double size) {
    const uint32_t *node = w->tree + at;
    if (QP_NODE_KIND(node[0]) == QP_NODE_TERMINAL) claim_terminal(w, node, u, v, size);
    if (QP_NODE_KIND(node[0]) != QP_NODE_INTERNAL) return;
    const double half = 0.5 * size;
    for (uint32_t c = 0; c < 4; ++c)
        claim_cell(w, node[1 + c], u + (c & 1 ? half : 0), v + (c & 2 ? half : 0), half);
}

static bool is_position(const qp_plan *plan, uint32_t point) {
    const double *row = plan->weights + (size_t)point * plan->ring_size;
    double sum = 0.0;
    for (uint32_t j = 0; j < plan->ring_size; ++j) sum += row[j];
    return sum > 0.5;
}

void qp_plan_anchor(qp_plan *plan) {
    const walk w = {plan->tree, plan->point_anchors};
    for (uint32_t i = 0; i < plan->point_count; ++i) plan->point_anchors[i] = NO_ANCHOR;
    claim_cell(&w, 0, 0.0, 0.0, 1.0);
    plan->base = 4;
    for (uint32_t i = 0; i < plan->point_count; ++i)
        if (plan->point_anchors[i] < plan->base) plan->base = plan->point_anchors[i];
    plan->base %= 4; /* none */
    for (uint32_t i = 0; i < plan->point_count; ++i) {
        uint8_t *anchor = &plan->point_anchors[i];
        if (*anchor == NO_ANCHOR) *anchor = plan->base;
        if (*anchor == plan->base) continue;
        plan->flags |= QP_PLAN_ANCHORS;
        if (is_position(plan, i)) *anchor |= QP_ANCHOR_MOVES;
    }
}
