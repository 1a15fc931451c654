#include "host/plan/parts.h"

#include <stdlib.h>
#include <string.h>

void qp_builder_free(qp_builder *b) {
    qp_local_free(&b->local);
    qp_local_free(&b->tail);
    free(b->rows);
    free(b->points);
    free(b->tree);
    free(b->constants);
    free(b->chains);
    free(b->corner_rows);
    for (int i = 0; i < 2; ++i) {
        free(b->absolute[i].of);
        free(b->offsets[i].of);
        free(b->items[i]);
    }
    *b = (qp_builder){0};
}

void qp_plan_free(qp_plan *plan) {
    if (plan == NULL) return;
    free(plan->tree);
    free(plan->weights);
    free(plan->constants);
    free(plan->point_kinds);
    free(plan->point_origins);
    free(plan->point_scales);
    free(plan->point_anchors);
    free(plan->point_modes);
    free(plan->point_shares);
    free(plan);
}

/* ---- tree ---- */

uint32_t qp_plan_new_node(qp_builder *b, uint32_t words) {
    b->tree = qp_plan_grown(b, b->tree, &b->tree_capacity, (size_t)b->tree_words + words, sizeof *b->tree);
    if (b->failed) return 0;
    uint32_t node = b->tree_words;
    memset(b->tree + node, 0, words * sizeof *b->tree);
    b->tree_words += words;
    ++b->node_count;
    return node;
}

/* Tells a node's parent where it is. */
void qp_plan_link_node(qp_builder *b, const qp_item *item, uint32_t node) {
    if (!b->failed && item->parent_word != QP_NONE) b->tree[item->parent_word] = node;
}

void qp_plan_put_point(uint32_t *words, uint32_t slot, uint32_t point) {
    words[slot / 2] |= point << (slot % 2 * 16);
}

/* The limit of a patch's corner close to the leaf, at most 4 of its sizes away, for its points to be stored as offsets from: as
 * they are they would lose a digit of their differences, and so of derivatives, every few levels. */
static uint32_t leaf_origin(qp_builder *b, uint32_t level, const qp_item *item) {
    if (level - b->base <= QP_PLAN_SHARED_LEVELS) return QP_NO_POINT;
    const uint64_t reach = 4 * (QP_PLAN_ONE >> (level - b->base));
    for (uint32_t i = 0; i < 4; ++i) {
        const uint64_t u = qp_plan_corner_high_u(i) ? QP_PLAN_ONE - item->u.lo : item->u.hi;
        const uint64_t v = qp_plan_corner_high_v(i) ? QP_PLAN_ONE - item->v.lo : item->v.hi;
        if (u <= reach && v <= reach) return qp_plan_corner_origin(b, i);
    }
    return QP_NO_POINT;
}

static void put_leaf(qp_builder *b, uint32_t level, const qp_item *item, int crease) {
    uint32_t rotation = crease < 0 ? 0 : (uint32_t)crease, ids[16];
    qp_level *points = &b->local.level[level & 1];
    qp_cell_points(&b->local, points, item->cell, rotation, ids);
    uint32_t node = qp_plan_new_node(b, crease < 0 ? 10 : 11);
    if (b->failed || b->local.failed) return;
    b->tree[node] = (crease < 0 ? QP_NODE_REGULAR : QP_NODE_CREASE) | rotation << 3;
    uint8_t need = qp_plan_cell_need(item->u, item->v);
    const uint32_t origin = leaf_origin(b, level, item);
    if (b->failed || b->too_large) return;
    b->tree[node + 1] = origin;
    for (uint32_t k = 0; k < 16; ++k) {
        uint32_t final = origin == QP_NO_POINT ? qp_plan_shared_final(b, level, ids[k], need)
                                               : qp_plan_offset_final(b, level, ids[k], need, origin);
        if (b->failed || b->too_large) return;
        qp_plan_put_point(b->tree + node + 2, k, final);
    }
    if (crease >= 0) {
        b->flags |= QP_PLAN_CREASE;
        b->constants = qp_plan_grown(b, b->constants, &b->constant_capacity,
                                     (size_t)b->constant_count + QP_CREASE_REALS, sizeof *b->constants);
        if (b->failed) return;
        qp_crease_constants(qp_corner_sharp(&item->cell->corner[crease], 0),
                            b->constants + b->constant_count);
        b->tree[node + 10] = b->constant_count;
        b->constant_count += QP_CREASE_REALS;
    }
    qp_plan_link_node(b, item, node);
}

