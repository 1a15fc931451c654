/* The peers of `bench error-time` against the reference: each evaluates the same surface at the same points, children
 * of n-gons, creases and corners included, so that what the benchmark calls their error is theirs. Errors are printed;
 * what is checked is that they fall to what a peer's method and precision allow once its level is high enough. */
#include "host/base/module.h"
#include "host/peer/peer.h"
#include "host/reference/eval.h"
#include "tests/check.h"

#include <string.h>

enum { EACH = 6, MOST_LEVEL = 10 };
static qp_reference_work work;

typedef struct problem {
    qp_peer_task task;
    qp_reference_sample *samples;
} problem;

/* Points of every patch, at least 1/64 off its borders: below a peer's highest level no end caps are left there. */
static int make_problem(const qp_mesh *mesh, problem *made) {
    const uint64_t most = (uint64_t)mesh->n_patches * EACH;
    uint32_t *patch = qp_alloc(most, sizeof *patch, false);
    float *uv = qp_alloc(most, 2 * sizeof *uv, false);
    made->samples = qp_alloc(most, sizeof *made->samples, false);
    void *out = aligned_alloc(64, QP_PEER_OUT_BYTES(most));
    if (!CHECK(patch && uv && made->samples && out)) return 0;
    uint64_t count = 0;
    qp_error err = {0};
    for (uint32_t p = 0; p < mesh->n_patches; ++p) {
        double at[2 * EACH];
        if (mesh->face_flags[qp_patch_face(mesh, p, NULL)] & QP_FACE_HOLE) continue;
        for (uint64_t i = 0; i < EACH; ++i) {
            const double k = (double)(p * EACH + i + 1), step[2] = {0.7548776662466927, 0.5698402909980532};
            for (uint64_t c = 0; c < 2; ++c) {
                const double x = (1 + 62 * fmod(0.5 + k * step[c], 1)) / 64;
                at[2 * i + c] = (2 * floor(x * (0.5 / QP_PEER_GRID)) + 1) * QP_PEER_GRID;
                uv[2 * (count + i) + c] = (float)at[2 * i + c];
            }
            patch[count + i] = p;
        }
        if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, p, EACH, at, made->samples + count,
                                             &err),
                      err))
            return 0;
        count += EACH;
    }
    made->task = (qp_peer_task){mesh, count, patch, uv, 2, out};
    return 1;
}

static void free_problem(problem *p) {
    free((void *)p->task.patch);
    free((void *)p->task.uv);
    free(p->task.out);
    free(p->samples);
}

static double angle(const double a[3], const double b[3]) {
    double cross[3], dot = 0, square = 0;
    for (int c = 0; c < 3; ++c) {
        cross[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
        dot += a[c] * b[c];
        square += cross[c] * cross[c];
    }
    return atan2(sqrt(square), dot) * 57.29577951308232;
}

/* Largest errors of what the peer last evaluated. */
static void measure(const problem *p, const qp_peer *peer, double *position, double *normal) {
    *position = *normal = 0;
    for (uint64_t i = 0; i < p->task.count; ++i) {
        const qp_reference_sample *ref = &p->samples[i];
        double at[3], du[3], dv[3], n[3], square = 0;
        if (peer->apart != NULL && peer->apart[i]) continue;
        peer->series->read(peer, i, at, du, dv);
        for (int c = 0; c < 3; ++c) {
            square += (at[c] - ref->p[c]) * (at[c] - ref->p[c]);
            n[c] = du[(c + 1) % 3] * dv[(c + 2) % 3] - du[(c + 2) % 3] * dv[(c + 1) % 3];
        }
        const double error = sqrt(square) / p->task.mesh->diagonal;
        if (!(error <= *position)) *position = error;
        if (!ref->normal_defined || ref->condition > 20) continue;
        const double degrees = angle(n, ref->n);
        if (!(degrees <= *normal)) *normal = degrees;
    }
}

static void compare(const char *name, const problem *p, const qp_peer_series *series) {
    qp_peer *peer;
    qp_error err = {0};
    const unsigned level = series->last_level < MOST_LEVEL ? series->last_level : MOST_LEVEL;
    qp_status status = series->create(series, &p->task, level, &peer, &err);
    if (!CHECK_OK(status, err)) return;
    double position, normal;
    memset(p->task.out, 0xff, QP_PEER_OUT_BYTES(p->task.count));
    CHECK_OK(series->evaluate(peer, &err), err);
    measure(p, peer, &position, &normal);
    /* Twice gives the same. */
    double again, normal_again;
    CHECK_OK(series->evaluate(peer, &err), err);
    measure(p, peer, &again, &normal_again);
    CHECK(position == again && normal == normal_again);
    printf("%-28s %-20s level %2u: position %.2e, normal %.2e degrees\n", name, series->name, level, position,
           normal);
    /* Embree and the highest levels leave nothing to end caps here; Bfr's default is level 2. */
    const bool is_default = strstr(series->name, "default") != NULL;
    CHECK_NEAR(position, 0, is_default ? 5e-2 : series->in_double ? 1e-13 : 1e-6);
    CHECK_NEAR(normal, 0, is_default ? 60 : series->in_double ? 1e-7 : 0.1);
    series->free(peer);
}

static const qp_peer_module *load(const char *name, const char *file) {
    const void *found;
    qp_error err = {0};
    if (qp_module_load(name, file, "..", QP_PEER_MODULE_SYMBOL, &found, &err) == QP_OK) return found;
    printf("skipped: %s\n", err.message);
    return NULL;
}

/* A generated mesh under the default rules, which all peers know. */
static qp_mesh *generate(const char *kind, uint64_t seed, double sharpness) {
    const qp_generate_options options = {.sharpness = sharpness, .seed = seed, .faces = 40};
    const qp_mesh_options rules = {.override_boundary = 1,
                                   .boundary = QP_BOUNDARY_EDGE_ONLY,
                                   .override_crease_method = 1,
                                   .override_triangle_rule = 1};
    qp_mesh *mesh = NULL;
    qp_error err = {0};
    CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err);
    if (mesh != NULL) CHECK_OK(qp_mesh_apply_options(&mesh, &rules, &err), err);
    return mesh;
}

