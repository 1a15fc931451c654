/* Meshes of the stress families. */
#include "host/mesh/generate.h"
#include "host/reference/stress.h"

#include <math.h>
#include <stdlib.h>

/* Vertex (i, j) of a fan's sector. A sector owns i = 1..n, j = 0..n; its j axis is the i axis of the next sector. */
static uint32_t fan_vertex(uint32_t sectors, uint32_t n, bool open, uint32_t s, uint32_t i, uint32_t j) {
    const uint32_t sector = n * (n + 1);
    if (i > 0) return 1 + s * sector + (i - 1) * (n + 1) + j;
    if (j == 0) return 0;
    if (s + 1 < sectors) return 1 + (s + 1) * sector + (j - 1) * (n + 1);
    return open ? 1 + sectors * sector + (j - 1) : 1 + (j - 1) * (n + 1);
}

static void fan_point(mesh_builder *b, double turn, double r, double rough, qp_random *random) {
    double x, y;
    generate_circle(turn, &x, &y);
    const double dome = 0.5 - 0.4 * r * r + 0.2 * r * r * x * y;
    builder_vertex(b, r * x, r * y, dome + rough * (2 * qp_random_unit(random) - 1));
}

qp_status qp_stress_fan(uint32_t n, uint32_t rings, bool open, double rough, qp_random *random,
                        qp_mesh **mesh, qp_error *err) {
    mesh_builder b = {.boundary = QP_BOUNDARY_EDGE_ONLY};
    /* An open fan takes three quarters of a turn. */
    const double share = open ? 0.75 : 1;
    builder_vertex(&b, 0, 0, 0.5);
    for (uint32_t s = 0; s < n; ++s)
        for (uint32_t i = 1; i <= rings; ++i)
            for (uint32_t j = 0; j <= rings; ++j)
                fan_point(&b, share * (s + (double)j / (i + j)) / n, (double)(i > j ? i : j) / rings, rough,
                          random);
    for (uint32_t j = 1; open && j <= rings; ++j) fan_point(&b, share, (double)j / rings, rough, random);
    for (uint32_t s = 0; s < n; ++s) {
        for (uint32_t i = 0; i < rings; ++i) {
            for (uint32_t j = 0; j < rings; ++j) {
                builder_quad(&b, fan_vertex(n, rings, open, s, i, j), fan_vertex(n, rings, open, s, i + 1, j),
                             fan_vertex(n, rings, open, s, i + 1, j + 1),
                             fan_vertex(n, rings, open, s, i, j + 1));
            }
        }
    }
    return builder_finish(&b, mesh, err);
}

qp_status qp_stress_shape(uint32_t number, qp_random *random, qp_mesh **mesh, qp_error *err) {
    qp_generate_options options = {.sharpness = -1, .seed = qp_random_bits(random), .faces = 30};
    switch (number % 6) {
    case 0:
        options.n[0] = 6;
        options.n[1] = 5;
        return qp_mesh_generate("torus", &options, mesh, err);
    case 1:
        return qp_stress_fan(3 + qp_random_below(random, 6), 2, false, 0.1, random, mesh, err);
    case 2:
        return qp_stress_fan(1 + qp_random_below(random, 6), 2, true, 0.1, random, mesh, err);
    case 3:
        options.n[0] = 3 + qp_random_below(random, 6);
        options.n[1] = 2;
        return qp_mesh_generate("prism", &options, mesh, err);
    default:
        return qp_mesh_generate(number % 2 == 0 ? "random-closed" : "random-open", &options, mesh, err);
    }
}

qp_status qp_stress_nonmanifold(qp_random *random, qp_mesh **mesh, qp_error *err) {
    enum { MOST = 12 };
    mesh_builder b = {.boundary = (qp_boundary)qp_random_below(random, 3),
                      .crease_method = (qp_crease_method)qp_random_below(random, 2),
                      .triangle_rule = (qp_triangle_rule)qp_random_below(random, 2)};
    const uint32_t n = 5 + qp_random_below(random, MOST - 4), faces = 2 + qp_random_below(random, 14);
    for (uint32_t v = 0; v < n; ++v) {
        double p[3];
        for (int k = 0; k < 3; ++k) p[k] = 2 * qp_random_unit(random) - 1;
        builder_vertex(&b, p[0], p[1], p[2]);
    }
    for (uint32_t f = 0; f < faces; ++f) {
        uint32_t order[MOST];
        uint32_t size = qp_random_chance(random, 0.6) ? 4 : 3 + qp_random_below(random, 3);
        if (size > n) size = n;
        for (uint32_t v = 0; v < n; ++v) order[v] = v;
        for (uint32_t v = 0; v < size; ++v) {
            const uint32_t other = v + qp_random_below(random, n - v), swap = order[v];
            order[v] = order[other];
            order[other] = swap;
        }
        builder_face(&b, size, order);
    }
    return builder_finish(&b, mesh, err);
}