static void put_irregular(qp_builder *b, uint32_t level, const qp_item *item) {
    uint32_t node = qp_plan_new_node(b, 7);
    if (b->failed) return;
    b->flags |= QP_PLAN_CORNERS | QP_PLAN_IRREGULAR;
    b->tree[node] = QP_NODE_IRREGULAR;
    for (uint32_t i = 0; i < 4; ++i) {
        uint64_t u = qp_plan_corner_high_u(i) ? item->u.hi : item->u.lo,
                 v = qp_plan_corner_high_v(i) ? item->v.hi : item->v.lo;
        uint32_t out[3];
        qp_plan_limit_finals(b, level, &item->cell->corner[i], qp_plan_point_need(u, v), out);
        if (b->failed || b->too_large) return;
        for (uint32_t k = 0; k < 3; ++k) qp_plan_put_point(b->tree + node + 1, 3 * i + k, out[k]);
    }
    qp_plan_link_node(b, item, node);
}

void qp_plan_push_item(qp_builder *b, uint32_t level, qp_item item) {
    uint32_t side = level & 1;
    b->items[side] = qp_plan_grown(b, b->items[side], &b->item_capacity[side],
                                   (size_t)b->item_count[side] + 1, sizeof(qp_item));
    if (!b->failed) b->items[side][b->item_count[side]++] = item;
}

qp_item qp_plan_child_item(const qp_item *item, qp_cell *children, uint32_t i, bool tie_u, bool tie_v) {
    return (qp_item){.cell = &children[i],
                     .u = qp_plan_half(item->u, qp_plan_corner_high_u(i), tie_u),
                     .v = qp_plan_half(item->v, qp_plan_corner_high_v(i), tie_v),
                     .parent_word = QP_NONE,
                     .chain = QP_NONE};
}

static void put_internal(qp_builder *b, uint32_t level, const qp_item *item, qp_cell *children) {
    /* A sample on a split goes to the child farther from the patch's edge; at the patch's middle to the side
     * with fewer irregular cells, which needs fewer points. Child order in the tree is (u, v) binary: corners
     * 0, 1, 3, 2. */
    static const uint8_t place[4] = {0, 1, 3, 2};
    uint64_t mid_u = (item->u.lo + item->u.hi) / 2, mid_v = (item->v.lo + item->v.hi) / 2;
    bool irregular[4];
    for (uint32_t i = 0; i < 4; ++i) irregular[i] = !qp_cell_is_regular(&children[i]);
    bool tie_u = mid_u > QP_PLAN_ONE / 2, tie_v = mid_v > QP_PLAN_ONE / 2;
    if (mid_u == QP_PLAN_ONE / 2) tie_u = irregular[1] + irregular[2] > irregular[0] + irregular[3];
    if (mid_v == QP_PLAN_ONE / 2) tie_v = irregular[2] + irregular[3] > irregular[0] + irregular[1];
    uint32_t node = qp_plan_new_node(b, 5);
    if (b->failed) return;
    b->flags |= QP_PLAN_INTERNAL;
    b->tree[node] = QP_NODE_INTERNAL | (tie_u ? 1u << 5 : 0) | (tie_v ? 1u << 6 : 0);
    qp_plan_link_node(b, item, node);
    for (uint32_t i = 0; i < 4; ++i) {
        qp_item child = qp_plan_child_item(item, children, i, tie_u, tie_v);
        child.parent_word = node + 1 + place[i];
        qp_plan_push_item(b, level + 1, child);
    }
}

