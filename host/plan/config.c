#include "host/plan/config.h"

#include <stdlib.h>
#include <string.h>

void qp_gather_free(qp_gather *g) {
    free(g->begin);
    free(g->at);
    free(g->closed);
    free(g->word_begin);
    free(g->corners);
    free(g->words);
    free(g->entry_begin);
    free(g->parent);
    free(g->column);
    free(g->ring);
    free(g->roots);
    free(g->key);
    *g = (qp_gather){0};
}

static bool reserve_corners(qp_gather *g, uint32_t n) {
    return qp_grow((void **)&g->begin, &g->n_capacity[0], (size_t)n + 1, sizeof *g->begin) &&
           qp_grow((void **)&g->at, &g->n_capacity[1], n, sizeof *g->at) &&
           qp_grow((void **)&g->closed, &g->n_capacity[2], n, sizeof *g->closed) &&
           qp_grow((void **)&g->word_begin, &g->n_capacity[3], (size_t)n + 1, sizeof *g->word_begin);
}

static bool push_corner(qp_gather *g, size_t *count, uint32_t corner) {
    if (!qp_grow((void **)&g->corners, &g->corner_capacity, *count + 1, sizeof *g->corners)) return false;
    g->corners[(*count)++] = corner;
    return true;
}

/* The fan around the vertex of `corner`, counter-clockwise; a closed one starts at the base face. */
static bool walk_fan(qp_gather *g, const qp_mesh *mesh, uint32_t corner, uint32_t i) {
    size_t count = g->begin[i], first = count;
    uint32_t h = corner;
    do {
        if (!push_corner(g, &count, h)) return false;
        h = mesh->corner_twin[qp_corner_prev(mesh, h)];
    } while (h != QP_NONE && h != corner);
    g->closed[i] = h != QP_NONE;
    g->at[i] = 0;
    if (!g->closed[i]) {
        size_t back = count;
        for (h = mesh->corner_twin[corner]; h != QP_NONE; h = mesh->corner_twin[h]) {
            h = qp_corner_next(mesh, h);
            if (!push_corner(g, &count, h)) return false;
        }
        /* The clockwise part was found last and backwards: it goes first, reversed. */
        uint32_t clockwise = (uint32_t)(count - back), forward = (uint32_t)(back - first);
        if (clockwise > 0) {
            uint32_t *c = g->corners + first;
            uint32_t *copy = qp_alloc(clockwise, sizeof *copy, false);
            if (copy == NULL) return false;
            for (uint32_t k = 0; k < clockwise; ++k) copy[k] = c[forward + clockwise - 1 - k];
            memmove(c + clockwise, c, forward * sizeof *c);
            memcpy(c, copy, clockwise * sizeof *c);
            free(copy);
        }
        g->at[i] = clockwise;
    }
    g->begin[i + 1] = (uint32_t)count;
    return true;
}

static uint32_t fan_faces(const qp_gather *g, uint32_t i) {
    return g->begin[i + 1] - g->begin[i];
}
static uint32_t fan_spokes(const qp_gather *g, uint32_t i) {
    return fan_faces(g, i) + (g->closed[i] ? 0 : 1);
}
static uint32_t fan_corner(const qp_gather *g, uint32_t i, uint32_t j) {
    return g->corners[g->begin[i] + j];
}
/* Mesh edge of spoke j of corner i's fan, and its far vertex. */
static uint32_t spoke_edge(const qp_gather *g, const qp_mesh *mesh, uint32_t i, uint32_t j, uint32_t *far) {
    if (j < fan_faces(g, i)) {
        uint32_t h = fan_corner(g, i, j);
        *far = mesh->face_vertices[qp_corner_next(mesh, h)];
        return mesh->corner_edge[h];
    }
    uint32_t h = qp_corner_prev(mesh, fan_corner(g, i, j - 1));
    *far = mesh->face_vertices[h];
    return mesh->corner_edge[h];
}

/* Chaikin: sharpness of the half of `edge` at `vertex` after one subdivision. Every semi-sharp edge is
 * manifold or it would be infinite, so it leaves the vertex in exactly one face. */
