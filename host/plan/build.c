#include "host/plan/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Coordinates of the patch in units of 2^-16. */
#define ONE 65536u

typedef struct qp_final_point {
    uint8_t need;    /* first level that needs it */
    uint8_t kind;    /* QP_POINT_* | depth << 2 */
    uint16_t origin; /* point its row is an offset from, or QP_NO_POINT */
    uint32_t order;  /* becomes its index once sorted */
} qp_final_point;

/* One dimension of a cell: [lo, hi], and whether a sample at either end comes here or goes to the neighbour.
 */
typedef struct span {
    uint32_t lo, hi;
    bool own_lo, own_hi;
} span;

typedef struct qp_item {
    qp_cell *cell;
    span u, v;
    uint32_t
        parent_word; /* tree word that is to hold this node's offset; QP_NONE: the root, or a chain's tail */
    uint32_t chain;  /* the terminal chain this cell ends or goes on with, or QP_NONE */
} qp_item;

/* Rings of the first two levels may overlap those of other corners of the patch, and are shared; deeper ones never do, and are
 * stored as offsets from their corner's limit point. */
#define SHARED_LEVELS 2u

/* A terminal node in the making: its rings are known level by level. */
typedef struct qp_chain {
    uint32_t parent_word, corner, rings, absolute_rings;
    uint32_t corner_u, corner_v; /* of the patch, in 2^-16 */
    uint32_t points[12][24];     /* final points */
} qp_chain;

static void *grown(qp_builder *b, void *block, size_t *capacity, size_t need, size_t size) {
    if (!qp_grow(&block, capacity, need, size)) b->failed = true;
    return block;
}

