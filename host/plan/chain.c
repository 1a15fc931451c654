/* Terminal nodes: chains of cells with one irregular corner. */
#include "host/plan/parts.h"

#include <stdlib.h>
#include <string.h>

/* Marks a ring's point as an offset from `origin`. A ring shrinks by about half a level, so one in a cell of level k is handed to a
 * device times 2^k: its weights stay near 1, where floats are normal numbers, however deep it lies. Levels are the mesh's, so
 * that all patches around a corner have the same numbers. */
static void make_offset(qp_builder *b, uint32_t point, uint32_t origin, uint32_t level) {
    b->points[point].origin = (uint16_t)origin;
    b->points[point].scale = (uint8_t)level;
    qp_plan_lower_need(b, origin, b->points[point].need);
}

/* Writes a finished chain as a TERMINAL node; its tail's offset is written by link_node through the returned
 * word. With an origin its points become offsets from that point. */
static uint32_t put_terminal(qp_builder *b, const qp_chain *chain, uint32_t origin) {
    uint32_t node = qp_plan_new_node(b, 3 + 12 * chain->rings);
    if (b->failed) return QP_NONE;
    b->flags |= QP_PLAN_TERMINAL;
    b->tree[node] = QP_NODE_TERMINAL | chain->corner << 3 | chain->rings << 8 | chain->absolute_rings << 16 |
                    chain->start << 25;
    b->tree[node + 1] = origin;
    uint32_t width = b->local.width;
    for (uint32_t ring = 0; ring < chain->rings; ++ring) {
        for (uint32_t k = 0; k < 24; ++k) {
            uint32_t point = chain->points[ring][k];
            qp_plan_put_point(b->tree + node + 3 + 12 * ring, k, point);
        }
        if (origin == QP_NO_POINT || ring < chain->absolute_rings || ring >= chain->offset_ring) continue;
        const double *base = qp_plan_final_row(b, origin);
        for (uint32_t k = 0; k < 24; ++k) {
            /* A valence-3 vertex has the same point on both sides of the missing corner: shift it once. */
            bool seen = false;
            for (uint32_t l = 0; l < k && !seen; ++l) seen = chain->points[ring][l] == chain->points[ring][k];
            if (seen) continue;
            make_offset(b, chain->points[ring][k], origin, chain->start + ring);
            double *row = qp_plan_final_row(b, chain->points[ring][k]);
            for (uint32_t w = 0; w < width; ++w) row[w] -= base[w];
        }
    }
    if (chain->parent_word != QP_NONE) b->tree[chain->parent_word] = node;
    return node + 2;
}

/* Ends the chain an item belongs to, so that the item's own node becomes its tail. */
void qp_plan_close_chain(qp_builder *b, qp_item *item) {
    if (item->chain == QP_NONE) return;
    const qp_chain *chain = &b->chains[item->chain];
    uint32_t origin = QP_NO_POINT;
    for (uint32_t i = 0; i < 4; ++i) {
        if (chain->corner_u == (qp_plan_corner_high_u(i) ? QP_PLAN_ONE : 0) &&
            chain->corner_v == (qp_plan_corner_high_v(i) ? QP_PLAN_ONE : 0))
            origin = qp_plan_corner_origin(b, i);
    }
    if (b->failed || b->too_large) return;
    item->parent_word = put_terminal(b, chain, origin);
    item->chain = QP_NONE;
}

/* Adds the three regular children of a cell to a chain as its next ring: 24 points of the 5x5 grid around
 * them. */