static void place_item(qp_builder *b, uint32_t level, qp_item *item) {
    bool regular = qp_cell_is_regular(item->cell);
    int crease = regular || !b->crease_nodes ? -1 : qp_cell_crease_edge(item->cell);
    if (regular || crease >= 0) {
        qp_plan_close_chain(b, item);
        put_leaf(b, level, item, crease);
        return;
    }
    if (qp_plan_is_permanent(b, level, item)) {
        qp_plan_put_tail(b, level, item);
        return;
    }
    if (level - b->base >= b->depth) {
        put_irregular(b, level, item);
        return;
    }
    qp_cell *children =
        qp_refine_cell(&b->local, &b->local.level[level & 1], &b->local.level[(level + 1) & 1], item->cell);
    if (children == NULL) {
        b->failed = true;
        return;
    }
    int corner = qp_plan_ring_corner(b, item, children);
    if (corner >= 0) {
        qp_plan_go_on_chain(b, level, item, children, (uint32_t)corner);
    } else if (item->chain == QP_NONE && level - b->base >= QP_PLAN_INTERNAL_LEVELS) {
        put_irregular(b, level, item);
    } else {
        qp_plan_close_chain(b, item);
        put_internal(b, level, item, children);
    }
}

/* Limits of the patch's corners around which leaves may lie deep in the tree, outside terminal nodes with a limit of their own: the
 * semi-sharp ones, and all where there are no terminal nodes. */
static bool find_corners(qp_builder *b, const qp_cell *cell) {
    const uint32_t width = b->local.width;
    for (uint32_t i = 0; i < 4; ++i) {
        const qp_corner *corner = &cell->corner[i % cell->n];
        b->corner_final[i] = QP_NONE;
        b->corner_known[i] =
            b->depth > QP_PLAN_SHARED_LEVELS && (!b->terminal_nodes || qp_fan_has_semi_sharp(corner->fan));
        if (!b->corner_known[i]) continue;
        void *rows = b->corner_rows;
        bool tangents;
        /* Room for the tangents that come along. */
        if (!qp_grow(&rows, &b->corner_capacity, 6 * (size_t)width, sizeof(double))) return false;
        b->corner_rows = rows;
        qp_limit_stencils(&b->local, &b->local.level[b->base & 1], corner, b->corner_rows + i * (size_t)width,
                          &tangents);
        if (b->local.failed) return false;
    }
    return true;
}

/* The root item: the quad itself, or the first child of an n-gon after one subdivision. */
static bool start(qp_builder *b, const qp_cell *cell, bool child, qp_item *root) {
    qp_local *local = &b->local;
    uint32_t width = local->width;
    void *rows = local->level[0].rows;
    if (!qp_grow(&rows, &local->level[0].row_capacity, (size_t)width * width, sizeof(double))) return false;
    local->level[0].rows = rows;
    memset(rows, 0, (size_t)width * width * sizeof(double));
    for (uint32_t i = 0; i < width; ++i) local->level[0].rows[(size_t)i * width + i] = 1.0;
    local->level[0].count = width;
    *root = (qp_item){.u = {0, QP_PLAN_ONE, true, true},
                      .v = {0, QP_PLAN_ONE, true, true},
                      .parent_word = QP_NONE,
                      .chain = QP_NONE};
    root->cell = (qp_cell *)cell;
    b->base = 0;
    if (child) {
        root->cell = qp_refine_cell(local, &local->level[0], &local->level[1], cell);
        b->base = 1;
    }
    return root->cell != NULL && find_corners(b, root->cell);
}

qp_plan *qp_build_plan(qp_builder *b, const qp_cell *cell, bool child) {
    b->point_count = b->tree_words = b->node_count = b->constant_count = b->chain_count = b->flags = 0;
    b->item_count[0] = b->item_count[1] = 0;
    for (int i = 0; i < 2; ++i) b->absolute[i].size = b->offsets[i].size = 0;
    b->too_large = b->failed = false;
    qp_item root;
    if (!start(b, cell, child, &root)) {
        b->failed = true;
        return NULL;
    }
    qp_plan_push_item(b, b->base, root);
    for (uint32_t level = b->base; b->item_count[level & 1] > 0; ++level) {
        uint32_t side = level & 1;
        if (level > 0) {
            /* The other level held the parents; nothing refers to them any more. */
            qp_level_clear(&b->local.level[side ^ 1]);
            b->absolute[side ^ 1].size = b->offsets[side ^ 1].size = 0;
        }
        for (uint32_t i = 0; i < b->item_count[side]; ++i) {
            qp_item item = b->items[side][i];
            place_item(b, level, &item);
            b->failed = b->failed || b->local.failed || b->local.level[0].arena.failed ||
                        b->local.level[1].arena.failed;
            if (b->failed || b->too_large) return NULL;
        }
        b->item_count[side] = 0;
    }
    return qp_plan_finish(b);
}
