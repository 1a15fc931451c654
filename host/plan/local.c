/* Refinement of a cell and its fans: the rules, and what the next level looks like. */
#include "host/plan/local.h"

#include <math.h>
#include <string.h>

/* ---- sharpness ---- */

bool qp_sharp_is_infinite(float s) {
    return s >= QP_SHARPNESS_INFINITE;
}
bool qp_sharp_is_semi(float s) {
    return s > 0.0f && s < QP_SHARPNESS_INFINITE;
}

bool qp_fan_has_semi_sharp(const qp_fan *fan) {
    bool semi = qp_sharp_is_semi(fan->sharpness);
    for (uint32_t j = 0; j < qp_fan_spokes(fan); ++j) semi = semi || qp_sharp_is_semi(fan->sharp[j]);
    for (uint32_t j = 0; j < fan->others; ++j) semi = semi || qp_sharp_is_semi(fan->other_sharp[j]);
    return semi;
}

/* Spoke j is one of the two edges that the vertex's crease runs along. */
static bool is_end_spoke(const qp_fan *fan, uint32_t j) {
    return fan->through && !fan->closed && (j == 0 || j == fan->faces);
}

/* The same with sharpnesses of another level. */
static uint32_t count_sharp(const qp_fan *fan, const float *sharp, const float *other_sharp,
                            uint32_t *infinite) {
    uint32_t count = *infinite = fan->through ? 2 : 0;
    for (uint32_t j = 0; j < qp_fan_spokes(fan); ++j) {
        if (sharp[j] <= 0.0f || is_end_spoke(fan, j)) continue;
        ++count;
        *infinite += qp_sharp_is_infinite(sharp[j]);
    }
    for (uint32_t j = 0; j < fan->others; ++j) {
        if (other_sharp[j] <= 0.0f) continue;
        ++count;
        *infinite += qp_sharp_is_infinite(other_sharp[j]);
    }
    return count;
}

uint32_t qp_fan_sharp_edges(const qp_fan *fan, uint32_t *infinite) {
    return count_sharp(fan, fan->sharp, fan->other_sharp, infinite);
}

float qp_sharp_decrement(float s) {
    if (qp_sharp_is_infinite(s)) return QP_SHARPNESS_INFINITE;
    return s > 1.0f ? s - 1.0f : 0.0f;
}

float qp_sharp_chaikin(float s, double sum, uint32_t count) {
    if (!qp_sharp_is_semi(s)) return s;
    if (count < 2) return qp_sharp_decrement(s);
    float others = ((float)sum - s) / (float)(count - 1);
    float child = (0.75f * s + 0.25f * others) - 1.0f;
    return child > 0.0f ? child : 0.0f;
}

static void add_semi_sharp(const float *sharp, uint32_t edges, double *sum, uint32_t *count) {
    for (uint32_t j = 0; j < edges; ++j) {
        if (!qp_sharp_is_semi(sharp[j])) continue;
        *sum += (double)sharp[j];
        ++*count;
    }
}

/* Sharpness of the near halves of all spokes, and of the vertex's other sharp edges, at the next level. */
static void child_sharpness(const qp_local *local, const qp_fan *fan, float *child, float *other_child) {
    double sum = 0.0;
    uint32_t count = 0;
    if (local->chaikin) {
        add_semi_sharp(fan->sharp, qp_fan_spokes(fan), &sum, &count);
        add_semi_sharp(fan->other_sharp, fan->others, &sum, &count);
    }
    for (uint32_t j = 0; j < qp_fan_spokes(fan); ++j) {
        const float s = fan->sharp[j];
        child[j] = local->chaikin ? qp_sharp_chaikin(s, sum, count) : qp_sharp_decrement(s);
    }
    for (uint32_t j = 0; j < fan->others && other_child != NULL; ++j) {
        const float s = fan->other_sharp[j];
        other_child[j] = local->chaikin ? qp_sharp_chaikin(s, sum, count) : qp_sharp_decrement(s);
    }
}

/* ---- rows ---- */

static void row_zero(double *row, uint32_t width) {
    memset(row, 0, width * sizeof *row);
}
static void row_add(double *restrict row, const double *restrict from, double weight, uint32_t width) {
    for (uint32_t i = 0; i < width; ++i) row[i] += weight * from[i];
}

