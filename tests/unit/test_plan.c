/* Plans: configurations and their keys, rotations, row sums, levels, crease and terminal nodes, counts of the paper. */
#include "host/plan/config.h"
#include "host/plan/plan.h"
#include "tests/check.h"

#include <string.h>

static qp_mesh *generate(const char *kind, uint32_t n0, uint32_t n1, double sharpness, uint64_t seed) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_generate_options options = {.n = {n0, n1, 0}, .sharpness = sharpness, .seed = seed, .faces = 200};
    CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err);
    return mesh;
}

static qp_surface *build(const qp_mesh *mesh, uint32_t depth, int no_crease, int no_terminal) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    qp_surface_options options = {
        .depth = depth, .no_crease_nodes = no_crease, .no_terminal_nodes = no_terminal};
    CHECK_OK(qp_surface_create(mesh, &options, &surface, &err), err);
    return surface;
}

static double row_sum(const qp_plan *plan, uint32_t i) {
    double sum = 0.0;
    for (uint32_t j = 0; j < plan->ring_size; ++j) sum += plan->weights[(size_t)i * plan->ring_size + j];
    return sum;
}

/* Positions are affine combinations (sum 1), offsets and tangents linear ones (sum 0); rows are sorted by level. */
static void check_rows(const qp_plan *plan) {
    for (uint32_t i = 0; i < plan->point_count; ++i) {
        bool offset = plan->point_origins[i] != QP_NO_POINT;
        bool tangent = (plan->point_kinds[i] & 3u) >= 2; /* or a mode */
        CHECK_NEAR(row_sum(plan, i), offset || tangent ? 0.0 : 1.0, 2e-12);
    }
    for (uint32_t n = 1; n < QP_LEVELS; ++n) CHECK(plan->rows[n] >= plan->rows[n - 1]);
    CHECK(plan->rows[QP_LEVELS - 1] == plan->point_count);
}

/* Every offset in a tree stays in it, and every point exists; counts the nodes that can be reached. */
static uint32_t walk(const qp_plan *plan, uint32_t node, uint32_t depth) {
    if (!CHECK(node < plan->tree_words && depth < 20)) return 0;
    const uint32_t *w = plan->tree + node;
    uint32_t kind = QP_NODE_KIND(w[0]), first = 0, count = 0;
    switch (kind) {
    case QP_NODE_INTERNAL: {
        uint32_t nodes = 1;
        for (uint32_t k = 1; k <= 4; ++k) nodes += walk(plan, w[k], depth + 1);
        return nodes;
    }
    case QP_NODE_REGULAR:
        first = 2, count = 16;
        break;
    case QP_NODE_CREASE:
        first = 2, count = 16;
        break;
    case QP_NODE_TERMINAL:
        first = 3, count = 24 * QP_NODE_RINGS(w[0]);
        break;
    case QP_NODE_EXTRAORDINARY:
        for (uint32_t k = 1; k < 4; ++k) CHECK(w[k] < plan->point_count || w[k] == QP_NO_POINT);
        break;
    case QP_NODE_IRREGULAR:
        first = 1, count = 12;
        break;
    default:
        CHECK(!"a node of no kind");
        break;
    }
    for (uint32_t k = 0; k < count; ++k) {
        uint32_t point = w[first + k / 2] >> (k % 2 * 16) & 0xffffu;
        CHECK(point < plan->point_count || (kind == QP_NODE_IRREGULAR && point == QP_NO_POINT));
    }
    return 1 + (kind == QP_NODE_TERMINAL ? walk(plan, w[2], depth + QP_NODE_RINGS(w[0])) : 0);
}

