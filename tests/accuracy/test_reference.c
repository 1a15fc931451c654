/* The reference against itself: limit masks against the surface arbitrarily close by, derivatives against
 * finite differences, and both sides of shared edges against each other, on random meshes under every rule. */
#include "host/base/random.h"
#include "host/reference/eval.h"
#include "tests/check.h"
#include "tests/variants.h"

#include <string.h>

enum { SEEDS = 3, FACES = 40 };

static qp_reference_work work;

static double distance(const double a[3], const double b[3]) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

static bool has_surface(const qp_mesh *mesh, uint32_t patch) {
    return !(mesh->face_flags[qp_patch_face(mesh, patch, NULL)] & QP_FACE_HOLE);
}

/* The masks at corner 0 must be where the surface goes: 2^-100 away (only about 0 does double have such
 * numbers; the faces are turned so that every vertex comes there) the ring is smaller than 1e-18. Normals
 * converge like a power of the ratio of eigenvalues, or like 1 / level at creases with four faces on a side,
 * so their error must shrink between levels 24 and 48. */
static void check_corners(const qp_mesh *mesh) {
    double worst = 0;
    unsigned long astray = 0;
    for (uint32_t p = 0; p < mesh->n_patches; ++p) {
        const double uv[8] = {0, 0, 0x1p-100, 0x1.8p-101, 0x1p-24, 0x1.8p-25, 0x1p-48, 0x1.8p-49};
        qp_reference_sample s[4];
        qp_error err = {0};
        if (!has_surface(mesh, p)) continue;
        if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, p, 4, uv, s, &err), err)) return;
        worst = fmax(worst, distance(s[0].p, s[1].p) / mesh->diagonal);
        if (!s[0].normal_defined || !s[2].normal_defined || !s[3].normal_defined) continue;
        astray += distance(s[0].n, s[3].n) > 0.85 * distance(s[0].n, s[2].n) + 1e-7;
    }
    CHECK_NEAR(worst, 0, 1e-14);
    CHECK_NEAR(astray, 0, 0);
}

/* Every vertex becomes the first of its faces once. */
static qp_mesh *rotate_faces(const qp_mesh *mesh, uint32_t by, qp_error *err) {
    qp_mesh *turned = variant_make(mesh, mesh->boundary + 3u * mesh->crease_method + 6u * mesh->triangle_rule,
                                   QP_SHARPNESS_INFINITE, err);
    if (!turned) return NULL;
    uint32_t *vertices = qp_alloc(mesh->n_corners, sizeof *vertices, false);
    uint32_t *sizes = qp_alloc(mesh->n_faces, sizeof *sizes, false);
    qp_mesh *made = NULL;
    if (vertices && sizes) {
        for (uint32_t f = 0; f < mesh->n_faces; ++f) {
            uint32_t first = mesh->face_offsets[f], n = sizes[f] = qp_face_size(mesh, f);
            for (uint32_t k = 0; k < n; ++k) vertices[first + k] = mesh->face_vertices[first + (k + by) % n];
        }
        memcpy(turned->face_vertices, vertices, mesh->n_corners * sizeof *vertices);
        made = variant_make(turned, mesh->boundary + 3u * mesh->crease_method + 6u * mesh->triangle_rule,
                            QP_SHARPNESS_INFINITE, err);
    }
    free(vertices);
    free(sizes);
    qp_mesh_free(turned);
    return made;
}

/* Fourth-order central differences; patches are piecewise cubic away from their corners, so these are exact
 * but for rounding wherever the five points lie in one piece. */
static void check_derivatives(const qp_mesh *mesh, qp_random *random) {
    const double h = 0x1p-12;
    double worst = 0;
    for (uint32_t p = 0; p < mesh->n_patches; ++p) {
        double u = 0.05 + 0.9 * qp_random_unit(random), v = 0.05 + 0.9 * qp_random_unit(random);
        double uv[18] = {u, v, u - 2 * h, v, u - h, v, u + h, v, u + 2 * h,
                         v, u, v - 2 * h, u, v - h, u, v + h, u, v + 2 * h};
        qp_reference_sample s[9];
        qp_error err = {0};
        if (!has_surface(mesh, p)) continue;
        if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, p, 9, uv, s, &err), err)) return;
        for (int c = 0; c < 3; ++c) {
            double du = (s[1].p[c] - 8 * s[2].p[c] + 8 * s[3].p[c] - s[4].p[c]) / (12 * h);
            double dv = (s[5].p[c] - 8 * s[6].p[c] + 8 * s[7].p[c] - s[8].p[c]) / (12 * h);
            worst = fmax(worst, fmax(fabs(du - s[0].du[c]), fabs(dv - s[0].dv[c])) / mesh->diagonal);
        }
    }
    CHECK_NEAR(worst, 0, 1e-6);
}