static void add_ring(qp_builder *b, qp_local *local, uint32_t level, const qp_item *item, qp_cell *children,
                     qp_chain *chain) {
    uint32_t corner = chain->corner, ids[25];
    uint8_t need[25];
    memset(need, 255, sizeof need);
    bool tie_u = qp_plan_corner_high_u(corner), tie_v = qp_plan_corner_high_v(corner);
    for (uint32_t k = 1; k < 4; ++k) {
        uint32_t i = (corner + k) & 3, window[16];
        qp_item child = qp_plan_child_item(item, children, i, tie_u, tie_v);
        uint8_t child_need = qp_plan_cell_need(child.u, child.v);
        qp_cell_points(local, &local->level[level & 1], child.cell, corner, window);
        uint32_t cx = qp_plan_corner_high_u(k), cy = qp_plan_corner_high_v(k);
        for (uint32_t a = 0; a < 16; ++a) {
            uint32_t slot = (cy + a / 4) * 5 + cx + a % 4;
            ids[slot] = window[a];
            if (child_need < need[slot]) need[slot] = child_need;
        }
    }
    bool shared = local == &b->local && level - b->base <= QP_PLAN_SHARED_LEVELS;
    if (shared) ++chain->absolute_rings;
    for (uint32_t s = 1; s < 25; ++s) {
        if (shared) {
            chain->points[chain->rings][s - 1] = qp_plan_shared_final(b, level, ids[s], need[s]);
            if (b->failed || b->too_large) return;
            continue;
        }
        uint32_t seen = 1;
        while (seen < s && ids[seen] != ids[s]) ++seen;
        if (seen < s) {
            chain->points[chain->rings][s - 1] = chain->points[chain->rings][seen - 1];
            qp_plan_lower_need(b, chain->points[chain->rings][s - 1], need[s]);
        } else {
            chain->points[chain->rings][s - 1] = qp_plan_copy_final(b, local, level, ids[s], need[s]);
        }
        if (b->failed || b->too_large) return;
    }
    ++chain->rings;
}

/* The corner at which the only child that is no plain leaf lies, -1 if the children are no ring. A chain goes
 * on at its own corner, also when the last child has become regular. */
