/* What is evaluated on every runtime to compare the bits: a fixed list, made of generated meshes and, where QUADPLAN_MODELS is set,
 * of the models. */
#ifndef QP_TESTS_STREAM_CASES_H
#define QP_TESTS_STREAM_CASES_H

#include "host/base/random.h"
#include "host/mesh/mesh.h"
#include "tests/check.h"

#include <stdio.h>

/* What decides the factors or points of a case. */
typedef enum case_kind {
    CASE_UNIFORM,
    CASE_EDGES,     /* a random factor for every edge */
    CASE_PATCHES,   /* six random ones for every patch, some of which discard it */
    CASE_POINTS,    /* random points, and some close to corners */
    CASE_TOLERANCE, /* factors from a tolerance of a thousandth */
} case_kind;

/* Who runs a case: everybody; everybody but simulators, slow compilers and sanitizers; likewise, with the models. */
typedef enum case_size { CASE_TINY, CASE_SMALL, CASE_LARGE } case_size;

typedef struct stream_case {
    case_size size;
    const char *mesh; /* a kind of qp_mesh_generate, or a file in QUADPLAN_MODELS */
    uint32_t n[3], faces;
    uint64_t seed;
    case_kind kind;
    float factor;
    qp_spacing spacing;
    uint32_t depth;
    int no_regular_pass;
} stream_case;

/* Each in float and in double, always with derivatives. */
static const stream_case stream_cases[] = {
    {CASE_TINY, "random-open", {0}, 24, 4, CASE_UNIFORM, 2, QP_FRACTIONAL_ODD, 0, 0},
    {CASE_TINY, "random-open", {0}, 24, 4, CASE_EDGES, 2.5f, QP_EQUAL, 0, 0},
    {CASE_TINY, "random-open", {0}, 24, 4, CASE_POINTS, 0, QP_EQUAL, 0, 0},
    {CASE_TINY, "torus", {5, 3}, 0, 0, CASE_UNIFORM, 3.5f, QP_FRACTIONAL_EVEN, 0, 0},
    {CASE_SMALL, "random-open", {0}, 24, 4, CASE_POINTS, 0, QP_EQUAL, 2, 0},
    {CASE_SMALL, "fan", {300}, 0, 0, CASE_UNIFORM, 7, QP_EQUAL, 0, 0},
    {CASE_SMALL, "terrain", {4}, 0, 0, CASE_EDGES, 20, QP_FRACTIONAL_ODD, 0, 0},
    {CASE_SMALL, "terrain", {4}, 0, 0, CASE_PATCHES, 12, QP_EQUAL, 0, 0},
    {CASE_SMALL, "terrain", {4}, 0, 0, CASE_TOLERANCE, 0, QP_EQUAL, 0, 0},
    {CASE_SMALL, "random-closed", {0}, 120, 1, CASE_EDGES, 16, QP_FRACTIONAL_EVEN, 0, 0},
    {CASE_SMALL, "random-open", {0}, 150, 2, CASE_UNIFORM, 11, QP_FRACTIONAL_ODD, 4, 0},
    {CASE_LARGE, "bigguy.obj", {0}, 0, 0, CASE_UNIFORM, 16, QP_EQUAL, 0, 0},
    {CASE_LARGE, "monsterfrog.obj", {0}, 0, 0, CASE_UNIFORM, 7.3f, QP_FRACTIONAL_ODD, 0, 0},
    {CASE_LARGE, "armorguy.obj", {0}, 0, 0, CASE_EDGES, 8, QP_EQUAL, 0, 0},
};
enum { STREAM_CASES = 2 * sizeof stream_cases / sizeof stream_cases[0] };

static inline const stream_case *stream_case_of(int index) {
    return &stream_cases[index / 2];
}
static inline qp_precision stream_case_precision(int index) {
    return index % 2 != 0 ? QP_DOUBLE : QP_FLOAT;
}
static inline bool stream_case_is_model(const stream_case *c) {
    return c->size == CASE_LARGE;
}

