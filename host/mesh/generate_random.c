/* Random meshes: a small seed (solids of revolution, torus, grid), random edits, shapes evened out and
 * shaken, random tags. Only +, -, *, / and sqrt on doubles, and rounding at the end: a seed gives the same
 * mesh on every machine. */
#include "host/mesh/generate.h"

#include <math.h>
#include <stdlib.h>

typedef enum cap { CAP_OPEN, CAP_POLYGON, CAP_APEX } cap;

static void add_cap(mesh_builder *b, cap kind, uint32_t n, uint32_t first, bool bottom, double z) {
    if (kind == CAP_OPEN) return;
    uint32_t loop[32];
    for (uint32_t i = 0; i < n; ++i) loop[i] = first + (bottom ? n - 1 - i : i);
    if (kind == CAP_POLYGON) {
        builder_face(b, n, loop);
        return;
    }
    const uint32_t apex = builder_vertex(b, 0, 0, z);
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t triangle[3] = {apex, loop[i], loop[(i + 1) % n]};
        builder_face(b, 3, triangle);
    }
}

/* Rings of n vertices about the z axis, joined by quads or triangles, and what closes the two ends: prisms,
 * antiprisms, pyramids, bipyramids, and without caps fans, strips and lone polygons. */
static void add_lathe(mesh_builder *b, qp_random *random, bool open) {
    uint32_t n = 3 + qp_random_below(random, 6);
    if (qp_random_chance(random, 0.1)) n += qp_random_below(random, 16);
    const uint32_t rings = 1 + qp_random_below(random, 4);
    const bool twisted = qp_random_chance(random, 0.35);
    cap bottom = qp_random_chance(random, 0.5) ? CAP_POLYGON : CAP_APEX;
    cap top = qp_random_chance(random, 0.5) ? CAP_POLYGON : CAP_APEX;
    if (rings == 1 && bottom == CAP_POLYGON) top = CAP_APEX;
    if (open && qp_random_chance(random, 0.7)) bottom = CAP_OPEN;
    if (open && rings > 1 && qp_random_chance(random, 0.4)) top = CAP_OPEN;
    const uint32_t first = builder_vertex_count(b);
    for (uint32_t j = 0; j < rings; ++j) {
        const double r = 0.7 + 0.6 * qp_random_unit(random);
        for (uint32_t i = 0; i < n; ++i) {
            double x, y;
            generate_circle((i + (twisted ? 0.5 * j : 0)) / n, &x, &y);
            builder_vertex(b, r * x, r * y, 0.8 * j);
        }
    }
    for (uint32_t j = 0; j + 1 < rings; ++j) {
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = first + j * n + i, next = first + j * n + (i + 1) % n;
            if (twisted) {
                const uint32_t low[3] = {a, next, a + n}, high[3] = {next, next + n, a + n};
                builder_face(b, 3, low);
                builder_face(b, 3, high);
            } else {
                builder_quad(b, a, next, next + n, a + n);
            }
        }
    }
    add_cap(b, bottom, n, first, true, -0.7);
    add_cap(b, top, n, first + (rings - 1) * n, false, 0.8 * (rings - 1) + 0.7);
}

static void add_random_torus(mesh_builder *b, qp_random *random) {
    const uint32_t around = 3 + qp_random_below(random, 5), tube = 3 + qp_random_below(random, 3);
    const uint32_t first = builder_vertex_count(b);
    for (uint32_t i = 0; i < around; ++i) {
        for (uint32_t j = 0; j < tube; ++j) {
            double x, y, r, z;
            generate_circle((double)i / around, &x, &y);
            generate_circle((double)j / tube, &r, &z);
            builder_vertex(b, (1 + 0.45 * r) * x, (1 + 0.45 * r) * y, 0.45 * z);
        }
    }
    for (uint32_t i = 0; i < around; ++i) {
        for (uint32_t j = 0; j < tube; ++j) {
            const uint32_t here = first + i * tube, next = first + (i + 1) % around * tube,
                           up = (j + 1) % tube;
            builder_quad(b, here + j, next + j, next + up, here + up);
        }
    }
}