int qp_plan_ring_corner(const qp_builder *b, const qp_item *item, const qp_cell *children) {
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

void qp_plan_go_on_chain(qp_builder *b, uint32_t level, const qp_item *item, qp_cell *children,
                         uint32_t corner) {
    uint32_t index = item->chain;
    if (index == QP_NONE) {
        b->chains =
            qp_plan_grown(b, b->chains, &b->chain_capacity, (size_t)b->chain_count + 1, sizeof *b->chains);
        if (b->failed) return;
        index = b->chain_count++;
        b->chains[index] = (qp_chain){.parent_word = item->parent_word,
                                      .corner = corner,
                                      .offset_ring = QP_DEPTH_LIMIT,
                                      .start = level,
                                      .corner_u = qp_plan_corner_high_u(corner) ? item->u.hi : item->u.lo,
                                      .corner_v = qp_plan_corner_high_v(corner) ? item->v.hi : item->v.lo};
    }
    add_ring(b, &b->local, level + 1, item, children, &b->chains[index]);
    qp_item tail = qp_plan_child_item(item, children, corner, qp_plan_corner_high_u(corner),
                                      qp_plan_corner_high_v(corner));
    tail.chain = index;
    qp_plan_push_item(b, level + 1, tail);
}

/* ---- tails ----
 * Once the corner's rules repeat for ever, its limit point is known, and every point of the ring is refined as an offset from it:
 * refinement is affine, so the offsets follow the same rules, and they keep their relative precision however small they get
 * (subtracting the limit at the end would lose as many digits as the ring has shrunk by). */

bool qp_plan_is_permanent(const qp_builder *b, uint32_t level, const qp_item *item) {
    if (item->chain == QP_NONE) return false;
    if (level - b->base >= b->depth) return true;
    const qp_fan *fan = item->cell->corner[b->chains[item->chain].corner].fan;
    return !qp_fan_has_semi_sharp(fan) && level - b->base >= QP_PLAN_SHARED_LEVELS;
}

static uint32_t move_point(qp_local *tail, qp_level *to, const qp_level *from, uint32_t point,
                           const double *limit) {
    bool fresh;
    uint32_t moved = qp_level_point(tail, to, QP_KEY_VERTEX, point, point, &fresh);
    if (!fresh || tail->failed) return moved;
    double *row = qp_level_row(tail, to, moved);
    const double *source = from->rows + (size_t)point * tail->width;
    for (uint32_t k = 0; k < tail->width; ++k) row[k] = source[k] - limit[k];
    return moved;
}

static qp_fan *move_fan(qp_local *tail, qp_level *to, const qp_level *from, const qp_fan *fan,
                        const double *limit) {
    uint32_t spokes = qp_fan_spokes(fan);
    qp_fan *moved = qp_arena_get(&to->arena, sizeof *moved);
    uint32_t *words = qp_arena_get(&to->arena, ((size_t)spokes + fan->faces) * sizeof *words);
    float *floats = qp_arena_get(&to->arena, (2 * (size_t)spokes + fan->others) * sizeof *floats);
    if (moved == NULL || words == NULL || floats == NULL) return NULL;
    *moved = *fan;
    moved->vertex = move_point(tail, to, from, fan->vertex, limit);
    moved->spoke = words;
    moved->diagonal = words + spokes;
    moved->sharp = floats;
    moved->far_sharp = floats + spokes;
    for (uint32_t j = 0; j < spokes; ++j) moved->spoke[j] = move_point(tail, to, from, fan->spoke[j], limit);
    for (uint32_t j = 0; j < fan->faces; ++j)
        moved->diagonal[j] = move_point(tail, to, from, fan->diagonal[j], limit);
    for (uint32_t t = 0; t < 2 && fan->through; ++t)
        moved->end[t] = move_point(tail, to, from, fan->end[t], limit);
    memcpy(moved->sharp, fan->sharp, spokes * sizeof *floats);
    memcpy(moved->far_sharp, fan->far_sharp, spokes * sizeof *floats);
    moved->other_sharp = floats + 2 * (size_t)spokes;
    if (fan->others > 0) memcpy(moved->other_sharp, fan->other_sharp, fan->others * sizeof *floats);
    return moved;
}

static qp_cell *move_cell(qp_local *tail, qp_level *to, const qp_level *from, const qp_cell *cell,
                          const double *limit) {
    qp_cell *moved = qp_arena_get(&to->arena, sizeof *moved);
    qp_corner *corners = qp_arena_get(&to->arena, 4 * sizeof *corners);
    if (moved == NULL || corners == NULL) return NULL;
    *moved = (qp_cell){.n = 4, .corner = corners};
    for (uint32_t i = 0; i < 4; ++i) {
        corners[i].at = cell->corner[i].at;
        corners[i].fan = move_fan(tail, to, from, cell->corner[i].fan, limit);
        if (corners[i].fan == NULL) return NULL;
    }
    return moved;
}

/* The rounding errors of offsets hold a part that is the same for all points, and does not shrink as the offsets do (its eigenvalue
 * is 1). It is what their own limit is not 0 by: takes it away again. */
static bool recenter(qp_local *tail, qp_level *level, const qp_corner *corner, const double *mask) {
    double *limit = qp_alloc(tail->width, sizeof *limit, false);
    if (limit == NULL) return false;
    qp_limit_apply(tail, level, corner->fan, mask, limit);
    for (uint32_t i = 0; i < level->count; ++i) {
        double *row = qp_level_row(tail, level, i);
        for (uint32_t w = 0; w < tail->width; ++w) row[w] -= limit[w];
    }
    free(limit);
    return true;
}

/* Levels in which rings shrink by 2^16 at the most (valence 2: 1/4 a level), so that what stays of the errors is small enough. */
enum { RECENTER_LEVELS = 8 };

/* The chain's rings from `level` + 1 to the plan's depth, as offsets from the final point `origin`. */
static void add_tail_rings(qp_builder *b, uint32_t level, const qp_item *item, qp_chain *chain,
                           uint32_t origin) {
    qp_local *tail = &b->tail;
    qp_local_init(tail, b->local.width);
    tail->chaikin = b->local.chaikin;
    tail->smooth_triangles = b->local.smooth_triangles;
    qp_level *from = &tail->level[level & 1];
    qp_item at = *item;
    at.cell = move_cell(tail, from, &b->local.level[level & 1], item->cell, qp_plan_final_row(b, origin));
    chain->offset_ring = chain->rings;
    bool tie_u = qp_plan_corner_high_u(chain->corner), tie_v = qp_plan_corner_high_v(chain->corner);
    double *mask = NULL;
    bool good = at.cell != NULL;
    for (uint32_t step = 1; good && level - b->base < b->depth; ++level, ++step) {
        qp_level *to = &tail->level[(level + 1) & 1];
        qp_level_clear(to);
        qp_cell *children = qp_refine_cell(tail, &tail->level[level & 1], to, at.cell);
        good = children != NULL && !tail->failed;
        if (good && step % RECENTER_LEVELS == 0) {
            const qp_corner *corner = &children[chain->corner].corner[chain->corner];
            if (mask == NULL) mask = qp_limit_mask(corner);
            good = mask != NULL && recenter(tail, to, corner, mask);
        }
        if (!good) break;
        uint32_t ring = chain->rings;
        add_ring(b, tail, level + 1, &at, children, chain);
        if (b->failed || b->too_large) break;
        for (uint32_t k = 0; k < 24; ++k) make_offset(b, chain->points[ring][k], origin, chain->start + ring);
        at = qp_plan_child_item(&at, children, chain->corner, tie_u, tie_v);
    }
    free(mask);
    b->failed = b->failed || !good;
}

/* How much a ring shrinks from one level to the next, once the modes that decay faster have vanished: the dominant eigenvalue of
 * the corner, as the Rayleigh-like quotient of the last two rings' offsets (exact for a pure mode). 1/2 where there are no two. */
static double tail_ratio(qp_builder *b, const qp_chain *chain) {
    if (chain->rings < chain->offset_ring + 2) return 0.5;
    double both = 0.0, before = 0.0;
    for (uint32_t k = 0; k < 24; ++k) {
        const double *last = qp_plan_final_row(b, chain->points[chain->rings - 1][k]);
        const double *earlier = qp_plan_final_row(b, chain->points[chain->rings - 2][k]);
        for (uint32_t w = 0; w < b->local.width; ++w) {
            both += last[w] * earlier[w];
            before += earlier[w] * earlier[w];
        }
    }
    return before > 0.0 ? both / before : 0.5;
}

void qp_plan_put_tail(qp_builder *b, uint32_t level, qp_item *item) {
    qp_chain *chain = &b->chains[item->chain];
    uint32_t out[3], corner = chain->corner;
    qp_plan_limit_finals(b, level, &item->cell->corner[corner],
                         qp_plan_point_need(chain->corner_u, chain->corner_v), out);
    if (b->failed || b->too_large) return;
    add_tail_rings(b, level, item, chain, out[0]);
    if (b->failed || b->too_large) return;
    item->parent_word = put_terminal(b, chain, out[0]);
    if (b->failed) return;
    const uint32_t mode = qp_plan_split_mode(b, chain, item->cell->corner[corner].fan, level);
    if (b->failed || b->too_large) return;
    if (mode != QP_NO_POINT) {
        b->flags |= QP_PLAN_MODES;
        b->tree[item->parent_word - 2] |= QP_NODE_MODE;
    }
    uint32_t node = qp_plan_new_node(b, 6);
    b->constants = qp_plan_grown(b, b->constants, &b->constant_capacity, (size_t)b->constant_count + 1,
                                 sizeof *b->constants);
    if (b->failed) return;
    b->flags |= QP_PLAN_CORNERS;
    b->tree[node] = QP_NODE_EXTRAORDINARY | corner << 3 | (b->depth == QP_DEPTH_LIMIT ? QP_NODE_EXACT : 0u);
    for (uint32_t k = 0; k < 3; ++k) b->tree[node + 1 + k] = out[k];
    b->tree[node + 4] = b->constant_count;
    b->tree[node + 5] = mode;
    b->constants[b->constant_count++] = tail_ratio(b, &b->chains[item->chain]);
    qp_plan_link_node(b, item, node);
}