/* One word that tells all about a case, and names it in the record. */
static inline void stream_case_name(int index, char *name, size_t size) {
    static const char *const kinds[] = {"tess", "edges", "patches", "points", "tolerance"};
    static const char *const spacings[] = {"equal", "even", "odd"};
    const stream_case *c = stream_case_of(index);
    char mesh[100], depth[20] = "";
    size_t length = (size_t)snprintf(mesh, sizeof mesh, "%s", c->mesh);
    if (c->n[0] != 0) length += (size_t)snprintf(mesh + length, sizeof mesh - length, ",n=%u", c->n[0]);
    if (c->n[1] != 0) length += (size_t)snprintf(mesh + length, sizeof mesh - length, "x%u", c->n[1]);
    if (c->faces != 0)
        snprintf(mesh + length, sizeof mesh - length, ",seed=%llu,faces=%u", (unsigned long long)c->seed,
                 c->faces);
    if (c->depth != 0) snprintf(depth, sizeof depth, ":depth=%u", c->depth);
    snprintf(name, size, "%s:%s=%g:%s%s%s:%s", mesh, kinds[c->kind], (double)c->factor, spacings[c->spacing],
             depth, c->no_regular_pass ? ":no-regular-pass" : "",
             stream_case_precision(index) == QP_DOUBLE ? "double" : "float");
}

static inline qp_status stream_case_mesh(const stream_case *c, qp_mesh **mesh, qp_error *err) {
    if (stream_case_is_model(c)) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", check_models(), c->mesh);
        return qp_mesh_read_obj(path, NULL, mesh, err);
    }
    const qp_generate_options options = {
        .n = {c->n[0], c->n[1], c->n[2]}, .sharpness = -1, .seed = c->seed, .faces = c->faces};
    return qp_mesh_generate(c->mesh, &options, mesh, err);
}

/* Evaluates a case's factors or points; *scratch is to be freed by the caller after use of the stream. */
static inline qp_status stream_case_eval(const stream_case *c, const qp_mesh *mesh, qp_frame *frame,
                                         void **scratch, qp_stream *stream, qp_error *err) {
    enum { POINTS = 120 };
    qp_random random = {42};
    qp_tessellation t = {.spacing = c->spacing, .factor = c->factor};
    *scratch = NULL;
    if (c->kind == CASE_POINTS) {
        double *uv = malloc(POINTS * (2 * sizeof *uv + sizeof(uint32_t)));
        uint32_t *patch = (uint32_t *)(uv + 2 * POINTS);
        *scratch = uv;
        if (uv == NULL) return qp_fail_memory(err, POINTS, "points");
        for (int i = 0; i < POINTS; ++i) {
            patch[i] = qp_random_below(&random, mesh->n_patches);
            while (mesh->face_flags[qp_patch_face(mesh, patch[i], NULL)] & QP_FACE_HOLE)
                patch[i] = (patch[i] + 1) % mesh->n_patches;
            for (int k = 0; k < 2; ++k) {
                const double near = ldexp(1, -(int)qp_random_below(&random, 25)),
                             any = qp_random_unit(&random);
                uv[2 * i + k] = i % 4 != 0 ? any : qp_random_chance(&random, 0.5) ? near : 1 - near;
            }
        }
        return qp_frame_eval_points(frame, POINTS, patch, uv, stream, err);
    }
    if (c->kind == CASE_TOLERANCE) {
        t.tolerance = 1e-3;
        t.factor = 0;
    } else if (c->kind != CASE_UNIFORM) {
        const size_t count = c->kind == CASE_EDGES ? mesh->n_edges : 6 * (size_t)mesh->n_patches;
        float *factors = malloc(count * sizeof *factors);
        *scratch = factors;
        if (factors == NULL) return qp_fail_memory(err, count, "factors");
        for (size_t i = 0; i < count; ++i)
            factors[i] = 1 + (c->factor - 1) * (float)ldexp(floor(ldexp(qp_random_unit(&random), 10)), -10);
        if (c->kind == CASE_EDGES) {
            t.edge_factors = factors;
        } else {
            for (size_t i = 0; i < count; i += 60) factors[i] = 0;
            t.patch_factors = factors;
        }
    }
    return qp_frame_eval(frame, &t, stream, err);
}

#endif