void qp_row_settle(double *row, uint32_t width) {
    enum { PART = 32 };
    double sum = 0.0;
    uint32_t largest = 0;
    for (uint32_t begin = 0; begin < width; begin += PART) {
        double part = 0.0;
        for (uint32_t i = begin; i < width && i < begin + PART; ++i) {
            part += row[i];
            if (fabs(row[i]) > fabs(row[largest])) largest = i;
        }
        sum += part;
    }
    row[largest] += rint(sum) - sum;
}

/* Points of the refined fan of one vertex: face and edge points, in the new level. */
typedef struct refined_fan {
    uint32_t vertex;
    uint32_t *face; /* [faces] */
    uint32_t *edge; /* [spokes] */
    float *sharp;   /* [spokes] near halves */
    uint32_t end[2];
    float *other_sharp; /* [others] */
} refined_fan;

/* The face point of face j of a fan. Faces are known by a directed edge, which only one face has: the one
 * that leaves their lowest vertex. */
static uint32_t refine_face(qp_local *local, const qp_level *from, qp_level *to, const qp_fan *fan,
                            uint32_t j) {
    uint32_t quad[4] = {0}, size = 4;
    const uint32_t *vertices = quad;
    if (fan->face != NULL) {
        vertices = local->ring_faces[fan->face[j]].vertices;
        size = local->ring_faces[fan->face[j]].size;
    } else {
        uint32_t next = j + 1 == qp_fan_spokes(fan) ? 0 : j + 1;
        quad[0] = fan->vertex;
        quad[1] = fan->spoke[j];
        quad[2] = fan->diagonal[j];
        quad[3] = fan->spoke[next];
    }
    uint32_t lowest = 0;
    for (uint32_t k = 1; k < size; ++k) {
        if (vertices[k] < vertices[lowest]) lowest = k;
    }
    bool fresh;
    uint32_t point = qp_level_point(local, to, QP_KEY_FACE, vertices[lowest],
                                    vertices[lowest + 1 == size ? 0 : lowest + 1], &fresh);
    if (!fresh || local->failed) return point;
    double *row = qp_level_row(local, to, point);
    row_zero(row, local->width);
    for (uint32_t k = 0; k < size; ++k) {
        row_add(row, qp_level_row(local, from, vertices[k]), 1.0 / size, local->width);
    }
    return point;
}

static uint32_t face_size(const qp_local *local, const qp_fan *fan, uint32_t j) {
    return fan->face != NULL ? local->ring_faces[fan->face[j]].size : 4;
}

/* Share of the crease rule in an edge point (the rest is the smooth rule): a full crease while both halves stay sharp, else the
 * sharpness itself. Under Chaikin's rule that may exceed 1 (a sharp edge beside blunt ones can lose more than 1) and
 * extrapolates; OpenSubdiv's Far does so, and it defines the surface. */
static double edge_crease_share(const qp_local *local, float sharp, float near_child, float far_child) {
    if (sharp <= 0.0f) return 0.0;
    if (qp_sharp_is_infinite(sharp)) return 1.0;
    if (!local->chaikin) return sharp >= 1.0f ? 1.0 : (double)sharp;
    return near_child > 0.0f && far_child > 0.0f ? 1.0 : (double)sharp;
}

