/* Pieces: memory, gathering from the base mesh, incidence and walks. */
#include "host/reference/piece.h"

#include <stdlib.h>
#include <string.h>

#include "host/reference/piece_build.h"

void qp_piece_free(qp_piece *piece) {
    free(piece->block);
    memset(piece, 0, sizeof *piece);
}

/* Hands out consecutive aligned pieces of one block; with base NULL it only measures. */
static void *cut(unsigned char *base, size_t *used, size_t count, size_t size) {
    void *at = base ? base + *used : NULL;
    *used += (count * size + 15) & ~(size_t)15;
    return at;
}

static size_t lay_out(qp_piece *m, unsigned char *base, size_t nv, size_t ne, size_t nf, size_t nc) {
    size_t used = 0, word = sizeof(uint32_t);
    m->vertices = cut(base, &used, nv, sizeof *m->vertices);
    m->edges = cut(base, &used, ne, sizeof *m->edges);
    m->face_offsets = cut(base, &used, nf + 1, word);
    m->corner_face = cut(base, &used, nc, word);
    m->corner_vertex = cut(base, &used, nc, word);
    m->corner_edge = cut(base, &used, nc, word);
    m->vertex_edge_offsets = cut(base, &used, nv + 1, word);
    m->vertex_edges = cut(base, &used, 2 * ne, word);
    m->vertex_corner_offsets = cut(base, &used, nv + 1, word);
    m->vertex_corners = cut(base, &used, nc, word);
    m->corner_child = cut(base, &used, nc, word);
    m->map_vertex = cut(base, &used, nv, word);
    m->map_edge = cut(base, &used, ne, word);
    m->map_face = cut(base, &used, nf, word);
    m->map_half = cut(base, &used, 2 * ne, word);
    m->map_spoke = cut(base, &used, nc, word);
    return used;
}

qp_status qp_piece_reserve(qp_piece *m, size_t nv, size_t ne, size_t nf, size_t nc, qp_error *err) {
    size_t need = lay_out(m, NULL, nv, ne, nf, nc);
    if (need > m->block_bytes) {
        free(m->block);
        m->block_bytes = 0;
        m->block = qp_alloc(2, need, false);
        if (!m->block) return qp_fail_memory(err, 2 * need, "a piece of the reference");
        m->block_bytes = 2 * need;
    }
    lay_out(m, m->block, nv, ne, nf, nc);
    m->n_vertices = m->n_edges = m->n_faces = m->n_corners = 0;
    m->face_offsets[0] = 0;
    return QP_OK;
}

void qp_piece_add_face(qp_piece *m, uint32_t size, const uint32_t *vertices, const uint32_t *edges) {
    uint32_t f = m->n_faces++;
    for (uint32_t i = 0; i < size; ++i) {
        uint32_t h = m->n_corners++;
        m->corner_face[h] = f;
        m->corner_vertex[h] = vertices[i];
        m->corner_edge[h] = edges[i];
        qp_piece_edge *e = &m->edges[edges[i]];
        if (e->n_faces < 2) e->f[e->n_faces] = f;
        e->n_faces++;
    }
    m->face_offsets[f + 1] = m->n_corners;
}

/* Counts, then places; leaves offsets[i] at the start of item i's list. */
void qp_piece_index(qp_piece *m) {
    uint32_t *eo = m->vertex_edge_offsets, *co = m->vertex_corner_offsets;
    memset(eo, 0, (m->n_vertices + 1) * sizeof *eo);
    memset(co, 0, (m->n_vertices + 1) * sizeof *co);
    for (uint32_t e = 0; e < m->n_edges; ++e) {
        eo[m->edges[e].v[0]]++;
        eo[m->edges[e].v[1]]++;
    }
    for (uint32_t h = 0; h < m->n_corners; ++h) co[m->corner_vertex[h]]++;
    for (uint32_t v = 1; v <= m->n_vertices; ++v) {
        eo[v] += eo[v - 1];
        co[v] += co[v - 1];
    }
    for (uint32_t e = m->n_edges; e-- > 0;) {
        m->vertex_edges[--eo[m->edges[e].v[0]]] = e;
        m->vertex_edges[--eo[m->edges[e].v[1]]] = e;
    }
    for (uint32_t h = m->n_corners; h-- > 0;) m->vertex_corners[--co[m->corner_vertex[h]]] = h;
}

