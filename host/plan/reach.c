/* Which points samples need that keep their distance from the patch's corners, where plans are deep. */
#include "host/plan/parts.h"

#include <math.h>

/* Largest distance from the nearer end of [0,1] in [low, low + size]. */
static double farthest(double low, double size) {
    const double high = low + size;
    if (low <= 0.5 && high >= 0.5) return 0.5;
    return high < 0.5 ? high : 1 - low;
}

/* The cell of this size at (u,v) takes points up to `last`. */
static void note(qp_plan *plan, double u, double v, double size, uint32_t last) {
    const double far = fmax(farthest(u, size), farthest(v, size));
    for (uint32_t n = 0; n < QP_LEVELS; ++n)
        if (far >= ldexp(1.0, -(int)n) && last + 1 > plan->corner_rows[n]) plan->corner_rows[n] = last + 1;
}

/* The largest of `count` points, two a word, and `last`. */
static uint32_t last_of(const uint32_t *words, uint32_t count, uint32_t last) {
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t point = words[i / 2] >> (i % 2 * 16) & 0xffffu;
        if (point != QP_NO_POINT && point > last) last = point;
    }
    return last;
}

/* last: of what the node above uses here as well. */
static void walk(qp_plan *plan, uint32_t at, double u, double v, double size, uint32_t last) {
    const uint32_t *node = plan->tree + at;
    const double half = size / 2;
    switch (QP_NODE_KIND(node[0])) {
    case QP_NODE_INTERNAL:
        for (uint32_t child = 0; child < 4; ++child)
            walk(plan, node[1 + child], u + half * (child & 1u), v + half * (child >> 1), half, last);
        return;
    case QP_NODE_TERMINAL: {
        /* Rings, and what remains, lie at the corner that the rotation tells: 0 is (0,0), 1 (1,0), 2 (1,1), 3 (0,1). */
        const uint32_t corner = QP_NODE_ROTATION(node[0]);
        const bool right = corner == 1 || corner == 2, upper = corner >= 2;
        last = last_of(node + 1, 1, last);
        if ((node[0] & QP_NODE_MODE) != 0) last = last_of(plan->tree + node[2] + 5, 1, last);
        uint32_t ring_last = last;
        for (uint32_t ring = 0; ring < QP_NODE_RINGS(node[0]); ++ring, size /= 2) {
            ring_last = last_of(node + 3 + 12 * (size_t)ring, 24, last);
            note(plan, u, v, size, ring_last);
            if (right) u += size / 2;
            if (upper) v += size / 2;
        }
        walk(plan, node[2], u, v, size, ring_last);
        return;
    }
    case QP_NODE_EXTRAORDINARY:
        for (uint32_t k = 1; k < 6; ++k)
            if (k != 4) last = last_of(node + k, 1, last);
        note(plan, u, v, size, last);
        return;
    case QP_NODE_IRREGULAR:
        note(plan, u, v, size, last_of(node + 1, 12, last));
        return;
    default: /* regular and crease */
        last = last_of(node + 1, 1, last);
        note(plan, u, v, size, last_of(node + 2, 16, last));
        return;
    }
}

void qp_plan_find_reach(qp_plan *plan) {
    for (uint32_t n = 0; n < QP_LEVELS; ++n) plan->corner_rows[n] = 0;
    walk(plan, 0, 0, 0, 1, 0);
    plan->corner_rows[QP_LEVELS - 1] = plan->point_count;
}