static uint32_t refine_edge(qp_local *local, const qp_level *from, qp_level *to, const qp_fan *fan,
                            uint32_t j, const refined_fan *refined) {
    uint32_t a = fan->vertex, b = fan->spoke[j];
    bool fresh;
    uint32_t point = qp_level_point(local, to, QP_KEY_EDGE, a < b ? a : b, a < b ? b : a, &fresh);
    if (!fresh || local->failed) return point;
    double share = edge_crease_share(local, fan->sharp[j], refined->sharp[j], fan->far_sharp[j]);
    /* The faces on both sides; an edge at the end of an open fan is a boundary or non-manifold, so infinitely
     * sharp. */
    uint32_t right = j == 0 ? (fan->closed ? fan->faces - 1 : QP_NONE) : j - 1;
    uint32_t left = j < fan->faces ? j : QP_NONE;
    double face_weight = 0.0;
    if (right != QP_NONE && left != QP_NONE && share != 1.0) {
        face_weight = 0.25;
        if (local->smooth_triangles && fan->face != NULL) {
            /* OpenSubdiv's "smooth" triangle rule: 0.470 for a triangle, averaged over the edge's two faces.
             */
            double r = face_size(local, fan, right) == 3 ? 0.470 : 0.25;
            double l = face_size(local, fan, left) == 3 ? 0.470 : 0.25;
            face_weight = 0.5 * (r + l);
        }
    } else {
        share = 1.0;
    }
    double vertex_weight = share * 0.5 + (1.0 - share) * 0.5 * (1.0 - 2.0 * face_weight);
    double *row = qp_level_row(local, to, point);
    row_zero(row, local->width);
    row_add(row, qp_level_row(local, from, a), vertex_weight, local->width);
    row_add(row, qp_level_row(local, from, b), vertex_weight, local->width);
    if (share != 1.0) {
        face_weight *= 1.0 - share;
        row_add(row, qp_level_row(local, to, refined->face[right]), face_weight, local->width);
        row_add(row, qp_level_row(local, to, refined->face[left]), face_weight, local->width);
    }
    return point;
}

typedef enum vertex_rule { RULE_SMOOTH, RULE_CREASE, RULE_CORNER } vertex_rule;

/* ends: the far points of a crease. */
static vertex_rule rule_of(const qp_fan *fan, float vertex_sharpness, const float *sharp,
                           const float *other_sharp, uint32_t ends[2]) {
    uint32_t infinite, count = count_sharp(fan, sharp, other_sharp, &infinite);
    if (vertex_sharpness > 0.0f || count > 2) return RULE_CORNER;
    if (count < 2) return RULE_SMOOTH;
    if (fan->through) {
        memcpy(ends, fan->end, sizeof fan->end);
        return RULE_CREASE;
    }
    for (uint32_t j = 0, end = 0; j < qp_fan_spokes(fan); ++j)
        if (sharp[j] > 0.0f) ends[end++] = fan->spoke[j];
    return RULE_CREASE;
}

static void add_vertex_rule(const qp_local *local, const qp_level *from, const qp_level *to,
                            const qp_fan *fan, const refined_fan *refined, vertex_rule rule,
                            const uint32_t ends[2], double weight, double *row) {
    uint32_t w = local->width;
    const double *vertex = qp_level_row(local, from, fan->vertex);
    if (rule == RULE_CORNER) {
        row_add(row, vertex, weight, w);
    } else if (rule == RULE_CREASE) {
        row_add(row, vertex, 0.75 * weight, w);
        row_add(row, qp_level_row(local, from, ends[0]), 0.125 * weight, w);
        row_add(row, qp_level_row(local, from, ends[1]), 0.125 * weight, w);
    } else {
        double n = fan->faces, share = weight / (n * n);
        row_add(row, vertex, weight * (n - 2.0) / n, w);
        for (uint32_t j = 0; j < fan->faces; ++j) {
            row_add(row, qp_level_row(local, from, fan->spoke[j]), share, w);
            row_add(row, qp_level_row(local, to, refined->face[j]), share, w);
        }
    }
}

/* Weight of the parent's rule where parent and child follow different ones: the mean of the sharpnesses that
 * vanish, in float as OpenSubdiv has it; summed in double so that it does not depend on where the walk
 * begins. */
static double parent_share(const qp_local *local, const qp_fan *fan, const refined_fan *refined,
                           float child_vertex) {
    double sum = 0.0;
    uint32_t count = 0;
    if (fan->sharpness > 0.0f && child_vertex <= 0.0f) {
        sum = (double)fan->sharpness;
        count = 1;
    }
    for (uint32_t j = 0; j < qp_fan_spokes(fan); ++j) {
        float s = fan->sharp[j];
        bool vanishes = local->chaikin ? refined->sharp[j] <= 0.0f : s <= 1.0f;
        if (s > 0.0f && vanishes) {
            sum += (double)s;
            ++count;
        }
    }
    for (uint32_t j = 0; j < fan->others; ++j) {
        float s = fan->other_sharp[j];
        bool vanishes = local->chaikin ? refined->other_sharp[j] <= 0.0f : s <= 1.0f;
        if (s > 0.0f && vanishes) {
            sum += (double)s;
            ++count;
        }
    }
    if (count == 0) return 0.0;
    float share = (float)sum / (float)count;
    return share > 1.0f ? 1.0 : (double)share;
}