qp_piece_kind qp_piece_vertex_kind(const qp_piece *m, uint32_t vertex) {
    qp_piece_kind k = {0, 0, 0, 0, true};
    const uint32_t *eo = m->vertex_edge_offsets, *co = m->vertex_corner_offsets;
    k.n_edges = eo[vertex + 1] - eo[vertex];
    k.n_faces = co[vertex + 1] - co[vertex];
    for (uint32_t i = eo[vertex]; i < eo[vertex + 1]; ++i) {
        float s = m->edges[m->vertex_edges[i]].sharpness;
        k.n_infinite += qp_piece_infinite(s);
        k.n_semisharp += qp_piece_semisharp(s);
    }
    for (uint32_t i = co[vertex]; i < co[vertex + 1]; ++i)
        k.quads = k.quads && qp_piece_face_size(m, m->corner_face[m->vertex_corners[i]]) == 4;
    return k;
}

uint32_t qp_piece_across(const qp_piece *m, uint32_t corner, uint32_t edge) {
    const qp_piece_edge *e = &m->edges[edge];
    if (e->n_faces != 2) return QP_NONE;
    uint32_t face = e->f[0] == m->corner_face[corner] ? e->f[1] : e->f[0];
    for (uint32_t h = m->face_offsets[face]; h < m->face_offsets[face + 1]; ++h)
        if (m->corner_vertex[h] == m->corner_vertex[corner]) return h;
    return QP_NONE;
}

static int by_index(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static uint32_t sort_unique(uint32_t *list, uint32_t count) {
    qsort(list, count, sizeof *list, by_index);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; ++i)
        if (kept == 0 || list[kept - 1] != list[i]) list[kept++] = list[i];
    return kept;
}

static uint32_t place_of(const uint32_t *list, uint32_t count, uint32_t value) {
    const uint32_t *at = bsearch(&value, list, count, sizeof *list, by_index);
    return (uint32_t)(at - list);
}

/* Every semi-sharp edge has two faces that run opposite ways, so it leaves each of its ends exactly once. */
static void sum_semisharp(const qp_mesh *mesh, uint32_t vertex, qp_piece_vertex *out) {
    for (uint32_t i = mesh->vertex_offsets[vertex]; i < mesh->vertex_offsets[vertex + 1]; ++i) {
        float s = mesh->edge_sharpness[mesh->corner_edge[mesh->vertex_corners[i]]];
        if (!qp_piece_semisharp(s)) continue;
        out->semi_sum += s;
        out->semi_count++;
    }
}

/* Faces around the base face, itself first; *faces is allocated. */
static qp_status collect_faces(const qp_mesh *mesh, uint32_t face, uint32_t **faces, uint32_t *count,
                               qp_error *err) {
    size_t bound = 0;
    for (uint32_t h = mesh->face_offsets[face]; h < mesh->face_offsets[face + 1]; ++h) {
        uint32_t v = mesh->face_vertices[h];
        bound += mesh->vertex_offsets[v + 1] - mesh->vertex_offsets[v];
    }
    uint32_t *list = qp_alloc(bound, sizeof *list, false), n = 0;
    if (!list) return qp_fail_memory(err, bound * sizeof *list, "the faces around a patch");
    for (uint32_t h = mesh->face_offsets[face]; h < mesh->face_offsets[face + 1]; ++h) {
        uint32_t v = mesh->face_vertices[h];
        for (uint32_t i = mesh->vertex_offsets[v]; i < mesh->vertex_offsets[v + 1]; ++i)
            list[n++] = mesh->corner_face[mesh->vertex_corners[i]];
    }
    n = sort_unique(list, n);
    uint32_t at = place_of(list, n, face);
    memmove(list + 1, list, at * sizeof *list);
    list[0] = face;
    *faces = list;
    *count = n;
    return QP_OK;
}

