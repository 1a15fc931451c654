/* Adjacency invariants on every generated mesh and model, and the counts that the paper's table needs. */
#include "tests/unit/mesh_files.h"

static void check_corners(const qp_mesh *m) {
    for (uint32_t h = 0; h < m->n_corners; ++h) {
        const uint32_t next = qp_corner_next(m, h), twin = m->corner_twin[h], e = m->corner_edge[h];
        const uint32_t a = m->face_vertices[h], b = m->face_vertices[next];
        CHECK(qp_corner_prev(m, next) == h);
        CHECK(m->corner_face[h] < m->n_faces && m->face_offsets[m->corner_face[h]] <= h &&
              h < m->face_offsets[m->corner_face[h] + 1]);
        CHECK(a != b && m->edge_vertices[2 * e] == (a < b ? a : b) &&
              m->edge_vertices[2 * e + 1] == (a < b ? b : a));
        if (twin == QP_NONE) {
            CHECK(m->edge_flags[e] != 0);
        } else {
            CHECK(m->edge_flags[e] == 0 && m->corner_twin[twin] == h && m->corner_edge[twin] == e);
            CHECK(m->face_vertices[twin] == b && m->face_vertices[qp_corner_next(m, twin)] == a);
        }
    }
}

static void check_edges(const qp_mesh *m) {
    uint64_t faces = 0;
    for (uint32_t e = 0; e < m->n_edges; ++e) {
        faces += m->edge_face_count[e];
        CHECK(m->edge_vertices[2 * e] < m->edge_vertices[2 * e + 1]);
        CHECK(m->edge_sharpness[e] >= 0 && m->edge_sharpness[e] <= QP_SHARPNESS_INFINITE);
        CHECK(((m->edge_flags[e] & QP_EDGE_BOUNDARY) != 0) == (m->edge_face_count[e] == 1));
        if (m->edge_flags[e] != 0) CHECK(m->edge_sharpness[e] == QP_SHARPNESS_INFINITE);
        if (m->edge_flags[e] == 0) CHECK(m->edge_face_count[e] == 2);
    }
    CHECK(faces == m->n_corners);
}

static void check_vertices(const qp_mesh *m) {
    CHECK(m->vertex_offsets[0] == 0 && m->vertex_offsets[m->n_vertices] == m->n_corners);
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        for (uint32_t i = m->vertex_offsets[v]; i < m->vertex_offsets[v + 1]; ++i) {
            CHECK(m->face_vertices[m->vertex_corners[i]] == v);
            CHECK(i == m->vertex_offsets[v] || m->vertex_corners[i - 1] < m->vertex_corners[i]);
        }
    }
}

static void check_patches(const qp_mesh *m) {
    uint32_t child, patches = 0;
    for (uint32_t f = 0; f < m->n_faces; ++f) {
        const uint32_t count = qp_face_size(m, f) == 4 ? 1 : qp_face_size(m, f);
        CHECK(m->patch_offsets[f] == patches);
        CHECK(qp_patch_face(m, patches, &child) == f && child == 0);
        CHECK(qp_patch_face(m, patches + count - 1, &child) == f && child == count - 1);
        patches += count;
    }
    CHECK(qp_mesh_patch_count(m) == patches && m->patch_offsets[m->n_faces] == patches);
}