static uint32_t refine_vertex(qp_local *local, const qp_level *from, qp_level *to, const qp_fan *fan,
                              const refined_fan *refined) {
    bool fresh;
    uint32_t point = qp_level_point(local, to, QP_KEY_VERTEX, fan->vertex, fan->vertex, &fresh);
    if (!fresh || local->failed) return point;
    uint32_t parent_ends[2] = {0, 0}, child_ends[2] = {0, 0};
    float child_sharp = qp_sharp_decrement(fan->sharpness);
    vertex_rule parent = rule_of(fan, fan->sharpness, fan->sharp, fan->other_sharp, parent_ends);
    vertex_rule child = rule_of(fan, child_sharp, refined->sharp, refined->other_sharp, child_ends);
    double *row = qp_level_row(local, to, point);
    row_zero(row, local->width);
    if (parent == child || parent == RULE_SMOOTH) {
        add_vertex_rule(local, from, to, fan, refined, parent, parent_ends, 1.0, row);
    } else {
        double share = parent_share(local, fan, refined, child_sharp);
        add_vertex_rule(local, from, to, fan, refined, parent, parent_ends, share, row);
        add_vertex_rule(local, from, to, fan, refined, child, child_ends, 1.0 - share, row);
    }
    if (fan->faces >= QP_SETTLE_FACES) qp_row_settle(row, local->width);
    return point;
}

/* The far points of the crease through the vertex: edge points of its own spokes, or midpoints of edges that it lacks. */
static void refine_ends(qp_local *local, const qp_level *from, qp_level *to, const qp_fan *fan,
                        refined_fan *refined) {
    for (uint32_t t = 0; t < 2; ++t) {
        if (!fan->closed && (t == 0 || !fan->beside)) {
            refined->end[t] = refined->edge[t == 0 ? 0 : fan->faces];
            continue;
        }
        bool fresh;
        const uint32_t a = fan->vertex, b = fan->end[t];
        refined->end[t] = qp_level_point(local, to, QP_KEY_EDGE, a < b ? a : b, a < b ? b : a, &fresh);
        if (!fresh || local->failed) continue;
        double *row = qp_level_row(local, to, refined->end[t]);
        row_zero(row, local->width);
        row_add(row, qp_level_row(local, from, a), 0.5, local->width);
        row_add(row, qp_level_row(local, from, b), 0.5, local->width);
    }
}

/* ---- fans of the next level ---- */

static qp_fan *fan_new(qp_level *level, uint32_t faces, bool closed) {
    uint32_t spokes = faces + (closed ? 0 : 1);
    qp_fan *fan = qp_arena_get(&level->arena, sizeof *fan);
    uint32_t *words = qp_arena_get(&level->arena, ((size_t)faces + spokes) * sizeof *words);
    float *floats = qp_arena_get(&level->arena, 2 * (size_t)spokes * sizeof *floats);
    if (fan == NULL || words == NULL || floats == NULL) return NULL;
    *fan = (qp_fan){.faces = faces,
                    .closed = closed,
                    .spoke = words,
                    .diagonal = words + spokes,
                    .sharp = floats,
                    .far_sharp = floats + spokes};
    return fan;
}

static bool refine_points(qp_local *local, qp_level *from, qp_level *to, const qp_fan *fan,
                          refined_fan *refined) {
    uint32_t spokes = qp_fan_spokes(fan);
    refined->face = qp_arena_get(&to->arena, ((size_t)fan->faces + spokes) * sizeof(uint32_t));
    refined->sharp = qp_arena_get(&to->arena, ((size_t)spokes + fan->others) * sizeof(float));
    if (refined->face == NULL || refined->sharp == NULL) {
        local->failed = true;
        return false;
    }
    refined->edge = refined->face + fan->faces;
    refined->other_sharp = refined->sharp + spokes;
    child_sharpness(local, fan, refined->sharp, refined->other_sharp);
    for (uint32_t j = 0; j < fan->faces; ++j) refined->face[j] = refine_face(local, from, to, fan, j);
    for (uint32_t j = 0; j < spokes; ++j) refined->edge[j] = refine_edge(local, from, to, fan, j, refined);
    refined->vertex = refine_vertex(local, from, to, fan, refined);
    if (fan->through) refine_ends(local, from, to, fan, refined);
    return !local->failed;
}