typedef struct gather {
    const qp_mesh *mesh;
    uint32_t *faces, *vertices, *edges, n_faces, n_vertices, n_edges, n_corners, max_size;
} gather;

static void fill(const gather *g, const double *positions, qp_piece *piece, uint32_t *scratch) {
    const qp_mesh *mesh = g->mesh;
    for (uint32_t i = 0; i < g->n_vertices; ++i) {
        qp_piece_vertex *v = &piece->vertices[i];
        uint32_t from = g->vertices[i];
        for (int c = 0; c < 3; ++c) v->p[c] = positions[3 * (size_t)from + c];
        v->sharpness = mesh->vertex_sharpness[from];
        v->semi_sum = 0;
        v->semi_count = 0;
        if (piece->chaikin) sum_semisharp(mesh, from, v);
    }
    for (uint32_t i = 0; i < g->n_edges; ++i) {
        const uint32_t *ends = mesh->edge_vertices + 2 * (size_t)g->edges[i];
        piece->edges[i] = (qp_piece_edge){.v = {place_of(g->vertices, g->n_vertices, ends[0]),
                                                place_of(g->vertices, g->n_vertices, ends[1])},
                                          .sharpness = mesh->edge_sharpness[g->edges[i]]};
    }
    piece->n_vertices = g->n_vertices;
    piece->n_edges = g->n_edges;
    for (uint32_t i = 0; i < g->n_faces; ++i) {
        uint32_t first = mesh->face_offsets[g->faces[i]], size = qp_face_size(mesh, g->faces[i]);
        for (uint32_t k = 0; k < size; ++k) {
            scratch[k] = place_of(g->vertices, g->n_vertices, mesh->face_vertices[first + k]);
            scratch[g->max_size + k] = place_of(g->edges, g->n_edges, mesh->corner_edge[first + k]);
        }
        qp_piece_add_face(piece, size, scratch, scratch + g->max_size);
    }
    qp_piece_index(piece);
}

static qp_status collect_and_fill(gather *g, const double *positions, qp_piece *piece, qp_error *err) {
    const qp_mesh *mesh = g->mesh;
    for (uint32_t i = 0; i < g->n_faces; ++i) {
        uint32_t size = qp_face_size(mesh, g->faces[i]);
        g->n_corners += size;
        if (size > g->max_size) g->max_size = size;
    }
    size_t words = 2 * ((size_t)g->n_corners + g->max_size);
    g->vertices = qp_alloc(words, sizeof(uint32_t), false);
    if (!g->vertices) return qp_fail_memory(err, words * sizeof(uint32_t), "the vertices around a patch");
    g->edges = g->vertices + g->n_corners;
    uint32_t n = 0;
    for (uint32_t i = 0; i < g->n_faces; ++i)
        for (uint32_t h = mesh->face_offsets[g->faces[i]]; h < mesh->face_offsets[g->faces[i] + 1]; ++h) {
            g->vertices[n] = mesh->face_vertices[h];
            g->edges[n++] = mesh->corner_edge[h];
        }
    g->n_vertices = sort_unique(g->vertices, n);
    g->n_edges = sort_unique(g->edges, n);
    if (qp_piece_reserve(piece, g->n_vertices, g->n_edges, g->n_faces, n, err)) return QP_SYSTEM;
    fill(g, positions, piece, g->edges + g->n_corners);
    return QP_OK;
}

qp_status qp_piece_gather(const qp_mesh *mesh, const double *positions, uint32_t face, qp_piece *piece,
                          qp_error *err) {
    gather g = {.mesh = mesh};
    piece->chaikin = mesh->crease_method == QP_CREASE_CHAIKIN;
    piece->smooth_triangles = mesh->triangle_rule == QP_TRIANGLE_SMOOTH;
    qp_status status = collect_faces(mesh, face, &g.faces, &g.n_faces, err);
    if (!status) status = collect_and_fill(&g, positions, piece, err);
    free(g.vertices);
    free(g.faces);
    return status;
}
