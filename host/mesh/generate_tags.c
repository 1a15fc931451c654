/* Random tags: chains of creases (which end in darts or meet in corners), creased face outlines, corners,
 * holes, and the three rules. */
#include "host/mesh/generate.h"

#include <stdlib.h>

/* Infinite now and then, else a multiple of 1/16 in (0, 6). */
static float random_sharpness(qp_random *random) {
    if (qp_random_chance(random, 0.25)) return QP_SHARPNESS_INFINITE;
    return (float)(1 + qp_random_below(random, 95)) / 16;
}

typedef struct tagger {
    mesh_builder *b;
    const qp_mesh *mesh;
    qp_random *random;
    uint8_t *edge_done; /* [n_edges] an edge gets one tag at most */
} tagger;

static void tag_edge(tagger *t, uint32_t corner, float sharpness) {
    const qp_mesh *m = t->mesh;
    const uint32_t edge = m->corner_edge[corner];
    if (t->edge_done[edge]) return;
    t->edge_done[edge] = 1;
    builder_crease(t->b, m->face_vertices[corner], m->face_vertices[qp_corner_next(m, corner)], sharpness);
}

/* The half-edge on which a chain goes on after `corner`, or QP_NONE: straight on where the valence is 4,
 * along the boundary on a boundary, else any way out. */
static uint32_t go_on(const tagger *t, uint32_t corner) {
    const qp_mesh *m = t->mesh;
    const uint32_t next = qp_corner_next(m, corner), v = m->face_vertices[next];
    const uint32_t begin = m->vertex_offsets[v], valence = m->vertex_offsets[v + 1] - begin;
    if (m->vertex_flags[v] == 0 && valence == 4 && qp_random_chance(t->random, 0.8)) {
        const uint32_t twin = m->corner_twin[next];
        return twin == QP_NONE ? QP_NONE : qp_corner_next(m, twin);
    }
    if (m->corner_twin[corner] == QP_NONE && qp_random_chance(t->random, 0.8)) {
        for (uint32_t i = begin; i < begin + valence; ++i) {
            if (m->corner_twin[m->vertex_corners[i]] == QP_NONE) return m->vertex_corners[i];
        }
    }
    return m->vertex_corners[begin + qp_random_below(t->random, valence)];
}

static void tag_chain(tagger *t) {
    const uint32_t length = 1 + qp_random_below(t->random, 12);
    const bool constant = qp_random_chance(t->random, 0.6);
    float sharpness = random_sharpness(t->random);
    uint32_t corner = qp_random_below(t->random, t->mesh->n_corners);
    for (uint32_t i = 0; i < length && corner != QP_NONE; ++i) {
        tag_edge(t, corner, sharpness);
        if (!constant) sharpness = random_sharpness(t->random);
        corner = go_on(t, corner);
    }
}

static void tag_outline(tagger *t) {
    const qp_mesh *m = t->mesh;
    const uint32_t f = qp_random_below(t->random, m->n_faces);
    const float sharpness = random_sharpness(t->random);
    for (uint32_t c = m->face_offsets[f]; c < m->face_offsets[f + 1]; ++c) tag_edge(t, c, sharpness);
}

/* Under the rule "none", boundary edges tagged infinitely sharp are what keeps boundary faces. */
static void tag_boundary(tagger *t) {
    for (uint32_t c = 0; c < t->mesh->n_corners; ++c) {
        if (t->mesh->corner_twin[c] == QP_NONE && !qp_random_chance(t->random, 0.1)) {
            tag_edge(t, c, QP_SHARPNESS_INFINITE);
        }
    }
}

static void tag_corners(tagger *t, uint32_t count) {
    uint8_t *done = qp_alloc(t->mesh->n_vertices, 1, true);
    if (done == NULL) {
        t->b->failed = true;
        return;
    }
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t v = qp_random_below(t->random, t->mesh->n_vertices);
        const float sharpness = random_sharpness(t->random);
        if (!done[v]) builder_corner(t->b, v, sharpness);
        done[v] = 1;
    }
    free(done);
}

static void choose_rules(mesh_builder *b, qp_random *random) {
    static const qp_boundary boundaries[6] = {
        QP_BOUNDARY_NONE,      QP_BOUNDARY_EDGE_AND_CORNER, QP_BOUNDARY_EDGE_AND_CORNER,
        QP_BOUNDARY_EDGE_ONLY, QP_BOUNDARY_EDGE_ONLY,       QP_BOUNDARY_EDGE_ONLY};
    b->boundary = boundaries[qp_random_below(random, 6)];
    b->crease_method = qp_random_chance(random, 0.35) ? QP_CREASE_CHAIKIN : QP_CREASE_UNIFORM;
    b->triangle_rule = qp_random_chance(random, 0.35) ? QP_TRIANGLE_SMOOTH : QP_TRIANGLE_CATMARK;
}

void generate_tags(mesh_builder *b, const qp_mesh *mesh, qp_random *random) {
    choose_rules(b, random);
    tagger t = {b, mesh, random, qp_alloc(mesh->n_edges, 1, true)};
    if (t.edge_done == NULL) {
        b->failed = true;
        return;
    }
    if (b->boundary == QP_BOUNDARY_NONE && qp_random_chance(random, 0.6)) tag_boundary(&t);
    if (qp_random_chance(random, 0.85)) { /* the rest stay as smooth as their rules let them */
        const uint32_t some = 1 + (mesh->n_edges / 12 < 10 ? mesh->n_edges / 12 : 10);
        for (uint32_t i = qp_random_below(random, some + 1); i > 0; --i) tag_chain(&t);
        for (uint32_t i = qp_random_chance(random, 0.3) ? 1 + qp_random_below(random, 2) : 0; i > 0; --i) {
            tag_outline(&t);
        }
        if (qp_random_chance(random, 0.5)) tag_corners(&t, 1 + qp_random_below(random, some));
        if (qp_random_chance(random, 0.25)) {
            /* Each face at most once, so never all of them: every fourth at the most, from a random one on.
             */
            const uint32_t count = qp_random_below(random, mesh->n_faces / 4 + 1);
            const uint32_t first = qp_random_below(random, mesh->n_faces);
            for (uint32_t i = 0; i < count; ++i) builder_hole(b, (first + 3 * i) % mesh->n_faces);
        }
    }
    free(t.edge_done);
}
