/* Error measures and sample sets: a stream made of the reference itself has no error, and known offsets come
 * out as they went in. */
#define _POSIX_C_SOURCE 200809L /* setenv */
#include "host/reference/reference.h"
#include "tests/check.h"
#include "tests/variants.h"

#include <string.h>

typedef struct made {
    qp_sample_set set;
    double *vertices;
    uint8_t *flags;
    qp_stream stream;
} made;

static void free_made(made *m) {
    qp_sample_set_free(&m->set);
    free(m->vertices);
    free(m->flags);
}

/* A double stream at the points of a set, from the reference. */
static bool make_stream(const qp_mesh *mesh, const char *kind, uint64_t count, made *m) {
    qp_error err = {0};
    memset(m, 0, sizeof *m);
    if (!CHECK_OK(qp_sample_set_make(mesh, kind, count, 7, &m->set, &err), err)) return false;
    m->vertices = qp_alloc(m->set.count, 6 * sizeof(double), true);
    m->flags = qp_alloc(m->set.count, 1, true);
    if (!CHECK(m->vertices && m->flags)) return false;
    for (uint64_t i = 0; i < m->set.count; ++i) {
        const double *uv = m->set.uv + 2 * i;
        qp_reference_sample s;
        if (!CHECK_OK(qp_reference_eval(mesh, mesh->positions, m->set.patch[i], 1, uv, &s, &err), err))
            return false;
        memcpy(m->vertices + 6 * i, s.p, sizeof s.p);
        memcpy(m->vertices + 6 * i + 3, s.n, sizeof s.n);
    }
    m->stream = (qp_stream){.precision = QP_DOUBLE,
                            .n_samples = m->set.count,
                            .vertices = m->vertices,
                            .flags = m->flags,
                            .sample_patch = m->set.patch};
    return true;
}

static void check_measures(const qp_mesh *mesh) {
    made m;
    qp_error_report r;
    qp_error err = {0};
    if (!make_stream(mesh, "random", 500, &m)) {
        free_made(&m);
        return;
    }
    CHECK_OK(qp_reference_compare(mesh, &m.stream, m.set.uv, &r, &err), err);
    CHECK(r.samples == 500 && r.past_depth == 0 && r.nonfinite == 0);
    CHECK_NEAR(r.position_max, 0, 1e-15);
    CHECK_NEAR(r.normal_max_deg, 0, 1e-9);

    /* One sample off by a tenth of the diagonal, one with its normal turned over, one not a number, one past
     * depth and far away. */
    m.vertices[6 * 10] += 0.1 * mesh->diagonal;
    for (int c = 3; c < 6; ++c) m.vertices[6 * 20 + c] *= -1;
    m.vertices[6 * 30 + 1] = NAN;
    m.flags[40] = QP_SAMPLE_PAST_DEPTH;
    m.vertices[6 * 40 + 2] += mesh->diagonal;
    memset(&m.vertices[6 * 50 + 3], 0, 3 * sizeof(double));
    CHECK_OK(qp_reference_compare(mesh, &m.stream, m.set.uv, &r, &err), err);
    CHECK(r.samples == 500 && r.past_depth == 1 && r.nonfinite == 1);
    CHECK_NEAR(r.position_max, 0.1, 1e-12);
    CHECK_NEAR(r.position_rms, 0.1 / sqrt(498), 1e-12);
    CHECK(r.worst_patch == m.set.patch[10] && r.worst_u == m.set.uv[20] && r.worst_v == m.set.uv[21]);
    CHECK_NEAR(r.past_position_max, 1, 1e-12);
    CHECK_NEAR(r.normal_max_deg, 180, 1e-9);
    CHECK_NEAR(r.normal_rms_deg, 180 * sqrt(2.0 / (498 - (double)r.normals_undefined)), 1e-6);

    qp_error_report again;
    setenv("QUADPLAN_THREADS", "1", 1);
    CHECK_OK(qp_reference_compare(mesh, &m.stream, m.set.uv, &again, &err), err);
    unsetenv("QUADPLAN_THREADS");
    CHECK(again.position_rms == r.position_rms && again.normal_rms_deg == r.normal_rms_deg);

    m.set.patch[3] = mesh->n_patches;
    CHECK(qp_reference_compare(mesh, &m.stream, m.set.uv, &r, &err) == QP_BAD_INPUT);
    m.set.patch[3] = 0;
    m.set.uv[6] = 2;
    CHECK(qp_reference_compare(mesh, &m.stream, m.set.uv, &r, &err) == QP_BAD_INPUT);
    free_made(&m);
}