static void add_grid(mesh_builder *b, qp_random *random) {
    const uint32_t nx = 1 + qp_random_below(random, 7), ny = 1 + qp_random_below(random, 7);
    const uint32_t first = builder_vertex_count(b);
    const double bend = 0.3 * qp_random_unit(random), saddle = 0.3 * qp_random_unit(random);
    for (uint32_t j = 0; j <= ny; ++j) {
        for (uint32_t i = 0; i <= nx; ++i) {
            const double x = i - 0.5 * nx, y = j - 0.5 * ny;
            builder_vertex(b, x, y, (bend * x * x + saddle * x * y) / (nx + ny));
        }
    }
    for (uint32_t j = 0; j < ny; ++j) {
        for (uint32_t i = 0; i < nx; ++i) {
            const uint32_t a = first + j * (nx + 1) + i;
            builder_quad(b, a, a + 1, a + nx + 2, a + nx + 1);
        }
    }
}

/* The mesh that edits start from: one component, seldom two. */
static qp_status make_seed(qp_random *random, bool open, qp_mesh **mesh, qp_error *err) {
    mesh_builder b = {.boundary = QP_BOUNDARY_EDGE_ONLY};
    const uint32_t components = qp_random_chance(random, 0.07) ? 2 : 1;
    for (uint32_t i = 0; i < components; ++i) {
        const uint32_t first = builder_vertex_count(&b);
        if (open && qp_random_chance(random, 0.4)) {
            add_grid(&b, random);
        } else if (qp_random_chance(random, 0.2)) {
            add_random_torus(&b, random);
        } else {
            add_lathe(&b, random, open);
        }
        for (uint32_t v = first; i > 0 && v < builder_vertex_count(&b); ++v) {
            double *p = builder_position(&b, v);
            if (p != NULL) p[0] += 4;
        }
    }
    return builder_finish(&b, mesh, err);
}

/* ---- Shape ---- */

/* Moves every interior vertex halfway to the mean of its faces' centers, every boundary vertex halfway to the
 * mean of its neighbours on the boundary. */
static bool relax(qp_mesh *m) {
    double *target = qp_alloc((size_t)m->n_vertices * 4, sizeof *target, true); /* sum and count */
    if (target == NULL) return false;
    for (uint32_t f = 0; f < m->n_faces; ++f) {
        double center[3];
        generate_face_center(m, f, center);
        for (uint32_t c = m->face_offsets[f]; c < m->face_offsets[f + 1]; ++c) {
            double *t = target + 4 * (size_t)m->face_vertices[c];
            if (m->vertex_flags[m->face_vertices[c]] & QP_VERTEX_BOUNDARY) continue;
            for (int k = 0; k < 3; ++k) t[k] += center[k];
            t[3] += 1;
        }
    }
    for (uint32_t e = 0; e < m->n_edges; ++e) {
        if (!(m->edge_flags[e] & QP_EDGE_BOUNDARY)) continue;
        for (int side = 0; side < 2; ++side) {
            double *t = target + 4 * (size_t)m->edge_vertices[2 * (size_t)e + (size_t)side];
            const double *p = m->positions + 3 * (size_t)m->edge_vertices[2 * (size_t)e + (size_t)(1 - side)];
            for (int k = 0; k < 3; ++k) t[k] += p[k];
            t[3] += 1;
        }
    }
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        const double *t = target + 4 * (size_t)v;
        double *p = m->positions + 3 * (size_t)v;
        for (int k = 0; k < 3; ++k) p[k] = 0.5 * p[k] + 0.5 * t[k] / t[3];
    }
    free(target);
    return true;
}

/* Shakes every vertex by a fraction of the length of its shortest edge. */
static bool shake(qp_mesh *m, qp_random *random, double fraction) {
    double *shortest = qp_alloc(m->n_vertices, sizeof *shortest, false);
    if (shortest == NULL) return false;
    for (uint32_t v = 0; v < m->n_vertices; ++v) shortest[v] = INFINITY;
    for (uint32_t e = 0; e < m->n_edges; ++e) {
        const uint32_t *v = m->edge_vertices + 2 * (size_t)e;
        double square = 0;
        for (int k = 0; k < 3; ++k) {
            const double d =
                m->positions[3 * (size_t)v[0] + (size_t)k] - m->positions[3 * (size_t)v[1] + (size_t)k];
            square += d * d;
        }
        const double length = sqrt(square);
        for (int side = 0; side < 2; ++side) {
            if (length < shortest[v[side]]) shortest[v[side]] = length;
        }
    }
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        /* A little is added however short the edge, so that coinciding vertices part. */
        const double amplitude = fraction * shortest[v] + 0.01;
        for (int k = 0; k < 3; ++k) {
            m->positions[3 * (size_t)v + (size_t)k] += amplitude * (2 * qp_random_unit(random) - 1);
        }
    }
    free(shortest);
    return true;
}

