/* One Catmull-Clark step of a piece of mesh.
 *
 * The rules are OpenSubdiv's (Catmull and Clark 1978; DeRose, Kass and Truong 1998 for creases):
 *   face point    mean of the face's vertices
 *   edge point    smooth (a + b + f + g) / 4 with f, g the face points; midpoint on a crease; a blend of the
 *                 two by the edge's sharpness where a crease ends in this step
 *   vertex point  smooth (n-2)/n v + mean(e)/n + mean(f)/n; crease 3/4 v + (e + e')/8; corner v; a blend by
 *                 the mean of the sharpnesses that reach zero where the rule changes in this step
 * Sharpness is IEEE float throughout, as there, so that fractions agree bit for bit. Sums of sharpness are
 * taken exactly and rounded once, so that they do not depend on the order of edges. */
#include <string.h>

#include "host/reference/piece_build.h"

static float decrement(float s) {
    if (qp_piece_infinite(s)) return QP_SHARPNESS_INFINITE;
    return s > 1.0f ? s - 1.0f : 0.0f;
}

/* Sharpness of the child of an edge at one of its ends; v holds the sums over that end. Chaikin's rule
 * (DeRose et al., section 3): 3/4 of the edge's own and 1/4 of the mean of the other semi-sharp ones. */
static float child_sharpness(const qp_piece *m, const qp_piece_vertex *v, float s) {
    if (s <= 0.0f) return 0.0f;
    if (!m->chaikin || qp_piece_infinite(s) || v->semi_count < 2) return decrement(s);
    float others = ((float)v->semi_sum - s) / (float)(v->semi_count - 1);
    float child = 0.75f * s + 0.25f * others - 1.0f;
    return child > 0.0f ? child : 0.0f;
}

static void set_vertex(qp_piece *child, uint32_t index, const qp_quad p[3]) {
    qp_piece_vertex *v = &child->vertices[index];
    memcpy(v->p, p, sizeof v->p);
    v->sharpness = 0;
    v->semi_sum = 0;
    v->semi_count = 0;
}

static void face_point(const qp_piece *m, uint32_t face, qp_quad p[3]) {
    uint32_t size = qp_piece_face_size(m, face);
    p[0] = p[1] = p[2] = 0;
    for (uint32_t h = m->face_offsets[face]; h < m->face_offsets[face + 1]; ++h)
        for (int c = 0; c < 3; ++c) p[c] += m->vertices[m->corner_vertex[h]].p[c];
    for (int c = 0; c < 3; ++c) {
        if (size == 4)
            p[c] *= 0.25;
        else
            p[c] /= size;
    }
}

/* How far the edge still counts as a crease in this step: 1 a full one, 0 smooth. OpenSubdiv blends by the
 * sharpness itself whenever one of the two children is smooth. Under Chaikin's rule that can be more than 1
 * (a sharp edge beside blunt ones may lose more than 1), and its weights then extrapolate; the surface is the
 * one it defines, so that is kept. */
static qp_quad crease_weight(const qp_piece *m, const qp_piece_edge *e) {
    float s = e->sharpness;
    if (s <= 0.0f) return 0;
    if (qp_piece_infinite(s)) return 1;
    if (child_sharpness(m, &m->vertices[e->v[0]], s) > 0.0f &&
        child_sharpness(m, &m->vertices[e->v[1]], s) > 0.0f)
        return 1;
    return s;
}