/* Float streams are measured against the surface of positions rounded to float. */
static void check_float(const qp_mesh *mesh) {
    const uint32_t patch = 0;
    const float uv[2] = {0.25f, 0.75f};
    const uint8_t flag = 0;
    const double at[2] = {0.25, 0.75};
    double *rounded = qp_alloc(3 * (size_t)mesh->n_vertices, sizeof *rounded, false);
    qp_reference_sample s;
    qp_error err = {0};
    if (!CHECK(rounded != NULL)) return;
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; ++i) rounded[i] = (double)(float)mesh->positions[i];
    if (CHECK_OK(qp_reference_eval(mesh, rounded, patch, 1, at, &s, &err), err)) {
        float vertex[6];
        for (int c = 0; c < 3; ++c) {
            vertex[c] = (float)s.p[c];
            vertex[3 + c] = (float)s.n[c];
        }
        qp_stream stream = {
            .n_samples = 1, .vertices = vertex, .flags = &flag, .uv = uv, .sample_patch = &patch};
        qp_error_report r;
        double square = 0;
        for (int c = 0; c < 3; ++c) square += ((double)vertex[c] - s.p[c]) * ((double)vertex[c] - s.p[c]);
        CHECK_OK(qp_reference_compare(mesh, &stream, NULL, &r, &err), err);
        CHECK_NEAR(r.position_max, sqrt(square) / mesh->diagonal, 1e-15);
        CHECK_NEAR(r.normal_max_deg, 0, 1e-4);
    }
    free(rounded);
}

/* Every point is a multiple of 2^-24 on a patch with a surface; random ones visit each patch equally often. */
static void check_sets(const qp_mesh *mesh) {
    qp_sample_set set, same;
    qp_error err = {0};
    uint32_t *visits = qp_alloc(mesh->n_patches, sizeof *visits, true), n_patches = 0;
    if (!CHECK(visits != NULL)) return;
    for (uint32_t p = 0; p < mesh->n_patches; ++p)
        n_patches += !(mesh->face_flags[qp_patch_face(mesh, p, NULL)] & QP_FACE_HOLE);
    if (CHECK_OK(qp_sample_set_make(mesh, "random", 10 * n_patches, 1, &set, &err), err) &&
        CHECK_OK(qp_sample_set_make(mesh, "random", 10 * n_patches, 1, &same, &err), err)) {
        CHECK(set.count == 10 * n_patches);
        CHECK(memcmp(set.uv, same.uv, 2 * set.count * sizeof *set.uv) == 0);
        for (uint64_t i = 0; i < set.count; ++i) {
            visits[set.patch[i]]++;
            for (int c = 0; c < 2; ++c) {
                double x = set.uv[2 * i + c];
                CHECK(x >= 0 && x < 1 && x * 0x1p24 == floor(x * 0x1p24));
            }
        }
        for (uint32_t p = 0; p < mesh->n_patches; ++p)
            CHECK(visits[p] == (mesh->face_flags[qp_patch_face(mesh, p, NULL)] & QP_FACE_HOLE ? 0 : 10));
        qp_sample_set_free(&set);
        qp_sample_set_free(&same);
    }
    if (CHECK_OK(qp_sample_set_make(mesh, "corner", 0, 0, &set, &err), err)) {
        double least = 1;
        CHECK(set.count == (uint64_t)n_patches * 4 * (1 + 3 * 24));
        for (uint64_t i = 0; i < 2 * set.count; ++i)
            if (set.uv[i] > 0) least = fmin(least, set.uv[i]);
        CHECK(least == 0x1p-24);
        qp_sample_set_free(&set);
    }
    CHECK(qp_sample_set_make(mesh, "grid", 10, 0, &set, &err) == QP_BAD_INPUT);
    free(visits);
}

int main(void) {
    qp_generate_options options = {.seed = 5, .faces = 50, .sharpness = -1};
    qp_error err = {0};
    qp_mesh *mesh, *holes;
    if (CHECK_OK(qp_mesh_generate("random-closed", &options, &mesh, &err), err)) {
        check_measures(mesh);
        check_float(mesh);
        check_sets(mesh);
        qp_mesh_free(mesh);
    }
    /* Boundary faces are holes here. */
    if (CHECK_OK(qp_mesh_generate("random-open", &options, &mesh, &err), err)) {
        holes = variant_make(mesh, QP_BOUNDARY_NONE, QP_SHARPNESS_INFINITE, &err);
        if (CHECK(holes != NULL)) check_sets(holes);
        qp_mesh_free(holes);
        qp_mesh_free(mesh);
    }
    return check_report();
}