static void copy_tags(mesh_builder *b, const qp_mesh *m) {
    for (uint32_t i = 0; i < m->n_creases; ++i)
        builder_crease(b, m->crease_vertices[2 * (size_t)i], m->crease_vertices[2 * (size_t)i + 1],
                       m->crease_sharpness[i]);
    for (uint32_t i = 0; i < m->n_corner_tags; ++i)
        builder_corner(b, m->corner_tag_vertices[i], m->corner_tag_sharpness[i]);
    for (uint32_t i = 0; i < m->n_hole_tags; ++i) builder_hole(b, m->hole_tag_faces[i]);
    b->boundary = m->boundary;
    b->crease_method = m->crease_method;
    b->triangle_rule = m->triangle_rule;
}

/* Marks what has a tag already, so that nothing gets two. */
static void mark_tagged(const qp_mesh *m, uint8_t *edges, uint8_t *vertices) {
    for (uint32_t e = 0; e < m->n_edges; ++e) edges[e] = m->edge_sharpness[e] > 0;
    for (uint32_t v = 0; v < m->n_vertices; ++v) vertices[v] = m->vertex_sharpness[v] > 0;
}

static void add_chain(mesh_builder *b, const qp_mesh *m, const qp_stress_tags *t, uint8_t *edges,
                      qp_random *random) {
    float sharpness = t->sharpness(random, t->context);
    uint32_t corner = qp_random_below(random, m->n_corners);
    for (uint32_t i = 0; i < t->length; ++i) {
        const uint32_t edge = m->corner_edge[corner], next = qp_corner_next(m, corner);
        const uint32_t v = m->face_vertices[next], begin = m->vertex_offsets[v],
                       valence = m->vertex_offsets[v + 1] - begin;
        if (!edges[edge]) builder_crease(b, m->face_vertices[corner], v, sharpness);
        edges[edge] = 1;
        if (!t->constant) sharpness = t->sharpness(random, t->context);
        /* Straight on where four faces meet. */
        const uint32_t twin = m->corner_twin[next];
        if (valence == 4 && m->vertex_flags[v] == 0 && twin != QP_NONE)
            corner = qp_corner_next(m, twin);
        else
            corner = m->vertex_corners[begin + qp_random_below(random, valence)];
    }
}

static void add_tags(mesh_builder *b, const qp_mesh *m, const qp_stress_tags *t, uint8_t *edges,
                     uint8_t *vertices, qp_random *random) {
    mark_tagged(m, edges, vertices);
    for (uint32_t i = 0; i < t->chains; ++i) add_chain(b, m, t, edges, random);
    for (uint32_t i = 0; i < t->corners; ++i) {
        const uint32_t v = qp_random_below(random, m->n_vertices);
        const float sharpness = t->sharpness(random, t->context);
        if (!vertices[v]) builder_corner(b, v, sharpness);
        vertices[v] = 1;
    }
    const uint32_t any = qp_random_below(random, m->n_faces);
    const uint32_t first = t->first_hole == QP_NONE ? any : t->first_hole;
    for (uint32_t i = 0; i < t->holes && i + 1 < m->n_faces; ++i) builder_hole(b, (first + i) % m->n_faces);
    if (t->rules < 0) return;
    b->boundary = (qp_boundary)(t->rules % 3);
    b->crease_method = (qp_crease_method)(t->rules / 3 % 2);
    b->triangle_rule = (qp_triangle_rule)(t->rules / 6 % 2);
}

qp_status qp_stress_tag(qp_mesh **mesh, const qp_stress_tags *tags, qp_random *random, qp_error *err) {
    const qp_mesh *m = *mesh;
    uint8_t *edges = qp_alloc((size_t)m->n_edges + m->n_vertices, 1, true);
    if (edges == NULL) return qp_fail_memory(err, (size_t)m->n_edges + m->n_vertices, "tags");
    mesh_builder b = {0};
    qp_mesh *tagged = NULL;
    generate_copy(&b, m, NULL);
    copy_tags(&b, m);
    add_tags(&b, m, tags, edges, edges + m->n_edges, random);
    free(edges);
    qp_status status = builder_finish(&b, &tagged, err);
    if (status != QP_OK) return status;
    qp_mesh_free(*mesh);
    *mesh = tagged;
    return QP_OK;
}

qp_status qp_stress_moved(qp_mesh **mesh, qp_error *err) {
    const qp_mesh_options same = {.override_boundary = 1, .boundary = (*mesh)->boundary};
    return qp_mesh_apply_options(mesh, &same, err);
}