static void check_random_meshes(void) {
    for (uint64_t seed = 0; seed < 60; ++seed) {
        qp_mesh *mesh = generate(seed % 2 ? "random-open" : "random-closed", 0, 0, -1.0, seed);
        if (mesh == NULL) continue;
        qp_surface *surface = build(mesh, 5, seed % 3 == 1, seed % 5 == 1);
        for (uint32_t p = 0; surface != NULL && p < surface->n_plans; ++p) {
            check_rows(surface->plans[p]);
            CHECK(walk(surface->plans[p], 0, 0) == surface->plans[p]->node_count);
        }
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
}

/* One isolated extraordinary vertex: 24 points a ring (23 for valence 3) and 3 limit stencils, by the level rule of
 * section 4.2: 24 24 48 72 ... A fan's other corners are those of its neighbours' rings. */
static void check_isolated_vertex(void) {
    for (uint32_t valence = 3; valence <= 12; ++valence) {
        if (valence == 4) continue;
        qp_mesh *mesh = generate("fan", valence, 0, -1.0, 0);
        if (mesh == NULL) continue;
        qp_surface *surface = build(mesh, 6, 0, 0);
        uint32_t ring = valence == 3 ? 23 : 24;
        bool found = false;
        for (uint32_t p = 0; surface != NULL && p < surface->n_plans && !found; ++p) {
            const qp_plan *plan = surface->plans[p];
            found = QP_NODE_KIND(plan->tree[0]) == QP_NODE_TERMINAL && plan->rows[0] == ring + 3;
            for (uint32_t n = 1; found && n <= 6; ++n) CHECK(plan->rows[n] == ring * n + 3);
        }
        CHECK(found);
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
}

/* Rotations of one configuration share a plan, whatever the order of faces and vertices: a cube has one plan for its six faces,
 * with each face's vertices starting anywhere. */
static void check_rotations(void) {
    qp_mesh *cube = generate("cube", 0, 0, -1.0, 0);
    if (cube == NULL) return;
    uint32_t sizes[6], vertices[24];
    for (uint32_t turn = 0; turn < 4; ++turn) {
        for (uint32_t f = 0; f < 6; ++f) {
            sizes[f] = 4;
            for (uint32_t k = 0; k < 4; ++k)
                vertices[4 * f + k] = cube->face_vertices[4 * f + (k + turn * f) % 4];
        }
        qp_mesh_desc desc = {.n_vertices = 8,
                             .n_faces = 6,
                             .positions = cube->positions,
                             .face_sizes = sizes,
                             .face_vertices = vertices,
                             .boundary = QP_BOUNDARY_EDGE_ONLY};
        qp_mesh *turned = NULL;
        qp_error err = {0};
        if (!CHECK_OK(qp_mesh_create(&desc, &turned, &err), err)) continue;
        qp_surface *surface = build(turned, 6, 0, 0);
        CHECK(surface != NULL && surface->n_plans == 1);
        qp_surface_free(surface);
        qp_mesh_free(turned);
    }
    qp_mesh_free(cube);
}

/* The key must tell apart what the surface depends on: one changed sharpness (of any edge or vertex that touches the face), rule or
 * valence gives another key, though only a hash finds candidates. */
static bool key_of(const qp_mesh *mesh, uint32_t face, uint32_t **key, uint32_t *words) {
    qp_gather gather = {0};
    bool good = qp_gather_face(&gather, mesh, face) &&
                qp_gather_key(&gather, mesh, qp_gather_canonical(&gather), qp_face_size(mesh, face) != 4);
    *words = gather.key_words;
    *key = gather.key;
    gather.key = NULL;
    qp_gather_free(&gather);
    return good;
}

static void check_keys_differ(const qp_mesh *a, const qp_mesh *b, uint32_t face, bool differ) {
    uint32_t *ka = NULL, *kb = NULL, na, nb;
    if (CHECK(key_of(a, face, &ka, &na) && key_of(b, face, &kb, &nb))) {
        CHECK((na != nb || memcmp(ka, kb, na * sizeof *ka) != 0) == differ);
    }
    free(ka);
    free(kb);
}

static qp_mesh *tagged_grid(uint32_t a, uint32_t b, float sharpness, uint32_t corner, float corner_sharpness,
                            qp_crease_method method) {
    double positions[36 * 3];
    uint32_t sizes[25], vertices[100], n = 0;
    for (uint32_t i = 0; i < 36; ++i) {
        positions[3 * i] = i % 6;
        positions[3 * i + 1] = i / 6;
        positions[3 * i + 2] = 0.0;
    }
    for (uint32_t y = 0; y < 5; ++y) {
        for (uint32_t x = 0; x < 5; ++x, ++n) {
            uint32_t v = 6 * y + x, quad[4] = {v, v + 1, v + 7, v + 6};
            sizes[n] = 4;
            memcpy(vertices + 4 * n, quad, sizeof quad);
        }
    }
    uint32_t ends[4] = {a, b, 8, 14};
    float sharp[2] = {sharpness, 2.5f};
    qp_mesh_desc desc = {.n_vertices = 36,
                         .n_faces = 25,
                         .positions = positions,
                         .face_sizes = sizes,
                         .face_vertices = vertices,
                         .n_creases = 2,
                         .crease_vertices = ends,
                         .crease_sharpness = sharp,
                         .n_corners = 1,
                         .corner_vertices = &corner,
                         .corner_sharpness = &corner_sharpness,
                         .boundary = QP_BOUNDARY_EDGE_ONLY,
                         .crease_method = method};
    qp_mesh *mesh = NULL;
    qp_error err = {0};
    CHECK_OK(qp_mesh_create(&desc, &mesh, &err), err);
    return mesh;
}

static void check_keys(void) {
    /* Face 12 is the middle one, vertices 14 15 21 20; edge 8-14 touches it, 2-8 does not. */
    qp_mesh *plain = tagged_grid(14, 15, 1.5f, 15, 0.0f, QP_CREASE_UNIFORM);
    struct {
        uint32_t a, b;
        float sharpness;
        uint32_t corner;
        float corner_sharpness;
        qp_crease_method method;
        bool differ;
    } cases[] = {{14, 15, 1.5f, 15, 0.0f, QP_CREASE_UNIFORM, false},
                 {14, 15, 1.5000001f, 15, 0.0f, QP_CREASE_UNIFORM, true},
                 {14, 15, 1.5f, 15, 0.25f, QP_CREASE_UNIFORM, true},
                 {14, 15, 1.5f, 20, 0.25f, QP_CREASE_UNIFORM, true},
                 {14, 15, 1.5f, 8, 3.0f, QP_CREASE_UNIFORM, false}, /* a ring vertex: no matter */
                 {14, 15, 1.5f, 15, 0.0f, QP_CREASE_CHAIKIN, true},
                 {15, 16, 1.5f, 15, 0.0f, QP_CREASE_UNIFORM, true},
                 {14, 20, 1.5f, 15, 0.0f, QP_CREASE_UNIFORM, true}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        qp_mesh *other = tagged_grid(cases[k].a, cases[k].b, cases[k].sharpness, cases[k].corner,
                                     cases[k].corner_sharpness, cases[k].method);
        if (plain != NULL && other != NULL) check_keys_differ(plain, other, 12, cases[k].differ);
        qp_mesh_free(other);
    }
    qp_mesh_free(plain);
}

/* Crease nodes replace the chain of cells along a straight crease by one leaf, terminal nodes hold three sub-domains each. */
static void check_node_kinds(void) {
    qp_mesh *torus = generate("creased-torus", 0, 0, 4.7, 0);
    if (torus == NULL) return;
    qp_surface *with = build(torus, 6, 0, 0), *without = build(torus, 6, 1, 0);
    qp_surface_info a = {0}, b = {0};
    qp_error err = {0};
    if (with != NULL && without != NULL && CHECK_OK(qp_surface_get_info(with, &a, &err), err) &&
        CHECK_OK(qp_surface_get_info(without, &b, &err), err)) {
        printf("creased torus, sharpness 4.7: %llu stencils without crease nodes, %llu with\n",
               (unsigned long long)b.stencils, (unsigned long long)a.stencils);
        CHECK(a.stencils * 6 <= b.stencils);
        CHECK(a.plans == 2 && b.plans == 2);
    }
    qp_surface_free(with);
    qp_surface_free(without);
    qp_mesh_free(torus);
}

/* A regular mesh costs one plan, whatever its size. */
static void check_regular(void) {
    qp_mesh *torus = generate("torus", 200, 100, -1.0, 0);
    if (torus == NULL) return;
    qp_surface *surface = build(torus, 6, 0, 0);
    if (CHECK(surface != NULL)) {
        CHECK(surface->n_plans == 1 && surface->regular_plan == 0);
        CHECK(surface->ring_entries == 16ull * torus->n_faces);
    }
    qp_surface_free(surface);
    qp_mesh_free(torus);
}

/* Table 2 and section 9 of the paper, on the files whose cages are the paper's own (docs/paper-numbers.md). */
static void check_paper(const char *folder) {
    static const struct {
        const char *file;
        uint64_t regular, irregular, irregular_patches, plans, points, unique;
    } models[] = {{"bigguy.obj", 858, 592, 592, 19, 105648, 50373},
                  {"monsterfrog.obj", 528, 764, 764, 34, 145688, 0},
                  {"armorguy.obj", 962, 7677, 8409, 0, 0, 0}};
    for (size_t m = 0; m < sizeof models / sizeof *models; ++m) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, models[m].file);
        qp_mesh *mesh = NULL;
        qp_error err = {0};
        if (!CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err)) continue;
        qp_surface *surface = build(mesh, 6, 0, 0);
        qp_surface_info info;
        if (surface != NULL && CHECK_OK(qp_surface_get_info(surface, &info, &err), err)) {
            CHECK(info.regular_faces == models[m].regular);
            CHECK(info.irregular_faces == models[m].irregular);
            CHECK(info.irregular_patches == models[m].irregular_patches);
            CHECK(models[m].plans == 0 || info.plans == models[m].plans);
            CHECK(models[m].points == 0 || info.control_points[6] == models[m].points);
            CHECK(models[m].unique == 0 || info.unique_control_points[6] == models[m].unique);
        }
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
}

int main(void) {
    check_random_meshes();
    check_isolated_vertex();
    check_rotations();
    check_keys();
    check_node_kinds();
    check_regular();
    if (check_models() != NULL) {
        check_paper(check_models());
    } else {
        printf("skipped: QUADPLAN_MODELS not set (counts of the paper)\n");
    }
    return check_report();
}