/* Two meshes with the same arrays. */
static void check_same(const qp_mesh *a, const qp_mesh *b) {
    CHECK(a->n_vertices == b->n_vertices && a->n_faces == b->n_faces && a->n_corners == b->n_corners &&
          a->n_edges == b->n_edges && a->n_creases == b->n_creases && a->n_corner_tags == b->n_corner_tags &&
          a->n_hole_tags == b->n_hole_tags);
    if (a->n_vertices != b->n_vertices || a->n_corners != b->n_corners || a->n_edges != b->n_edges) return;
    CHECK(memcmp(a->positions, b->positions, 3 * a->n_vertices * sizeof(double)) == 0);
    CHECK(memcmp(a->face_vertices, b->face_vertices, a->n_corners * sizeof(uint32_t)) == 0);
    CHECK(memcmp(a->edge_sharpness, b->edge_sharpness, a->n_edges * sizeof(float)) == 0);
    CHECK(memcmp(a->vertex_sharpness, b->vertex_sharpness, a->n_vertices * sizeof(float)) == 0);
    CHECK(memcmp(a->face_flags, b->face_flags, a->n_faces) == 0);
    CHECK(a->boundary == b->boundary && a->crease_method == b->crease_method &&
          a->triangle_rule == b->triangle_rule && a->fvar_boundary == b->fvar_boundary);
    CHECK((a->corner_texcoords != NULL) == (b->corner_texcoords != NULL) && a->n_texcoords == b->n_texcoords);
    if (a->corner_texcoords != NULL && b->corner_texcoords != NULL && a->n_texcoords == b->n_texcoords) {
        CHECK(memcmp(a->corner_texcoords, b->corner_texcoords, a->n_corners * sizeof(uint32_t)) == 0);
        CHECK(memcmp(a->texcoords, b->texcoords, 2 * a->n_texcoords * sizeof(double)) == 0);
    }
}

static void check_round_trip(const qp_mesh *m) {
    char path[64];
    snprintf(path, sizeof path, "mesh_round_trip_%ld.obj", (long)m->n_corners);
    qp_mesh *back;
    qp_error err;
    if (!CHECK_OK(qp_mesh_write_obj(m, path, &err), err)) return;
    if (CHECK_OK(qp_mesh_read_obj(path, NULL, &back, &err), err)) {
        check_same(m, back);
        qp_mesh_free(back);
    }
    remove(path);
}

static void visit(const char *name, qp_mesh *m) {
    const unsigned long before = check_failures;
    check_corners(m);
    check_edges(m);
    check_vertices(m);
    check_patches(m);
    check_round_trip(m);
    if (check_failures != before) fprintf(stderr, "    on %s\n", name);
}

static void check_manifold(const char *name, qp_mesh *m) {
    const bool closed = strncmp(name, "random-closed", 13) == 0;
    if (strncmp(name, "random", 6) != 0) return;
    bool surface = false;
    CHECK(m->n_faces <= 200);
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        CHECK((m->vertex_flags[v] & ~(closed ? 0 : QP_VERTEX_BOUNDARY)) == 0);
    }
    for (uint32_t f = 0; f < m->n_faces; ++f) surface = surface || m->face_flags[f] == 0;
    CHECK(surface);
    for (uint32_t i = 0; i < m->n_creases; ++i) {
        const float s = m->crease_sharpness[i];
        CHECK(s == QP_SHARPNESS_INFINITE || (s > 0 && s < 6 && s * 16 == floorf(s * 16)));
    }
}

static uint32_t regular_faces(const qp_mesh *m) {
    uint32_t count = 0;
    for (uint32_t f = 0; f < m->n_faces; ++f) count += qp_face_is_regular(m, f);
    return count;
}

/* Faces and regular faces as DESIGN.md's table has them. */
static void check_table(const char *name, qp_mesh *m) {
    if (strcmp(name, "bigguy.obj") == 0) CHECK(m->n_faces == 1450 && regular_faces(m) == 858);
    if (strcmp(name, "monsterfrog.obj") == 0) CHECK(m->n_faces == 1292 && regular_faces(m) == 528);
    if (strcmp(name, "armorguy.obj") == 0) {
        CHECK(m->n_faces == 8639 && regular_faces(m) == 962 && m->n_creases == 7101);
        CHECK(m->corner_texcoords != NULL);
    }
}