static float far_sharpness(const qp_mesh *mesh, uint32_t vertex, uint32_t edge) {
    float own = mesh->edge_sharpness[edge];
    double sum = 0.0;
    uint32_t count = 0;
    for (uint32_t k = mesh->vertex_offsets[vertex]; k < mesh->vertex_offsets[vertex + 1]; ++k) {
        float s = mesh->edge_sharpness[mesh->corner_edge[mesh->vertex_corners[k]]];
        if (!qp_sharp_is_semi(s)) continue;
        sum += (double)s;
        ++count;
    }
    return qp_sharp_chaikin(own, sum, count);
}

/* The vertex of corner i's fan lies on a crease of two non-manifold edges, and is no corner for ever (qp_fan). */
static bool is_through(const qp_gather *g, const qp_mesh *mesh, uint32_t i) {
    const uint32_t vertex = mesh->face_vertices[fan_corner(g, i, 0)];
    return (mesh->vertex_flags[vertex] & QP_VERTEX_NONMANIFOLD) &&
           !qp_sharp_is_infinite(mesh->vertex_sharpness[vertex]);
}

/* The two edges, that of spoke 0 first where the fan has it; tells whether the fan lies beside them. */
static bool find_ends(const qp_gather *g, const qp_mesh *mesh, uint32_t i, uint32_t edges[2]) {
    const uint32_t vertex = mesh->face_vertices[fan_corner(g, i, 0)];
    uint32_t found = 0, far;
    for (uint32_t k = mesh->vertex_offsets[vertex]; k < mesh->vertex_offsets[vertex + 1]; ++k) {
        const uint32_t h = mesh->vertex_corners[k];
        const uint32_t sides[2] = {mesh->corner_edge[h], mesh->corner_edge[qp_corner_prev(mesh, h)]};
        for (uint32_t s = 0; s < 2 && found < 2; ++s) {
            if (!(mesh->edge_flags[sides[s]] & QP_EDGE_NONMANIFOLD)) continue;
            if (found == 0 || edges[0] != sides[s]) edges[found++] = sides[s];
        }
    }
    if (g->closed[i]) return true;
    if (edges[0] != spoke_edge(g, mesh, i, 0, &far)) {
        const uint32_t swap = edges[0];
        edges[0] = edges[1];
        edges[1] = swap;
    }
    return spoke_edge(g, mesh, i, fan_faces(g, i), &far) != edges[1];
}

static bool fan_has_edge(const qp_gather *g, const qp_mesh *mesh, uint32_t i, uint32_t edge) {
    uint32_t far;
    for (uint32_t j = 0; j < fan_spokes(g, i); ++j)
        if (spoke_edge(g, mesh, i, j, &far) == edge) return true;
    return false;
}