/* The fan around the vertex's own child: the same valence; spokes end at edge points, diagonals are face
 * points. */
static qp_fan *vertex_fan(qp_local *local, qp_level *to, const qp_fan *fan, const refined_fan *refined) {
    qp_fan *child = fan_new(to, fan->faces, fan->closed);
    if (child == NULL) {
        local->failed = true;
        return NULL;
    }
    uint32_t spokes = qp_fan_spokes(fan);
    child->vertex = refined->vertex;
    child->sharpness = qp_sharp_decrement(fan->sharpness);
    child->through = fan->through;
    child->beside = fan->beside;
    child->others = fan->others;
    child->other_sharp = refined->other_sharp; /* of the same arena */
    memcpy(child->end, refined->end, sizeof child->end);
    memcpy(child->spoke, refined->edge, spokes * sizeof *child->spoke);
    memcpy(child->diagonal, refined->face, fan->faces * sizeof *child->diagonal);
    memcpy(child->sharp, refined->sharp, spokes * sizeof *child->sharp);
    for (uint32_t j = 0; j < spokes; ++j) {
        /* Around the edge point in the middle: the near half, the far half, and two smooth edges. */
        float near = refined->sharp[j], far = fan->far_sharp[j];
        uint32_t count = (qp_sharp_is_semi(near) ? 1u : 0u) + (qp_sharp_is_semi(far) ? 1u : 0u);
        double sum =
            (qp_sharp_is_semi(near) ? (double)near : 0.0) + (qp_sharp_is_semi(far) ? (double)far : 0.0);
        child->far_sharp[j] = local->chaikin ? qp_sharp_chaikin(near, sum, count) : qp_sharp_decrement(near);
    }
    return child;
}

/* The fan around the edge point between corners i and i+1 of the cell. With the cell to the north, spokes run
 * east (to corner i+1), north (face point), west (corner i), south (face point across); an open one lacks the
 * south. */
static qp_fan *edge_fan(qp_local *local, qp_level *to, const qp_cell *cell, const refined_fan *refined,
                        qp_fan *const *vertex_fans, uint32_t i, uint32_t face_point) {
    uint32_t next = i + 1 == cell->n ? 0 : i + 1, prev = i == 0 ? cell->n - 1 : i - 1;
    const qp_corner *a = &cell->corner[i], *b = &cell->corner[next];
    uint32_t across_a = qp_corner_face(a, -1);
    bool closed = across_a != QP_NONE;
    qp_fan *fan = fan_new(to, closed ? 4 : 2, closed);
    if (fan == NULL) {
        local->failed = true;
        return NULL;
    }
    uint32_t spoke_a = qp_corner_spoke(a, 0), spoke_b = qp_corner_spoke(b, 1);
    fan->vertex = refined[i].edge[spoke_a];
    fan->spoke[0] = refined[next].vertex;
    fan->spoke[1] = face_point;
    fan->spoke[2] = refined[i].vertex;
    fan->sharp[0] = refined[next].sharp[spoke_b];
    fan->sharp[1] = 0.0f;
    fan->sharp[2] = refined[i].sharp[spoke_a];
    /* The far end of spoke 0 is corner i+1's child, whose fan holds the same edge as its spoke_b. */
    float *around = qp_arena_get(&to->arena, sizeof(float) * (qp_fan_spokes(a->fan) + qp_fan_spokes(b->fan)));
    if (around == NULL) {
        local->failed = true;
        return NULL;
    }
    child_sharpness(local, vertex_fans[next], around, NULL);
    fan->far_sharp[0] = around[spoke_b];
    child_sharpness(local, vertex_fans[i], around, NULL);
    fan->far_sharp[2] = around[spoke_a];
    fan->far_sharp[1] = 0.0f;
    fan->diagonal[0] = refined[next].edge[qp_corner_spoke(b, 0)];
    fan->diagonal[1] = refined[prev].edge[qp_corner_spoke(&cell->corner[prev], 0)];
    if (closed) {
        fan->spoke[3] = refined[i].face[across_a];
        fan->sharp[3] = 0.0f;
        fan->far_sharp[3] = 0.0f;
        fan->diagonal[2] = refined[i].edge[qp_corner_spoke(a, -1)];
        fan->diagonal[3] = refined[next].edge[qp_corner_spoke(b, 2)];
    }
    return fan;
}