/* What the fixed kinds promise. */
static void check_kinds(void) {
    qp_mesh *m;
    qp_error err;
    for (uint32_t n = 2; n <= 2000; n = n < 12 ? n + 1 : n * 3) {
        qp_generate_options options = {.n = {n, 2}};
        if (!CHECK_OK(qp_mesh_generate("fan", &options, &m, &err), err)) continue;
        CHECK(m->vertex_offsets[1] - m->vertex_offsets[0] == n && m->vertex_flags[0] == 0 &&
              m->n_faces == 4 * n);
        qp_mesh_free(m);
    }
    if (CHECK_OK(qp_mesh_generate("cubes", NULL, &m, &err), err)) {
        CHECK(m->n_faces == 12 * 12 * 10 * 6 && m->n_vertices == 12 * 12 * 10 * 8);
        qp_mesh_free(m);
    }
    if (CHECK_OK(qp_mesh_generate("creased-torus", NULL, &m, &err), err)) {
        CHECK(m->n_creases == 24 && m->crease_sharpness[0] == 4.7f);
        qp_mesh_free(m);
    }
    if (CHECK_OK(qp_mesh_generate("torus", NULL, &m, &err), err)) {
        CHECK(regular_faces(m) == m->n_faces);
        qp_mesh_free(m);
    }
    /* Cubes face outwards: the signed volume of 27 unit cells is positive. */
    qp_generate_options three = {.n = {3}};
    if (CHECK_OK(qp_mesh_generate("cube", &three, &m, &err), err)) {
        double volume = 0;
        for (uint32_t f = 0; f < m->n_faces; ++f) {
            const uint32_t *v = m->face_vertices + m->face_offsets[f];
            for (int k = 1; k < 3; ++k) {
                const double *a = m->positions + 3 * v[0], *b = m->positions + 3 * v[k],
                             *c = m->positions + 3 * v[k + 1];
                volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                           a[2] * (b[0] * c[1] - b[1] * c[0])) /
                          6;
            }
        }
        CHECK_NEAR(volume, 8, 1e-12);
        qp_mesh_free(m);
    }
    CHECK(qp_mesh_generate("sphere", NULL, &m, &err) == QP_BAD_INPUT &&
          strstr(err.message, "sphere") != NULL);
    qp_generate_options large = {.n = {2000000000}};
    CHECK(qp_mesh_generate("torus", &large, &m, &err) == QP_BAD_INPUT);
    qp_generate_options sharp = {.sharpness = NAN};
    CHECK(qp_mesh_generate("creased-torus", &sharp, &m, &err) == QP_BAD_INPUT);
}

/* A seed is a promise across machines and versions: the bits of two random meshes. */
static void check_seeds(void) {
    static const struct {
        const char *kind;
        uint64_t seed, hash;
    } known[] = {{"random-closed", 1, UINT64_C(0x9ad1e5fbc0ab276d)},
                 {"random-open", 2, UINT64_C(0x91cd070e267331aa)},
                 {"terrain", 3, UINT64_C(0xa866903065169258)}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i) {
        qp_generate_options options = {.seed = known[i].seed};
        qp_mesh *m;
        qp_error err;
        if (!CHECK_OK(qp_mesh_generate(known[i].kind, &options, &m, &err), err)) continue;
        uint64_t hash = qp_hash(m->positions, 3 * m->n_vertices * sizeof(double), 1);
        hash = qp_hash(m->face_vertices, m->n_corners * sizeof(uint32_t), hash);
        hash = qp_hash(m->crease_sharpness, m->n_creases * sizeof(float), hash);
        if (!CHECK(hash == known[i].hash)) {
            fprintf(stderr, "    %s %llu: 0x%llx\n", known[i].kind, (unsigned long long)known[i].seed,
                    (unsigned long long)hash);
        }
        qp_mesh_free(m);
    }
}

int main(void) {
    check_kinds();
    check_seeds();
    visit_generated(visit, 100);
    visit_generated(check_manifold, 500);
    visit_models(visit);
    visit_models(check_table);
    return check_report();
}