static int compare_floats(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The other fans of the vertex have a say: in its rule, or, by Chaikin's rule, in how the semi-sharp edges of this one decay. */
static bool has_others(const qp_gather *g, const qp_mesh *mesh, uint32_t i) {
    const uint32_t vertex = mesh->face_vertices[fan_corner(g, i, 0)];
    if (!(mesh->vertex_flags[vertex] & QP_VERTEX_NONMANIFOLD)) return false;
    if (is_through(g, mesh, i)) return true;
    uint32_t far;
    for (uint32_t j = 0; j < fan_spokes(g, i) && mesh->crease_method == QP_CREASE_CHAIKIN; ++j)
        if (qp_sharp_is_semi(mesh->edge_sharpness[spoke_edge(g, mesh, i, j, &far)])) return true;
    return false;
}

/* Sharpness of the sharp edges in the vertex's other fans, increasing, without boundaries and non-manifold edges: each has two faces
 * there, so that one of its corners at the vertex begins with it. Their number; others may be NULL. */
static uint32_t other_edges(const qp_gather *g, const qp_mesh *mesh, uint32_t i, float *others) {
    const uint32_t vertex = mesh->face_vertices[fan_corner(g, i, 0)];
    uint32_t count = 0;
    for (uint32_t k = mesh->vertex_offsets[vertex]; k < mesh->vertex_offsets[vertex + 1]; ++k) {
        const uint32_t edge = mesh->corner_edge[mesh->vertex_corners[k]];
        if (mesh->edge_sharpness[edge] <= 0.0f || mesh->edge_flags[edge] != 0) continue;
        if (fan_has_edge(g, mesh, i, edge)) continue;
        if (others != NULL) others[count] = mesh->edge_sharpness[edge];
        ++count;
    }
    if (others != NULL) qsort(others, count, sizeof *others, compare_floats);
    return count;
}

static uint32_t float_bits(float f) {
    uint32_t bits;
    f = f == 0.0f ? 0.0f : f; /* -0 is 0 */
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

static float spoke_far_sharpness(const qp_gather *g, const qp_mesh *mesh, uint32_t i, uint32_t j) {
    uint32_t far, edge = spoke_edge(g, mesh, i, j, &far);
    return far_sharpness(mesh, far, edge);
}

/* What the other fans of a vertex add to the key. */
static bool push_other_words(qp_gather *g, const qp_mesh *mesh, uint32_t i) {
    uint32_t edges[2] = {QP_NONE, QP_NONE};
    const uint32_t others = other_edges(g, mesh, i, NULL);
    size_t count = g->word_begin[i + 1];
    float *sharp = qp_alloc(others, sizeof *sharp, false);
    if (sharp == NULL ||
        !qp_grow((void **)&g->words, &g->word_capacity, count + 1 + (size_t)others, sizeof *g->words)) {
        free(sharp);
        return false;
    }
    other_edges(g, mesh, i, sharp);
    /* The corner's first word is at most 2^30 otherwise. */
    g->words[g->word_begin[i]] |= 0x80000000u;
    const bool through = is_through(g, mesh, i);
    g->words[count++] =
        others << 2 | (through ? 2u : 0u) | (through && find_ends(g, mesh, i, edges) ? 1u : 0u);
    for (uint32_t j = 0; j < others; ++j) {
        g->words[count++] = float_bits(sharp[j]);
        if (qp_sharp_is_semi(sharp[j])) g->has_semi = true;
    }
    free(sharp);
    g->word_begin[i + 1] = (uint32_t)count;
    return true;
}

static bool push_corner_words(qp_gather *g, const qp_mesh *mesh, uint32_t i) {
    uint32_t faces = fan_faces(g, i), spokes = fan_spokes(g, i);
    size_t count = g->word_begin[i], need = count + 3 + faces + 2 * (size_t)spokes;
    if (!qp_grow((void **)&g->words, &g->word_capacity, need, sizeof *g->words)) return false;
    uint32_t *w = g->words, vertex = mesh->face_vertices[fan_corner(g, i, 0)];
    w[count++] = faces << 1 | (g->closed[i] ? 1u : 0u);
    w[count++] = g->at[i];
    w[count++] = float_bits(mesh->vertex_sharpness[vertex]);
    if (qp_sharp_is_semi(mesh->vertex_sharpness[vertex])) g->has_semi = true;
    for (uint32_t j = 0; j < faces; ++j) {
        uint32_t size = qp_face_size(mesh, mesh->corner_face[fan_corner(g, i, j)]);
        w[count++] = size;
        if (size == 3) g->has_triangles = true;
    }
    for (uint32_t j = 0; j < spokes; ++j) {
        uint32_t far, edge = spoke_edge(g, mesh, i, j, &far);
        float s = mesh->edge_sharpness[edge];
        w[count++] = float_bits(s);
        if (!qp_sharp_is_semi(s)) continue;
        g->has_semi = true;
        if (mesh->crease_method == QP_CREASE_CHAIKIN) w[count++] = float_bits(far_sharpness(mesh, far, edge));
    }
    g->word_begin[i + 1] = (uint32_t)count;
    return !has_others(g, mesh, i) || push_other_words(g, mesh, i);
}

bool qp_gather_face(qp_gather *g, const qp_mesh *mesh, uint32_t face) {
    uint32_t first = mesh->face_offsets[face];
    g->n = qp_face_size(mesh, face);
    if (!reserve_corners(g, g->n)) return false;
    g->begin[0] = 0;
    g->word_begin[0] = 0;
    g->has_semi = g->has_triangles = g->joined = false;
    for (uint32_t i = 0; i < g->n; ++i) {
        if (!walk_fan(g, mesh, first + i, i) || !push_corner_words(g, mesh, i)) return false;
    }
    return true;
}

/* Compares the keys that start at corners a and b; corner by corner, shorter first. */
static int compare_starts(const qp_gather *g, uint32_t a, uint32_t b) {
    for (uint32_t k = 0; k < g->n; ++k) {
        uint32_t i = (a + k) % g->n, j = (b + k) % g->n;
        uint32_t li = g->word_begin[i + 1] - g->word_begin[i], lj = g->word_begin[j + 1] - g->word_begin[j];
        if (li != lj) return li < lj ? -1 : 1;
        const uint32_t *wi = g->words + g->word_begin[i], *wj = g->words + g->word_begin[j];
        for (uint32_t w = 0; w < li; ++w) {
            if (wi[w] != wj[w]) return wi[w] < wj[w] ? -1 : 1;
        }
    }
    return 0;
}

uint32_t qp_gather_canonical(const qp_gather *g) {
    uint32_t best = 0;
    for (uint32_t start = 1; start < g->n; ++start) {
        if (compare_starts(g, start, best) < 0) best = start;
    }
    return best;
}

bool qp_gather_key(qp_gather *g, const qp_mesh *mesh, uint32_t start, bool child) {
    size_t total = g->word_begin[g->n] + (size_t)2;
    if (!qp_grow((void **)&g->key, &g->key_capacity, total, sizeof *g->key)) return false;
    bool chaikin = g->has_semi && mesh->crease_method == QP_CREASE_CHAIKIN;
    bool smooth = g->has_triangles && mesh->triangle_rule == QP_TRIANGLE_SMOOTH;
    uint32_t count = 0;
    g->key[count++] = g->n;
    g->key[count++] = (child ? 1u : 0u) | (chaikin ? 2u : 0u) | (smooth ? 4u : 0u);
    for (uint32_t k = 0; k < g->n; ++k) {
        uint32_t i = (start + k) % g->n, length = g->word_begin[i + 1] - g->word_begin[i];
        memcpy(g->key + count, g->words + g->word_begin[i], length * sizeof *g->key);
        count += length;
    }
    g->key_words = count;
    return true;
}

/* ---- numbering of the ring ---- */

static uint32_t find_root(uint32_t *parent, uint32_t e) {
    while (parent[e] != e) {
        parent[e] = parent[parent[e]];
        e = parent[e];
    }
    return e;
}
static void join(uint32_t *parent, uint32_t a, uint32_t b) {
    a = find_root(parent, a);
    b = find_root(parent, b);
    /* The lower index stays root, so that roots do not depend on the order of joins. */
    if (a < b) {
        parent[b] = a;
    } else {
        parent[a] = b;
    }
}

/* Entry of vertex k (0: the fan's own vertex, 1: end of spoke j, ...) of fan face j of corner i. */
static uint32_t entry(const qp_gather *g, uint32_t i, uint32_t j, uint32_t k) {
    return g->entry_begin[g->begin[i] + j] + k;
}

static uint32_t entry_size(const qp_gather *g, uint32_t i, uint32_t j) {
    return g->entry_begin[g->begin[i] + j + 1] - g->entry_begin[g->begin[i] + j];
}

/* Which entries are one vertex: consecutive faces of a fan share their vertex and a spoke; all fans share the
 * base face; the face across edge i lies in the fans of corners i and i+1. */
static void join_entries(qp_gather *g) {
    uint32_t n = g->n;
    for (uint32_t i = 0; i < n; ++i) {
        uint32_t m = fan_faces(g, i);
        for (uint32_t j = 0; j < m; ++j) {
            join(g->parent, entry(g, i, j, 0), entry(g, i, g->at[i], 0));
            uint32_t next = j + 1;
            if (next == m) {
                if (!g->closed[i]) continue;
                next = 0;
            }
            join(g->parent, entry(g, i, j, entry_size(g, i, j) - 1), entry(g, i, next, 1));
        }
        for (uint32_t k = 0; k < n; ++k) {
            join(g->parent, entry(g, i, g->at[i], k), entry(g, 0, g->at[0], (i + k) % n));
        }
    }
    for (uint32_t i = 0; i < n; ++i) {
        uint32_t b = (i + 1) % n, ma = fan_faces(g, i), mb = fan_faces(g, b);
        bool there = g->closed[i] || g->at[i] > 0;
        if (!there) continue;
        uint32_t ja = g->at[i] == 0 ? ma - 1 : g->at[i] - 1, jb = (g->at[b] + 1) % mb;
        uint32_t size = entry_size(g, i, ja);
        for (uint32_t k = 0; k < size; ++k) {
            join(g->parent, entry(g, i, ja, k), entry(g, b, jb, (k + 1) % size));
        }
    }
}

static uint32_t face_vertex(const qp_mesh *mesh, uint32_t corner, uint32_t k) {
    uint32_t face = mesh->corner_face[corner], first = mesh->face_offsets[face],
             size = qp_face_size(mesh, face);
    return mesh->face_vertices[first + (corner - first + k) % size];
}

static bool assign_column(qp_gather *g, uint32_t e, uint32_t vertex) {
    uint32_t root = find_root(g->parent, e);
    if (g->column[root] != QP_NONE) return true;
    if (!qp_grow((void **)&g->ring, &g->ring_capacity, (size_t)g->width + 1, sizeof *g->ring) ||
        !qp_grow((void **)&g->roots, &g->root_capacity, (size_t)g->width + 1, sizeof *g->roots)) {
        return false;
    }
    g->ring[g->width] = vertex;
    g->roots[g->width] = root;
    g->column[root] = g->width++;
    return true;
}

/* Once a face: which entries are one vertex does not depend on the starting corner. */
static bool prepare_entries(qp_gather *g, const qp_mesh *mesh) {
    uint32_t fans = g->begin[g->n];
    if (!qp_grow((void **)&g->entry_begin, &g->entry_capacity[0], (size_t)fans + 1, sizeof(uint32_t)))
        return false;
    uint32_t entries = 0;
    for (uint32_t f = 0; f < fans; ++f) {
        g->entry_begin[f] = entries;
        entries += qp_face_size(mesh, mesh->corner_face[g->corners[f]]);
    }
    g->entry_begin[fans] = entries;
    entries += 2 * g->n; /* for the ends of creases that corners' fans lack */
    if (!qp_grow((void **)&g->parent, &g->entry_capacity[1], entries, sizeof(uint32_t)) ||
        !qp_grow((void **)&g->column, &g->entry_capacity[2], entries, sizeof(uint32_t))) {
        return false;
    }
    for (uint32_t e = 0; e < entries; ++e) {
        g->parent[e] = e;
        g->column[e] = QP_NONE;
    }
    join_entries(g);
    g->width = 0;
    g->joined = true;
    return true;
}

/* Columns for the ends of the crease through corner i's vertex that its fan lacks. */
static uint32_t end_entry(const qp_gather *g, uint32_t i, uint32_t t) {
    return g->entry_begin[g->begin[g->n]] + 2 * i + t;
}

static bool assign_ends(qp_gather *g, const qp_mesh *mesh, uint32_t i) {
    uint32_t edges[2] = {QP_NONE, QP_NONE};
    const uint32_t vertex = mesh->face_vertices[fan_corner(g, i, 0)];
    if (!find_ends(g, mesh, i, edges)) return true;
    for (uint32_t t = g->closed[i] ? 0 : 1; t < 2; ++t) {
        const uint32_t *v = mesh->edge_vertices + 2 * (size_t)edges[t];
        if (!assign_column(g, end_entry(g, i, t), v[v[0] == vertex])) return false;
    }
    return true;
}

bool qp_gather_ring(qp_gather *g, const qp_mesh *mesh, uint32_t start) {
    if (!g->joined && !prepare_entries(g, mesh)) return false;
    for (uint32_t k = 0; k < g->width; ++k) g->column[g->roots[k]] = QP_NONE;
    g->width = 0;
    for (uint32_t k = 0; k < g->n; ++k) {
        uint32_t i = (start + k) % g->n;
        if (!assign_column(g, entry(g, i, g->at[i], 0), mesh->face_vertices[fan_corner(g, i, g->at[i])]))
            return false;
    }
    for (uint32_t k = 0; k < g->n; ++k) {
        uint32_t i = (start + k) % g->n;
        for (uint32_t j = 0; j < fan_faces(g, i); ++j) {
            if (j == g->at[i]) continue;
            for (uint32_t v = 1; v < entry_size(g, i, j); ++v) {
                if (!assign_column(g, entry(g, i, j, v), face_vertex(mesh, fan_corner(g, i, j), v)))
                    return false;
            }
        }
        if (is_through(g, mesh, i) && !assign_ends(g, mesh, i)) return false;
    }
    return true;
}

/* ---- level 0 ---- */

static uint32_t entry_column(qp_gather *g, uint32_t e) {
    return g->column[find_root(g->parent, e)];
}

static bool fill_others(qp_gather *g, const qp_mesh *mesh, uint32_t i, qp_arena *arena, qp_fan *fan) {
    uint32_t edges[2] = {QP_NONE, QP_NONE};
    fan->through = is_through(g, mesh, i);
    if (fan->through) {
        fan->beside = find_ends(g, mesh, i, edges);
        fan->end[0] = fan->closed ? entry_column(g, end_entry(g, i, 0)) : fan->spoke[0];
        fan->end[1] = fan->beside ? entry_column(g, end_entry(g, i, 1)) : fan->spoke[fan->faces];
    }
    fan->others = other_edges(g, mesh, i, NULL);
    fan->other_sharp = qp_arena_get(arena, fan->others * sizeof *fan->other_sharp);
    if (fan->other_sharp == NULL) return false;
    other_edges(g, mesh, i, fan->other_sharp);
    return true;
}

static bool fill_fan(qp_gather *g, const qp_mesh *mesh, uint32_t i, uint32_t first_face, qp_local *local,
                     qp_fan *fan, qp_ring_face *ring_faces) {
    qp_arena *arena = &local->level[0].arena;
    uint32_t faces = fan_faces(g, i), spokes = fan_spokes(g, i);
    *fan = (qp_fan){.faces = faces, .closed = g->closed[i]};
    uint32_t *words = qp_arena_get(arena, ((size_t)spokes + 2 * (size_t)faces) * sizeof *words);
    float *floats = qp_arena_get(arena, 2 * (size_t)spokes * sizeof *floats);
    if (words == NULL || floats == NULL) return false;
    fan->spoke = words;
    fan->diagonal = words + spokes;
    fan->face = fan->diagonal + faces;
    fan->sharp = floats;
    fan->far_sharp = floats + spokes;
    fan->vertex = entry_column(g, entry(g, i, 0, 0));
    fan->sharpness = mesh->vertex_sharpness[mesh->face_vertices[fan_corner(g, i, 0)]];
    for (uint32_t j = 0; j < faces; ++j) {
        uint32_t size = entry_size(g, i, j);
        uint32_t *vertices = qp_arena_get(arena, size * sizeof *vertices);
        if (vertices == NULL) return false;
        for (uint32_t k = 0; k < size; ++k) vertices[k] = entry_column(g, entry(g, i, j, k));
        ring_faces[first_face + j] = (qp_ring_face){size, vertices};
        fan->face[j] = first_face + j;
        fan->spoke[j] = vertices[1];
        fan->diagonal[j] = size == 4 ? vertices[2] : QP_NONE;
        if (j + 1 == faces && !fan->closed) fan->spoke[faces] = vertices[size - 1];
    }
    for (uint32_t j = 0; j < spokes; ++j) {
        uint32_t far;
        fan->sharp[j] = mesh->edge_sharpness[spoke_edge(g, mesh, i, j, &far)];
        fan->far_sharp[j] =
            local->chaikin ? spoke_far_sharpness(g, mesh, i, j) : qp_sharp_decrement(fan->sharp[j]);
    }
    return !has_others(g, mesh, i) || fill_others(g, mesh, i, arena, fan);
}

qp_cell *qp_gather_cell(qp_gather *g, const qp_mesh *mesh, uint32_t start, qp_local *local) {
    qp_arena *arena = &local->level[0].arena;
    local->chaikin = mesh->crease_method == QP_CREASE_CHAIKIN;
    local->smooth_triangles = mesh->triangle_rule == QP_TRIANGLE_SMOOTH;
    qp_cell *cell = qp_arena_get(arena, sizeof *cell);
    qp_corner *corners = qp_arena_get(arena, g->n * sizeof *corners);
    qp_fan *fans = qp_arena_get(arena, g->n * sizeof *fans);
    qp_ring_face *ring_faces = qp_arena_get(arena, g->begin[g->n] * sizeof *ring_faces);
    if (cell == NULL || corners == NULL || fans == NULL || ring_faces == NULL) return NULL;
    local->ring_faces = ring_faces;
    *cell = (qp_cell){.n = g->n, .corner = corners};
    for (uint32_t k = 0; k < g->n; ++k) {
        uint32_t i = (start + k) % g->n;
        if (!fill_fan(g, mesh, i, g->begin[i], local, &fans[k], ring_faces)) return NULL;
        corners[k] = (qp_corner){&fans[k], g->at[i]};
    }
    return cell;
}