void qp_builder_free(qp_builder *b) {
    qp_local_free(&b->local);
    free(b->rows);
    free(b->points);
    free(b->tree);
    free(b->constants);
    free(b->chains);
    for (int i = 0; i < 2; ++i) {
        free(b->final_of[i]);
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
    free(plan);
}

/* ---- which level first needs a cell (section 4.2) ----
 * At level n samples lie on the patch's edges or at least 2^-n away from them; the rest is arbitrary. */

static uint8_t span_need(span s) {
    if (s.lo == 0 || s.hi == ONE) return 0;
    for (uint32_t n = 1; n < QP_LEVELS; ++n) {
        uint32_t step = ONE >> n, lo = s.lo > step ? s.lo : step, hi = s.hi < ONE - step ? s.hi : ONE - step;
        if (lo < hi) return (uint8_t)n;
        if (lo == hi && (lo != s.lo || s.own_lo) && (hi != s.hi || s.own_hi)) return (uint8_t)n;
    }
    return QP_LEVELS - 1;
}

/* A cell that touches the patch's edge in u is met by the samples on that edge whatever the level, so v
 * decides, and the other way round; one that touches both holds a corner. */
static uint8_t cell_need(span u, span v) {
    uint8_t a = span_need(u), b = span_need(v);
    return a > b ? a : b;
}

static uint8_t point_need(uint32_t u, uint32_t v) {
    return cell_need((span){u, u, true, true}, (span){v, v, true, true});
}

static span half(span s, bool upper, bool tie_low) {
    uint32_t mid = (s.lo + s.hi) / 2;
    if (upper) return (span){mid, s.hi, !tie_low, s.own_hi};
    return (span){s.lo, mid, s.own_lo, tie_low};
}

/* Corner i of a cell is (cu, cv). */
static bool corner_high_u(uint32_t i) {
    return i == 1 || i == 2;
}
static bool corner_high_v(uint32_t i) {
    return i >= 2;
}

/* ---- final points ---- */

static uint32_t new_final(qp_builder *b, uint8_t need, uint32_t kind) {
    uint32_t width = b->local.width;
    b->rows = grown(b, b->rows, &b->row_capacity, ((size_t)b->point_count + 1) * width, sizeof *b->rows);
    b->points = grown(b, b->points, &b->point_capacity, (size_t)b->point_count + 1, sizeof *b->points);
    if (b->failed) return 0;
    if (b->point_count >= QP_NO_POINT) {
        b->too_large = true;
        return 0;
    }
    b->points[b->point_count] = (qp_final_point){need, (uint8_t)kind, QP_NO_POINT, b->point_count};
    return b->point_count++;
}

static void lower_need(qp_builder *b, uint32_t point, uint8_t need) {
    if (!b->failed && need < b->points[point].need) b->points[point].need = need;
}

static double *final_row(qp_builder *b, uint32_t point) {
    return b->rows + (size_t)point * b->local.width;
}

static uint32_t copy_final(qp_builder *b, uint32_t level, uint32_t point, uint8_t need) {
    uint32_t final = new_final(b, need, QP_POINT_REFINED | level << 2);
    if (b->failed || b->too_large) return 0;
    memcpy(final_row(b, final), qp_level_row(&b->local, &b->local.level[level & 1], point),
           b->local.width * sizeof(double));
    return final;
}

/* The final point of a point of a level, shared by all nodes of that level that are not terminal. */
static uint32_t shared_final(qp_builder *b, uint32_t level, uint32_t point, uint8_t need) {
    uint32_t side = level & 1;
    if (point >= b->final_size[side]) {
        uint32_t size = b->local.level[side].count;
        b->final_of[side] = grown(b, b->final_of[side], &b->final_capacity[side], size, sizeof(uint32_t));
        if (b->failed) return 0;
        for (uint32_t i = b->final_size[side]; i < size; ++i) b->final_of[side][i] = QP_NONE;
        b->final_size[side] = size;
    }
    uint32_t final = b->final_of[side][point];
    if (final == QP_NONE) {
        final = b->final_of[side][point] = copy_final(b, level, point, need);
    } else {
        lower_need(b, final, need);
    }
    return final;
}

/* Limit position and tangents of a cell's corner as three new points; tangents may be QP_NO_POINT. */
static void limit_finals(qp_builder *b, uint32_t level, const qp_corner *corner, uint8_t need,
                         uint32_t out[3]) {
    out[0] = new_final(b, need, QP_POINT_LIMIT | level << 2);
    out[1] = new_final(b, need, QP_POINT_TANGENT | level << 2);
    out[2] = new_final(b, need, QP_POINT_TANGENT | level << 2);
    if (b->failed || b->too_large) return;
    bool tangents;
    qp_limit_stencils(&b->local, &b->local.level[level & 1], corner, final_row(b, out[0]), &tangents);
    if (b->local.failed) b->failed = true;
    if (tangents) return;
    b->point_count -= 2;
    out[1] = out[2] = QP_NO_POINT;
}

/* ---- tree ---- */

static uint32_t new_node(qp_builder *b, uint32_t words) {
    b->tree = grown(b, b->tree, &b->tree_capacity, (size_t)b->tree_words + words, sizeof *b->tree);
    if (b->failed) return 0;
    uint32_t node = b->tree_words;
    memset(b->tree + node, 0, words * sizeof *b->tree);
    b->tree_words += words;
    ++b->node_count;
    return node;
}

/* Tells a node's parent where it is. */
static void link_node(qp_builder *b, const qp_item *item, uint32_t node) {
    if (!b->failed && item->parent_word != QP_NONE) b->tree[item->parent_word] = node;
}

static void put_point(uint32_t *words, uint32_t slot, uint32_t point) {
    words[slot / 2] |= point << (slot % 2 * 16);
}

static void put_leaf(qp_builder *b, uint32_t level, const qp_item *item, int crease) {
    uint32_t rotation = crease < 0 ? 0 : (uint32_t)crease, ids[16];
    qp_level *points = &b->local.level[level & 1];
    qp_cell_points(&b->local, points, item->cell, rotation, ids);
    uint32_t node = new_node(b, crease < 0 ? 10 : 11);
    if (b->failed || b->local.failed) return;
    b->tree[node] = (crease < 0 ? QP_NODE_REGULAR : QP_NODE_CREASE) | rotation << 3;
    b->tree[node + 1] = QP_NO_POINT;
    uint8_t need = cell_need(item->u, item->v);
    for (uint32_t k = 0; k < 16; ++k) {
        uint32_t final = shared_final(b, level, ids[k], need);
        if (b->failed || b->too_large) return;
        put_point(b->tree + node + 2, k, final);
    }
    if (crease >= 0) {
        b->flags |= QP_PLAN_CREASE;
        b->constants = grown(b, b->constants, &b->constant_capacity,
                             (size_t)b->constant_count + QP_CREASE_REALS, sizeof *b->constants);
        if (b->failed) return;
        qp_crease_constants(qp_corner_sharp(&item->cell->corner[crease], 0),
                            b->constants + b->constant_count);
        b->tree[node + 10] = b->constant_count;
        b->constant_count += QP_CREASE_REALS;
    }
    link_node(b, item, node);
}

static void put_irregular(qp_builder *b, uint32_t level, const qp_item *item) {
    uint32_t node = new_node(b, 7);
    if (b->failed) return;
    b->flags |= QP_PLAN_CORNERS;
    b->tree[node] = QP_NODE_IRREGULAR;
    for (uint32_t i = 0; i < 4; ++i) {
        uint32_t u = corner_high_u(i) ? item->u.hi : item->u.lo,
                 v = corner_high_v(i) ? item->v.hi : item->v.lo;
        uint32_t out[3];
        limit_finals(b, level, &item->cell->corner[i], point_need(u, v), out);
        if (b->failed || b->too_large) return;
        for (uint32_t k = 0; k < 3; ++k) put_point(b->tree + node + 1, 3 * i + k, out[k]);
    }
    link_node(b, item, node);
}

/* Writes a finished chain as a TERMINAL node; its tail's offset is written by link_node through the returned
 * word. With an origin its points become offsets from that point. */
static uint32_t put_terminal(qp_builder *b, const qp_chain *chain, uint32_t origin) {
    uint32_t node = new_node(b, 3 + 12 * chain->rings);
    if (b->failed) return QP_NONE;
    b->flags |= QP_PLAN_TERMINAL;
    b->tree[node] = QP_NODE_TERMINAL | chain->corner << 3 | chain->rings << 8 | chain->absolute_rings << 16;
    b->tree[node + 1] = origin;
    uint32_t width = b->local.width;
    for (uint32_t ring = 0; ring < chain->rings; ++ring) {
        for (uint32_t k = 0; k < 24; ++k) {
            uint32_t point = chain->points[ring][k];
            put_point(b->tree + node + 3 + 12 * ring, k, point);
        }
        if (origin == QP_NO_POINT || ring < chain->absolute_rings) continue;
        const double *base = final_row(b, origin);
        for (uint32_t k = 0; k < 24; ++k) {
            /* A valence-3 vertex has the same point on both sides of the missing corner: shift it once. */
            bool seen = false;
            for (uint32_t l = 0; l < k && !seen; ++l) seen = chain->points[ring][l] == chain->points[ring][k];
            if (seen) continue;
            b->points[chain->points[ring][k]].origin = (uint16_t)origin;
            double *row = final_row(b, chain->points[ring][k]);
            lower_need(b, origin, b->points[chain->points[ring][k]].need);
            for (uint32_t w = 0; w < width; ++w) row[w] -= base[w];
        }
    }
    if (chain->parent_word != QP_NONE) b->tree[chain->parent_word] = node;
    return node + 2;
}

/* Ends the chain an item belongs to, so that the item's own node becomes its tail. */
static void close_chain(qp_builder *b, qp_item *item) {
    if (item->chain == QP_NONE) return;
    item->parent_word = put_terminal(b, &b->chains[item->chain], QP_NO_POINT);
    item->chain = QP_NONE;
}

static void put_extraordinary(qp_builder *b, uint32_t level, qp_item *item) {
    const qp_chain *chain = &b->chains[item->chain];
    uint32_t out[3], corner = chain->corner;
    limit_finals(b, level, &item->cell->corner[corner], point_need(chain->corner_u, chain->corner_v), out);
    if (b->failed || b->too_large) return;
    item->parent_word = put_terminal(b, chain, out[0]);
    uint32_t node = new_node(b, 4);
    if (b->failed) return;
    b->flags |= QP_PLAN_CORNERS;
    b->tree[node] = QP_NODE_EXTRAORDINARY | corner << 3;
    for (uint32_t k = 0; k < 3; ++k) b->tree[node + 1 + k] = out[k];
    link_node(b, item, node);
}

static void push_item(qp_builder *b, uint32_t level, qp_item item) {
    uint32_t side = level & 1;
    b->items[side] =
        grown(b, b->items[side], &b->item_capacity[side], (size_t)b->item_count[side] + 1, sizeof(qp_item));
    if (!b->failed) b->items[side][b->item_count[side]++] = item;
}

static qp_item child_item(const qp_item *item, qp_cell *children, uint32_t i, bool tie_u, bool tie_v) {
    return (qp_item){.cell = &children[i],
                     .u = half(item->u, corner_high_u(i), tie_u),
                     .v = half(item->v, corner_high_v(i), tie_v),
                     .parent_word = QP_NONE,
                     .chain = QP_NONE};
}

/* Adds the three regular children of a cell to a chain as its next ring: 24 points of the 5x5 grid around
 * them. */
static void add_ring(qp_builder *b, uint32_t level, const qp_item *item, qp_cell *children, qp_chain *chain) {
    uint32_t corner = chain->corner, ids[25];
    uint8_t need[25];
    memset(need, 255, sizeof need);
    bool tie_u = corner_high_u(corner), tie_v = corner_high_v(corner);
    for (uint32_t k = 1; k < 4; ++k) {
        uint32_t i = (corner + k) & 3, window[16];
        qp_item child = child_item(item, children, i, tie_u, tie_v);
        uint8_t child_need = cell_need(child.u, child.v);
        qp_cell_points(&b->local, &b->local.level[level & 1], child.cell, corner, window);
        uint32_t cx = corner_high_u(k), cy = corner_high_v(k);
        for (uint32_t a = 0; a < 16; ++a) {
            uint32_t slot = (cy + a / 4) * 5 + cx + a % 4;
            ids[slot] = window[a];
            if (child_need < need[slot]) need[slot] = child_need;
        }
    }
    bool shared = level - b->base <= SHARED_LEVELS;
    if (shared) ++chain->absolute_rings;
    for (uint32_t s = 1; s < 25; ++s) {
        if (shared) {
            chain->points[chain->rings][s - 1] = shared_final(b, level, ids[s], need[s]);
            if (b->failed || b->too_large) return;
            continue;
        }
        uint32_t seen = 1;
        while (seen < s && ids[seen] != ids[s]) ++seen;
        if (seen < s) {
            chain->points[chain->rings][s - 1] = chain->points[chain->rings][seen - 1];
            lower_need(b, chain->points[chain->rings][s - 1], need[s]);
        } else {
            chain->points[chain->rings][s - 1] = copy_final(b, level, ids[s], need[s]);
        }
        if (b->failed || b->too_large) return;
    }
    ++chain->rings;
}

/* The corner at which the only child that is no plain leaf lies, -1 if the children are no ring. A chain goes
 * on at its own corner, also when the last child has become regular. */
static int ring_corner(const qp_builder *b, const qp_item *item, const qp_cell *children) {
    uint32_t regular = 0, mask = 0;
    for (uint32_t i = 0; i < 4; ++i) {
        if (!qp_cell_is_regular(&children[i])) continue;
        ++regular;
        mask |= 1u << i;
    }
    if (item->chain != QP_NONE) {
        uint32_t corner = b->chains[item->chain].corner;
        return (mask | 1u << corner) == 15u ? (int)corner : -1;
    }
    if (!b->terminal_nodes || regular != 3) return -1;
    int corner = 0;
    while (mask >> corner & 1u) ++corner;
    return corner;
}

static void go_on_chain(qp_builder *b, uint32_t level, const qp_item *item, qp_cell *children,
                        uint32_t corner) {
    uint32_t index = item->chain;
    if (index == QP_NONE) {
        b->chains = grown(b, b->chains, &b->chain_capacity, (size_t)b->chain_count + 1, sizeof *b->chains);
        if (b->failed) return;
        index = b->chain_count++;
        b->chains[index] = (qp_chain){.parent_word = item->parent_word,
                                      .corner = corner,
                                      .corner_u = corner_high_u(corner) ? item->u.hi : item->u.lo,
                                      .corner_v = corner_high_v(corner) ? item->v.hi : item->v.lo};
    }
    add_ring(b, level + 1, item, children, &b->chains[index]);
    qp_item tail = child_item(item, children, corner, corner_high_u(corner), corner_high_v(corner));
    tail.chain = index;
    push_item(b, level + 1, tail);
}

static void put_internal(qp_builder *b, uint32_t level, const qp_item *item, qp_cell *children) {
    /* A sample on a split goes to the child farther from the patch's edge; at the patch's middle to the side
     * with fewer irregular cells, which needs fewer points. Child order in the tree is (u, v) binary: corners
     * 0, 1, 3, 2. */
    static const uint8_t place[4] = {0, 1, 3, 2};
    uint32_t mid_u = (item->u.lo + item->u.hi) / 2, mid_v = (item->v.lo + item->v.hi) / 2;
    bool irregular[4];
    for (uint32_t i = 0; i < 4; ++i) irregular[i] = !qp_cell_is_regular(&children[i]);
    bool tie_u = mid_u > ONE / 2, tie_v = mid_v > ONE / 2;
    if (mid_u == ONE / 2) tie_u = irregular[1] + irregular[2] > irregular[0] + irregular[3];
    if (mid_v == ONE / 2) tie_v = irregular[2] + irregular[3] > irregular[0] + irregular[1];
    uint32_t node = new_node(b, 5);
    if (b->failed) return;
    b->flags |= QP_PLAN_INTERNAL;
    b->tree[node] = QP_NODE_INTERNAL | (tie_u ? 1u << 5 : 0) | (tie_v ? 1u << 6 : 0);
    link_node(b, item, node);
    for (uint32_t i = 0; i < 4; ++i) {
        qp_item child = child_item(item, children, i, tie_u, tie_v);
        child.parent_word = node + 1 + place[i];
        push_item(b, level + 1, child);
    }
}

static void place_item(qp_builder *b, uint32_t level, qp_item *item) {
    bool regular = qp_cell_is_regular(item->cell);
    int crease = regular || !b->crease_nodes ? -1 : qp_cell_crease_edge(item->cell);
    if (regular || crease >= 0) {
        close_chain(b, item);
        put_leaf(b, level, item, crease);
        return;
    }
    if (level - b->base >= b->depth) {
        if (item->chain != QP_NONE) {
            put_extraordinary(b, level, item);
        } else {
            put_irregular(b, level, item);
        }
        return;
    }
    qp_cell *children =
        qp_refine_cell(&b->local, &b->local.level[level & 1], &b->local.level[(level + 1) & 1], item->cell);
    if (children == NULL) {
        b->failed = true;
        return;
    }
    int corner = ring_corner(b, item, children);
    if (corner >= 0) {
        go_on_chain(b, level, item, children, (uint32_t)corner);
    } else {
        close_chain(b, item);
        put_internal(b, level, item, children);
    }
}

/* ---- the finished plan ---- */

static int compare_points(const void *a, const void *b) {
    const qp_final_point *p = a, *q = b;
    if (p->need != q->need) return p->need < q->need ? -1 : 1;
    return p->order < q->order ? -1 : p->order > q->order;
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
            node[10] += plan->point_count * plan->ring_size; /* fall through */
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
            at += 4;
            break;
        default:
            renumber(node + 1, 6, index);
            at += 7;
            break;
        }
    }
}