static void smooth_edge_point(const qp_piece *m, const qp_piece_edge *e, const qp_piece *child,
                              qp_quad p[3]) {
    const qp_quad *a = m->vertices[e->v[0]].p, *b = m->vertices[e->v[1]].p;
    const qp_quad *f = child->vertices[m->map_face[e->f[0]]].p, *g = child->vertices[m->map_face[e->f[1]]].p;
    bool tri_f = m->smooth_triangles && qp_piece_face_size(m, e->f[0]) == 3;
    bool tri_g = m->smooth_triangles && qp_piece_face_size(m, e->f[1]) == 3;
    if (!tri_f && !tri_g) {
        for (int c = 0; c < 3; ++c) p[c] = (a[c] + b[c] + f[c] + g[c]) * 0.25;
        return;
    }
    /* Stam and Loop's remedy for triangles: 0.470 in place of 1/4 for a triangle's point. */
    qp_quad triangle = (qp_quad)47 / 100, quarter = 0.25;
    qp_quad face = ((tri_f ? triangle : quarter) + (tri_g ? triangle : quarter)) / 2,
            vertex = (1 - 2 * face) / 2;
    for (int c = 0; c < 3; ++c) p[c] = vertex * (a[c] + b[c]) + face * (f[c] + g[c]);
}

static void edge_point(const qp_piece *m, const qp_piece_edge *e, const qp_piece *child, qp_quad p[3]) {
    const qp_quad *a = m->vertices[e->v[0]].p, *b = m->vertices[e->v[1]].p;
    qp_quad w = crease_weight(m, e);
    if (w == 0 || w != 1) smooth_edge_point(m, e, child, p);
    if (w == 0) return;
    for (int c = 0; c < 3; ++c) {
        qp_quad middle = (a[c] + b[c]) * 0.5;
        p[c] = w == 1 ? middle : w * middle + (1 - w) * p[c];
    }
}

/* The rule at a vertex, from the sharpness of its edges before the step or after it. */
typedef enum rule { RULE_SMOOTH, RULE_CREASE, RULE_CORNER } rule;
typedef struct vertex_rule {
    rule rule;
    uint32_t ends[2]; /* the far ends of a crease */
} vertex_rule;

typedef struct transition {
    double sum;
    uint32_t count;
} transition;

static vertex_rule rule_of(const qp_piece *m, uint32_t vertex, bool after, transition *t) {
    vertex_rule r = {RULE_SMOOTH, {QP_NONE, QP_NONE}};
    const qp_piece_vertex *v = &m->vertices[vertex];
    uint32_t sharp = 0;
    for (uint32_t i = m->vertex_edge_offsets[vertex]; i < m->vertex_edge_offsets[vertex + 1]; ++i) {
        const qp_piece_edge *e = &m->edges[m->vertex_edges[i]];
        float s = e->sharpness;
        if (s <= 0.0f) continue;
        float next = child_sharpness(m, v, s);
        if (next <= 0.0f) {
            t->sum += s;
            t->count++;
        }
        if ((after ? next : s) <= 0.0f) continue;
        if (sharp < 2) r.ends[sharp] = e->v[e->v[0] == vertex];
        sharp++;
    }
    float own = v->sharpness, own_next = decrement(own);
    if (own > 0.0f && own_next <= 0.0f) {
        t->sum += own;
        t->count++;
    }
    if ((after ? own_next : own) > 0.0f || sharp > 2)
        r.rule = RULE_CORNER;
    else if (sharp == 2)
        r.rule = RULE_CREASE;
    return r;
}

static void apply_rule(const qp_piece *m, uint32_t vertex, const vertex_rule *r, const qp_piece *child,
                       qp_quad p[3]) {
    const qp_quad *v = m->vertices[vertex].p;
    if (r->rule == RULE_CORNER) {
        memcpy(p, v, 3 * sizeof *p);
        return;
    }
    if (r->rule == RULE_CREASE) {
        const qp_quad *a = m->vertices[r->ends[0]].p, *b = m->vertices[r->ends[1]].p;
        for (int c = 0; c < 3; ++c) p[c] = v[c] * 0.75 + (a[c] + b[c]) * 0.125;
        return;
    }
    uint32_t first = m->vertex_edge_offsets[vertex], n = m->vertex_edge_offsets[vertex + 1] - first;
    p[0] = p[1] = p[2] = 0;
    for (uint32_t i = 0; i < n; ++i) {
        const qp_piece_edge *e = &m->edges[m->vertex_edges[first + i]];
        const qp_quad *end = m->vertices[e->v[e->v[0] == vertex]].p;
        for (int c = 0; c < 3; ++c) p[c] += end[c];
    }
    for (uint32_t i = m->vertex_corner_offsets[vertex]; i < m->vertex_corner_offsets[vertex + 1]; ++i) {
        const qp_quad *f = child->vertices[m->map_face[m->corner_face[m->vertex_corners[i]]]].p;
        for (int c = 0; c < 3; ++c) p[c] += f[c];
    }
    for (int c = 0; c < 3; ++c) {
        if (n == 4)
            p[c] = v[c] * 0.5 + p[c] * 0.0625;
        else
            p[c] = ((qp_quad)n * (n - 2) * v[c] + p[c]) / ((qp_quad)n * n);
    }
}