/* Where the point at t along the half-edge of a corner lies, t in [0, 1] from the corner's vertex. */
static uint32_t edge_point(const qp_mesh *mesh, uint32_t corner, double t, double uv[2]) {
    static const double from[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    uint32_t face = mesh->corner_face[corner], j = corner - mesh->face_offsets[face];
    uint32_t n = qp_face_size(mesh, face), first = mesh->patch_offsets[face];
    if (n == 4) {
        for (int c = 0; c < 2; ++c) uv[c] = from[j][c] + t * (from[(j + 1) % 4][c] - from[j][c]);
        return first;
    }
    uv[0] = t <= 0.5 ? 2 * t : 0;
    uv[1] = t <= 0.5 ? 0 : 2 * (1 - t);
    return first + (t <= 0.5 ? j : (j + 1) % n);
}

/* Both sides of an edge meet, with one normal unless it is sharp. */
static void check_edges(const qp_mesh *mesh, qp_random *random) {
    double worst = 0, worst_normal = 0;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        uint32_t twin = mesh->corner_twin[h];
        if (twin == QP_NONE || twin < h) continue;
        double t = h % 4 ? qp_random_below(random, 1u << 20) * 0x1p-20 : 0, a[2], b[2];
        uint32_t p = edge_point(mesh, h, t, a), q = edge_point(mesh, twin, 1 - t, b);
        qp_reference_sample s[2];
        qp_error err = {0};
        if (!has_surface(mesh, p) || !has_surface(mesh, q)) continue;
        if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, p, 1, a, &s[0], &err), err))
            return;
        if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, q, 1, b, &s[1], &err), err))
            return;
        worst = fmax(worst, distance(s[0].p, s[1].p) / mesh->diagonal);
        if (mesh->edge_sharpness[mesh->corner_edge[h]] >= QP_SHARPNESS_INFINITE) continue;
        if (s[0].normal_defined && s[1].normal_defined)
            worst_normal = fmax(worst_normal, distance(s[0].n, s[1].n));
    }
    CHECK_NEAR(worst, 0, 1e-15);
    CHECK_NEAR(worst_normal, 0, 1e-9);
}

static void check_mesh(const qp_mesh *mesh, uint32_t turn, qp_random *random) {
    qp_error err = {0};
    check_derivatives(mesh, random);
    check_edges(mesh, random);
    qp_mesh *turned = rotate_faces(mesh, turn, &err);
    if (CHECK(turned != NULL)) check_corners(turned);
    qp_mesh_free(turned);
}

/* Known limits: the masks of vertices whose rings are given. */
static void check_valence_two(void) {
    /* Two quads back to back: every vertex is interior, smooth and of valence 2. */
    const double positions[12] = {0, 0, 0, 1, 0, 0.5, 1, 1, 0, 0, 1, 0.25};
    const uint32_t sizes[2] = {4, 4}, vertices[8] = {0, 1, 2, 3, 0, 3, 2, 1};
    qp_mesh_desc d = {.n_vertices = 4,
                      .n_faces = 2,
                      .positions = positions,
                      .face_sizes = sizes,
                      .face_vertices = vertices,
                      .boundary = QP_BOUNDARY_EDGE_ONLY};
    qp_mesh *mesh;
    qp_error err = {0};
    qp_reference_sample s;
    const double uv[2] = {0, 0};
    if (!CHECK_OK(qp_mesh_create(&d, &mesh, &err), err)) return;
    if (CHECK_OK(qp_reference_eval(mesh, positions, 0, 1, uv, &s, &err), err)) {
        for (int c = 0; c < 3; ++c)
            CHECK_NEAR(s.p[c],
                       (4 * positions[c] + 4 * (positions[3 + c] + positions[9 + c]) + 2 * positions[6 + c]) /
                           14,
                       1e-16);
        CHECK(!s.normal_defined);
    }
    qp_mesh_free(mesh);
}

static void check_refusals(void) {
    qp_generate_options options = {.sharpness = -1};
    qp_mesh *mesh;
    qp_error err = {0};
    qp_reference_sample s;
    if (!CHECK_OK(qp_mesh_generate("cube", &options, &mesh, &err), err)) return;
    const double outside[2] = {0.5, 1.5}, nan[2] = {NAN, 0}, inside[2] = {0.5, 0.5};
    CHECK(qp_reference_eval_with(&work, mesh, mesh->positions, 0, 1, outside, &s, &err) == QP_BAD_INPUT);
    CHECK(qp_reference_eval_with(&work, mesh, mesh->positions, 0, 1, nan, &s, &err) == QP_BAD_INPUT);
    CHECK(qp_reference_eval_with(&work, mesh, mesh->positions, mesh->n_patches, 1, inside, &s, &err) ==
          QP_BAD_INPUT);
    CHECK(qp_reference_eval_with(&work, mesh, mesh->positions, 0, 0, inside, &s, &err) == QP_OK);
    qp_mesh_free(mesh);
}

int main(void) {
    for (uint64_t seed = 0; seed < SEEDS; ++seed)
        for (int open = 0; open < 2; ++open) {
            qp_generate_options options = {.seed = seed, .faces = FACES, .sharpness = -1};
            qp_random random = {seed};
            qp_mesh *base;
            qp_error err = {0};
            if (!CHECK_OK(qp_mesh_generate(open ? "random-open" : "random-closed", &options, &base, &err),
                          err))
                continue;
            for (unsigned rules = 0; rules < VARIANT_RULES; ++rules) {
                qp_mesh *mesh = variant_make(base, rules, QP_SHARPNESS_INFINITE, &err);
                if (CHECK(mesh != NULL)) check_mesh(mesh, (rules + (uint32_t)seed) % 4, &random);
                qp_mesh_free(mesh);
            }
            qp_mesh_free(base);
        }
    check_valence_two();
    check_refusals();
    qp_reference_work_free(&work);
    return check_report();
}