static qp_fan *face_fan(qp_local *local, qp_level *to, const qp_cell *cell, const refined_fan *refined,
                        uint32_t face_point) {
    qp_fan *fan = fan_new(to, cell->n, true);
    if (fan == NULL) {
        local->failed = true;
        return NULL;
    }
    fan->vertex = face_point;
    for (uint32_t j = 0; j < cell->n; ++j) {
        fan->spoke[j] = refined[j].edge[qp_corner_spoke(&cell->corner[j], 0)];
        fan->sharp[j] = fan->far_sharp[j] = 0.0f;
        fan->diagonal[j] = refined[j + 1 == cell->n ? 0 : j + 1].vertex;
    }
    return fan;
}

/* Places a child's corners: own corner i (the vertex), the edge point after it, the face point, the edge
 * point before it. */
static void place_child(qp_cell *child, uint32_t first, qp_corner vertex, qp_corner after, qp_corner face,
                        qp_corner before) {
    child->corner[first & 3] = vertex;
    child->corner[(first + 1) & 3] = after;
    child->corner[(first + 2) & 3] = face;
    child->corner[(first + 3) & 3] = before;
}

qp_cell *qp_refine_cell(qp_local *local, qp_level *from, qp_level *to, const qp_cell *cell) {
    uint32_t n = cell->n;
    refined_fan *refined = qp_arena_get(&to->arena, n * sizeof *refined);
    qp_fan **vertex_fans = qp_arena_get(&to->arena, n * sizeof *vertex_fans);
    qp_fan **edge_fans = qp_arena_get(&to->arena, n * sizeof *edge_fans);
    qp_cell *children = qp_arena_get(&to->arena, n * sizeof *children);
    qp_corner *corners = qp_arena_get(&to->arena, 4 * (size_t)n * sizeof *corners);
    if (refined == NULL || vertex_fans == NULL || edge_fans == NULL || children == NULL || corners == NULL) {
        local->failed = true;
        return NULL;
    }
    for (uint32_t i = 0; i < n; ++i) {
        if (!refine_points(local, from, to, cell->corner[i].fan, &refined[i])) return NULL;
    }
    for (uint32_t i = 0; i < n; ++i) {
        vertex_fans[i] = vertex_fan(local, to, cell->corner[i].fan, &refined[i]);
        if (vertex_fans[i] == NULL) return NULL;
    }
    uint32_t face_point = refined[0].face[cell->corner[0].at];
    for (uint32_t i = 0; i < n; ++i) {
        edge_fans[i] = edge_fan(local, to, cell, refined, vertex_fans, i, face_point);
        if (edge_fans[i] == NULL) return NULL;
    }
    qp_fan *centre = face_fan(local, to, cell, refined, face_point);
    if (centre == NULL) return NULL;
    for (uint32_t i = 0; i < n; ++i) {
        uint32_t prev = i == 0 ? n - 1 : i - 1;
        children[i] = (qp_cell){.n = 4, .corner = corners + 4 * (size_t)i};
        /* Around the edge point after corner i the child is face 1, around the one before it face 0; around
         * the face point it lies before spoke i, so it is face i-1. */
        place_child(&children[i], n == 4 ? i : 0, (qp_corner){vertex_fans[i], cell->corner[i].at},
                    (qp_corner){edge_fans[i], 1}, (qp_corner){centre, prev}, (qp_corner){edge_fans[prev], 0});
    }
    return children;
}

qp_fan *qp_refine_fan(qp_local *local, qp_level *from, qp_level *to, const qp_fan *fan) {
    refined_fan refined;
    if (!refine_points(local, from, to, fan, &refined)) return NULL;
    return vertex_fan(local, to, fan, &refined);
}