static qp_plan *finish(qp_builder *b) {
    uint32_t width = b->local.width, count = b->point_count;
    qp_plan *plan = qp_alloc(1, sizeof *plan, true);
    uint32_t *index = qp_alloc(count, sizeof *index, false);
    if (plan != NULL) {
        plan->tree = qp_alloc(b->tree_words, sizeof *plan->tree, false);
        plan->weights = qp_alloc((size_t)count * width, sizeof *plan->weights, false);
        plan->constants = qp_alloc(b->constant_count, sizeof *plan->constants, false);
        plan->point_kinds = qp_alloc(count, 1, false);
        plan->point_origins = qp_alloc(count, sizeof *plan->point_origins, false);
    }
    if (plan == NULL || index == NULL || plan->tree == NULL || plan->weights == NULL ||
        plan->constants == NULL || plan->point_kinds == NULL || plan->point_origins == NULL) {
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
    memcpy(plan->tree, b->tree, b->tree_words * sizeof *plan->tree);
    if (b->constant_count > 0) {
        memcpy(plan->constants, b->constants, b->constant_count * sizeof *plan->constants);
    }
    qsort(b->points, count, sizeof *b->points, compare_points);
    for (uint32_t i = 0; i < count; ++i) {
        const qp_final_point *p = &b->points[i];
        index[p->order] = i;
        plan->point_kinds[i] = p->kind;
        memcpy(plan->weights + (size_t)i * width, final_row(b, p->order), width * sizeof(double));
        for (uint32_t n = p->need; n < QP_LEVELS; ++n) ++plan->rows[n];
    }
    for (uint32_t i = 0; i < count; ++i) {
        uint16_t origin = b->points[i].origin;
        plan->point_origins[i] = origin == QP_NO_POINT ? origin : (uint16_t)index[origin];
    }
    plan->rows[QP_LEVELS - 1] = count;
    renumber_tree(plan, index);
    free(index);
    return plan;
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
    *root = (qp_item){
        .u = {0, ONE, true, true}, .v = {0, ONE, true, true}, .parent_word = QP_NONE, .chain = QP_NONE};
    root->cell = (qp_cell *)cell;
    b->base = 0;
    if (child) {
        root->cell = qp_refine_cell(local, &local->level[0], &local->level[1], cell);
        b->base = 1;
    }
    return root->cell != NULL;
}

qp_plan *qp_build_plan(qp_builder *b, const qp_cell *cell, bool child) {
    b->point_count = b->tree_words = b->node_count = b->constant_count = b->chain_count = b->flags = 0;
    b->item_count[0] = b->item_count[1] = 0;
    b->final_size[0] = b->final_size[1] = 0;
    b->too_large = b->failed = false;
    qp_item root;
    if (!start(b, cell, child, &root)) {
        b->failed = true;
        return NULL;
    }
    push_item(b, b->base, root);
    for (uint32_t level = b->base; b->item_count[level & 1] > 0; ++level) {
        uint32_t side = level & 1;
        if (level > 0) {
            /* The other level held the parents; nothing refers to them any more. */
            qp_level_clear(&b->local.level[side ^ 1]);
            b->final_size[side ^ 1] = 0;
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
    return finish(b);
}