/* Centers the mesh and gives its longest side length 2; multiples of 2^-20. */
static void normalise(qp_mesh *m) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, side = 0;
    for (size_t i = 0; i < (size_t)m->n_vertices * 3; ++i) {
        if (m->positions[i] < low[i % 3]) low[i % 3] = m->positions[i];
        if (m->positions[i] > high[i % 3]) high[i % 3] = m->positions[i];
    }
    for (int k = 0; k < 3; ++k) side = high[k] - low[k] > side ? high[k] - low[k] : side;
    for (size_t i = 0; i < (size_t)m->n_vertices * 3; ++i) {
        const double x = (m->positions[i] - 0.5 * (low[i % 3] + high[i % 3])) * (side > 0 ? 2 / side : 1);
        m->positions[i] = floor(x * 0x1p20 + 0.5) * 0x1p-20;
    }
}

/* ---- All together ---- */

static void edit_at_random(qp_mesh **mesh, qp_random *random, bool open, uint32_t limit) {
    const uint32_t wanted = 1 + qp_random_below(random, limit);
    /* Edits are tried on small meshes; splitting all faces makes the large ones. */
    const uint32_t edit_limit = limit < 400 ? limit : 400;
    for (uint32_t tries = 20 + qp_random_below(random, 100); tries > 0; --tries) {
        if ((*mesh)->n_corners <= wanted && qp_random_chance(random, 0.03)) {
            generate_split_all(mesh, edit_limit);
        } else {
            generate_edit(mesh, random, open, edit_limit);
        }
    }
    while ((*mesh)->n_corners <= wanted && limit > 400) {
        if (!generate_split_all(mesh, limit)) return;
    }
}

static bool has_surface(const qp_mesh *m) {
    for (uint32_t f = 0; f < m->n_faces; ++f) {
        if (!(m->face_flags[f] & QP_FACE_HOLE)) return true;
    }
    return false;
}

/* The shape with random tags. Where they would leave no face at all, the boundary rule becomes edge-only. */
static qp_status add_tags(const qp_mesh *shape, qp_random random, qp_mesh **mesh, qp_error *err) {
    for (int attempt = 0;; ++attempt) {
        qp_random same = random;
        mesh_builder b = {0};
        generate_copy(&b, shape, NULL);
        generate_tags(&b, shape, &same);
        if (attempt > 0) b.boundary = QP_BOUNDARY_EDGE_ONLY;
        qp_status status = builder_finish(&b, mesh, err);
        if (status != QP_OK || has_surface(*mesh) || attempt > 0) return status;
        qp_mesh_free(*mesh);
    }
}

qp_status generate_random(const qp_generate_options *options, bool open, qp_mesh **mesh, qp_error *err) {
    const uint32_t limit = options->faces != 0 ? options->faces : 200;
    if (limit < 4 || limit > 2000000) {
        return qp_fail(err, QP_BAD_INPUT, "random meshes have from 4 to 2000000 faces, not %u", limit);
    }
    /* One stream of numbers a seed and kind; the first draw parts neighbouring seeds. */
    qp_random random = {options->seed * 2 + open};
    random.state = qp_random_bits(&random);
    qp_mesh *shape = NULL;
    do {
        qp_mesh_free(shape);
        qp_status status = make_seed(&random, open, &shape, err);
        if (status != QP_OK) return status;
    } while (shape->n_faces > limit);
    edit_at_random(&shape, &random, open, limit);
    bool good = true;
    for (uint32_t i = qp_random_below(&random, 4); i > 0; --i) good = good && relax(shape);
    good = good && shake(shape, &random, 0.25 * qp_random_unit(&random));
    normalise(shape);
    qp_status status = good ? add_tags(shape, random, mesh, err)
                            : qp_fail_memory(err, shape->n_vertices * 4 * sizeof(double), "a random mesh");
    qp_mesh_free(shape);
    return status;
}