static void vertex_point(const qp_piece *m, uint32_t vertex, const qp_piece *child, qp_quad p[3]) {
    transition before = {0, 0}, t = {0, 0};
    vertex_rule parent = rule_of(m, vertex, false, &before), next = rule_of(m, vertex, true, &t);
    apply_rule(m, vertex, &parent, child, p);
    if (parent.rule == next.rule) return;
    float weight = t.count ? (float)t.sum / (float)t.count : 0.0f;
    if (weight > 1.0f) weight = 1.0f;
    qp_quad q[3];
    apply_rule(m, vertex, &next, child, q);
    for (int c = 0; c < 3; ++c) p[c] = weight * p[c] + (1 - (qp_quad)weight) * q[c];
}

/* Numbers the child's vertices: a point for each center, each face and each edge at one. */
static void number_points(qp_piece *m, const uint32_t *centers, uint32_t n_centers, qp_piece *child) {
    memset(m->map_vertex, 0xff, m->n_vertices * sizeof(uint32_t));
    memset(m->map_edge, 0xff, m->n_edges * sizeof(uint32_t));
    memset(m->map_face, 0xff, m->n_faces * sizeof(uint32_t));
    memset(m->map_half, 0xff, 2 * (size_t)m->n_edges * sizeof(uint32_t));
    memset(m->map_spoke, 0xff, m->n_corners * sizeof(uint32_t));
    uint32_t n = 0;
    for (uint32_t i = 0; i < n_centers; ++i) {
        uint32_t v = centers[i];
        m->map_vertex[v] = n++;
        for (uint32_t k = m->vertex_edge_offsets[v]; k < m->vertex_edge_offsets[v + 1]; ++k)
            if (m->map_edge[m->vertex_edges[k]] == QP_NONE) m->map_edge[m->vertex_edges[k]] = n++;
        for (uint32_t k = m->vertex_corner_offsets[v]; k < m->vertex_corner_offsets[v + 1]; ++k) {
            uint32_t f = m->corner_face[m->vertex_corners[k]];
            if (m->map_face[f] == QP_NONE) m->map_face[f] = n++;
        }
    }
    child->n_vertices = n;
}

/* Positions, in the order of dependence, and the sharpness that lives at vertices. */
static void make_points(const qp_piece *m, qp_piece *child) {
    qp_quad p[3];
    for (uint32_t f = 0; f < m->n_faces; ++f)
        if (m->map_face[f] != QP_NONE) {
            face_point(m, f, p);
            set_vertex(child, m->map_face[f], p);
        }
    for (uint32_t e = 0; e < m->n_edges; ++e)
        if (m->map_edge[e] != QP_NONE) {
            const qp_piece_edge *edge = &m->edges[e];
            edge_point(m, edge, child, p);
            set_vertex(child, m->map_edge[e], p);
            /* Only the edge's own two children can be semi-sharp at its point. */
            for (int end = 0; end < 2; ++end) {
                float s = child_sharpness(m, &m->vertices[edge->v[end]], edge->sharpness);
                if (!qp_piece_semisharp(s)) continue;
                child->vertices[m->map_edge[e]].semi_sum += s;
                child->vertices[m->map_edge[e]].semi_count++;
            }
        }
    for (uint32_t v = 0; v < m->n_vertices; ++v)
        if (m->map_vertex[v] != QP_NONE) {
            vertex_point(m, v, child, p);
            set_vertex(child, m->map_vertex[v], p);
            child->vertices[m->map_vertex[v]].sharpness = decrement(m->vertices[v].sharpness);
        }
}