static void compare_mesh(const char *kind, uint64_t seed, double sharpness,
                         const qp_peer_module *const *modules) {
    qp_mesh *mesh = generate(kind, seed, sharpness);
    char name[64];
    problem p = {0};
    snprintf(name, sizeof name, "%s, seed %llu", kind, (unsigned long long)seed);
    if (mesh != NULL && make_problem(mesh, &p)) {
        for (int m = 0; m < 2; ++m)
            for (unsigned l = 0; modules[m] != NULL && l < QP_PEER_LISTS; ++l)
                for (unsigned s = 0; s < modules[m]->lists[l].count; ++s)
                    compare(name, &p, &modules[m]->lists[l].series[s]);
    }
    free_problem(&p);
    qp_mesh_free(mesh);
}

/* Meshes that Embree cannot hold, or makes another surface of, are refused; parts of them are marked. */
static void check_refusals(const qp_peer_module *embree) {
    const qp_peer_series *series = &embree->lists[0].series[0];
    static const struct {
        const char *kind, *reason;
        uint32_t n;
    } cases[] = {{"fan", "64", 100}, {"prism", "15 sides", 20}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const qp_generate_options options = {.n = {cases[i].n}, .sharpness = -1};
        qp_mesh *mesh;
        qp_peer *peer;
        qp_error err = {0};
        problem p = {0};
        if (!CHECK_OK(qp_mesh_generate(cases[i].kind, &options, &mesh, &err), err)) continue;
        if (make_problem(mesh, &p)) {
            CHECK(series->create(series, &p.task, 0, &peer, &err) == QP_BAD_INPUT);
            CHECK(strstr(err.message, cases[i].reason) != NULL);
        }
        free_problem(&p);
        qp_mesh_free(mesh);
    }
    qp_mesh *mesh = generate("terrain", 0, -1);
    qp_peer *peer;
    qp_error err = {0};
    problem p = {0};
    if (mesh != NULL && make_problem(mesh, &p) &&
        CHECK_OK(series->create(series, &p.task, 0, &peer, &err), err)) {
        uint64_t apart = 0;
        for (uint64_t i = 0; i < p.task.count && peer->apart != NULL; ++i) apart += peer->apart[i];
        /* Its corners of one face. */
        CHECK(apart > 0 && apart < p.task.count / 4);
        series->free(peer);
    }
    free_problem(&p);
    qp_mesh_free(mesh);
}

int main(void) {
    const qp_peer_module *modules[2] = {load("OpenSubdiv", "quadplan_opensubdiv.so"),
                                        load("Embree", "quadplan_embree.so")};
    CHECK(modules[0] != NULL);
    compare_mesh("cube", 0, -1, modules);
    compare_mesh("prism", 0, -1, modules);
    compare_mesh("creased-torus", 0, 2.5, modules);
    compare_mesh("random-closed", 3, -1, modules);
    compare_mesh("random-closed", 16, -1, modules);
    compare_mesh("random-open", 22, -1, modules);
    compare_mesh("terrain", 0, -1, modules);
    if (modules[1] != NULL) check_refusals(modules[1]);
    qp_reference_work_free(&work);
    return check_report();
}
