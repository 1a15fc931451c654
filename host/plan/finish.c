/* The finished plan: points sorted by the level that needs them, nodes renumbered. */
#include "host/plan/parts.h"

#include <stdlib.h>
#include <string.h>

/* Where each point goes: in order of the level that needs it, and made, within a level. */
static void sort_points(const qp_final_point *points, uint32_t count, uint32_t *index) {
    uint32_t next[QP_LEVELS + 1] = {0};
    for (uint32_t i = 0; i < count; ++i) ++next[points[i].need + 1];
    for (uint32_t n = 1; n <= QP_LEVELS; ++n) next[n] += next[n - 1];
    for (uint32_t i = 0; i < count; ++i) index[i] = next[points[i].need]++;
}

static void renumber(uint32_t *words, uint32_t count, const uint32_t *index) {
    for (uint32_t w = 0; w < count; ++w) {
        uint32_t low = words[w] & 0xffffu, high = words[w] >> 16;
        words[w] = (low == QP_NO_POINT ? low : index[low]) | (high == QP_NO_POINT ? high : index[high]) << 16;
    }
}

static void renumber_word(uint32_t *word, const uint32_t *index) {
    if (*word != QP_NO_POINT) *word = index[*word];
}

static void renumber_tree(qp_plan *plan, const uint32_t *index) {
    for (uint32_t at = 0; at < plan->tree_words;) {
        uint32_t *node = plan->tree + at;
        switch (QP_NODE_KIND(node[0])) {
        case QP_NODE_INTERNAL:
            at += 5;
            break;
        case QP_NODE_CREASE:
            node[10] += qp_plan_first_constant(plan); /* fall through */
        case QP_NODE_REGULAR:
            renumber_word(node + 1, index);
            renumber(node + 2, 8, index);
            at += QP_NODE_KIND(node[0]) == QP_NODE_CREASE ? 11 : 10;
            break;
        case QP_NODE_TERMINAL:
            renumber_word(node + 1, index);
            renumber(node + 3, 12 * QP_NODE_RINGS(node[0]), index);
            at += 3 + 12 * QP_NODE_RINGS(node[0]);
            break;
        case QP_NODE_EXTRAORDINARY:
            for (uint32_t k = 1; k < 4; ++k) renumber_word(node + k, index);
            renumber_word(node + 5, index);
            node[4] += qp_plan_first_constant(plan);
            at += 6;
            break;
        default:
            renumber(node + 1, 6, index);
            at += 7;
            break;
        }
    }
}

qp_plan *qp_plan_finish(qp_builder *b) {
    uint32_t width = b->local.width, count = b->point_count;
    qp_plan *plan = qp_alloc(1, sizeof *plan, true);
    uint32_t *index = qp_alloc(count, sizeof *index, false);
    if (plan != NULL) {
        plan->tree = qp_alloc(b->tree_words, sizeof *plan->tree, false);
        plan->weights = qp_alloc((size_t)count * width, sizeof *plan->weights, false);
        plan->constants = qp_alloc(b->constant_count, sizeof *plan->constants, false);
        plan->point_kinds = qp_alloc(count, 1, false);
        plan->point_origins = qp_alloc(count, sizeof *plan->point_origins, false);
        plan->point_scales = qp_alloc(count, 1, false);
        plan->point_anchors = qp_alloc(count, 1, false);
        plan->point_modes = qp_alloc(count, sizeof *plan->point_modes, false);
        plan->point_shares = qp_alloc(count, sizeof *plan->point_shares, false);
    }
    if (plan == NULL || index == NULL || plan->tree == NULL || plan->weights == NULL ||
        plan->constants == NULL || plan->point_kinds == NULL || plan->point_origins == NULL ||
        plan->point_scales == NULL || plan->point_anchors == NULL || plan->point_modes == NULL || plan->point_shares == NULL) {
        free(index);
        qp_plan_free(plan);
        b->failed = true;
        return NULL;
    }
    plan->ring_size = width;
    plan->point_count = count;
    plan->tree_words = b->tree_words;
    plan->constant_count = b->constant_count;
    plan->node_count = b->node_count;
    plan->flags = b->flags;
    plan->depth = b->depth;
    memcpy(plan->tree, b->tree, b->tree_words * sizeof *plan->tree);
    if (b->constant_count > 0) {
        memcpy(plan->constants, b->constants, b->constant_count * sizeof *plan->constants);
    }
    sort_points(b->points, count, index);
    for (uint32_t i = 0; i < count; ++i) {
        const qp_final_point *p = &b->points[i];
        const uint32_t at = index[i];
        plan->point_kinds[at] = p->kind;
        plan->point_scales[at] = p->scale;
        plan->point_shares[at] = p->share;
        plan->point_origins[at] = p->origin == QP_NO_POINT ? p->origin : (uint16_t)index[p->origin];
        plan->point_modes[at] = p->mode == QP_NO_POINT ? p->mode : (uint16_t)index[p->mode];
        memcpy(plan->weights + (size_t)at * width, qp_plan_final_row(b, i), width * sizeof(double));
        for (uint32_t n = p->need; n < QP_LEVELS; ++n) ++plan->rows[n];
    }
    plan->rows[QP_LEVELS - 1] = count;
    renumber_tree(plan, index);
    qp_plan_anchor(plan);
    qp_plan_find_reach(plan);
    free(index);
    return plan;
}