static uint32_t add_edge(qp_piece *child, uint32_t a, uint32_t b, float sharpness) {
    child->edges[child->n_edges] = (qp_piece_edge){.v = {a, b}, .sharpness = sharpness};
    return child->n_edges++;
}

/* The child of an edge at a center. */
static uint32_t half_edge(qp_piece *m, uint32_t edge, uint32_t vertex, qp_piece *child) {
    const qp_piece_edge *e = &m->edges[edge];
    uint32_t *slot = &m->map_half[2 * edge + (e->v[1] == vertex)];
    if (*slot != QP_NONE) return *slot;
    qp_piece_vertex *v = &child->vertices[m->map_vertex[vertex]];
    float s = child_sharpness(m, &m->vertices[vertex], e->sharpness);
    if (qp_piece_semisharp(s)) {
        v->semi_sum += s;
        v->semi_count++;
    }
    return *slot = add_edge(child, m->map_vertex[vertex], m->map_edge[edge], s);
}

/* The edge from the point of the edge after `corner` to the point of its face. */
static uint32_t spoke(qp_piece *m, uint32_t corner, qp_piece *child) {
    if (m->map_spoke[corner] == QP_NONE)
        m->map_spoke[corner] =
            add_edge(child, m->map_edge[m->corner_edge[corner]], m->map_face[m->corner_face[corner]], 0.0f);
    return m->map_spoke[corner];
}

static void add_child_face(qp_piece *m, uint32_t corner, qp_piece *child) {
    uint32_t face = m->corner_face[corner], vertex = m->corner_vertex[corner],
             prev = qp_piece_prev(m, corner);
    uint32_t place = qp_piece_face_size(m, face) == 4 ? corner - m->face_offsets[face] : 0;
    uint32_t v[4] = {m->map_vertex[vertex], m->map_edge[m->corner_edge[corner]], m->map_face[face],
                     m->map_edge[m->corner_edge[prev]]};
    uint32_t e[4] = {half_edge(m, m->corner_edge[corner], vertex, child), spoke(m, corner, child),
                     spoke(m, prev, child), half_edge(m, m->corner_edge[prev], vertex, child)};
    uint32_t vertices[4], edges[4];
    for (uint32_t i = 0; i < 4; ++i) {
        vertices[(i + place) & 3] = v[i];
        edges[(i + place) & 3] = e[i];
    }
    m->corner_child[corner] = child->n_faces;
    qp_piece_add_face(child, 4, vertices, edges);
}

qp_status qp_piece_refine(qp_piece *parent, const uint32_t *centers, uint32_t n_centers, qp_piece *child,
                          qp_error *err) {
    size_t edges = 0, faces = 0;
    for (uint32_t i = 0; i < n_centers; ++i) {
        uint32_t v = centers[i];
        edges += parent->vertex_edge_offsets[v + 1] - parent->vertex_edge_offsets[v];
        faces += parent->vertex_corner_offsets[v + 1] - parent->vertex_corner_offsets[v];
    }
    qp_status status =
        qp_piece_reserve(child, n_centers + edges + faces, edges + 2 * faces, faces, 4 * faces, err);
    if (status) return status;
    child->chaikin = parent->chaikin;
    child->smooth_triangles = false;
    number_points(parent, centers, n_centers, child);
    make_points(parent, child);
    for (uint32_t i = 0; i < n_centers; ++i)
        for (uint32_t k = parent->vertex_corner_offsets[centers[i]];
             k < parent->vertex_corner_offsets[centers[i] + 1]; ++k)
            add_child_face(parent, parent->vertex_corners[k], child);
    qp_piece_index(child);
    return QP_OK;
}
