#define _POSIX_C_SOURCE 200112L
/* Whole frames on real plans: OpenCL and host give the same bits, and so do the regular pass and the general
 * kernels, one batch and many; no cracks; refusals. */
#include "host/device/opencl.h"
#include "host/frame/frame.h"
#include "tests/check.h"

#include <string.h>

typedef struct generated {
    const char *kind;
    uint32_t n0;
    uint64_t seed;
    bool closed;
} generated;

static const generated meshes[] = {
    {"cube", 0, 0, true},          {"torus", 0, 0, true},        {"creased-torus", 0, 0, true},
    {"fan", 9, 0, false},          {"prism", 5, 0, true},        {"prism", 40, 0, true},
    {"random-closed", 0, 1, true}, {"random-open", 0, 2, false}, {"random-open", 0, 3, false},
};

/* Stream of one frame as a copy, for comparison. */
typedef struct result {
    qp_status status;
    uint64_t hash, samples, triangles;
} result;

static result run(qp_device *device, const qp_surface *surface, qp_precision precision, int no_regular_pass,
                  const qp_tessellation *tessellation) {
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream;
    qp_frame_options options = {
        .precision = precision, .want_triangles = 1, .want_hash = 1, .no_regular_pass = no_regular_pass};
    result r = {.status = QP_SYSTEM};
    if (CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err) &&
        CHECK_OK(qp_frame_eval(frame, tessellation, &stream, &err), err))
        r = (result){QP_OK, stream.hash, stream.n_samples, stream.n_triangles};
    qp_frame_free(frame);
    return r;
}

static void check_same(result a, result b) {
    CHECK(a.status == QP_OK && b.status == QP_OK);
    CHECK(a.hash == b.hash && a.samples == b.samples && a.triangles == b.triangles);
}

/* Factors from a seed, some patches discarded. */
static void random_factors(float *factors, uint32_t n_patches, uint64_t seed) {
    for (uint32_t i = 0; i < 6 * n_patches; ++i) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        factors[i] = (float)(seed >> 40) / (float)(1 << 24) * 20.0f - 0.1f;
    }
}

static void test_same_bits(qp_device *host, qp_device *opencl, const qp_mesh *mesh,
                           const qp_surface *surface) {
    float *factors = malloc(6 * sizeof(float) * mesh->n_patches);
    if (!CHECK(factors != NULL)) return;
    random_factors(factors, mesh->n_patches, mesh->n_patches);
    const qp_tessellation cases[] = {{.factor = 1},
                                     {.factor = 7.3f, .spacing = QP_FRACTIONAL_ODD},
                                     {.factor = 16},
                                     {.patch_factors = factors, .spacing = QP_FRACTIONAL_EVEN}};
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; ++c) {
        for (int p = QP_FLOAT; p <= QP_DOUBLE; ++p) {
            result fast = run(host, surface, (qp_precision)p, 0, &cases[c]);
            CHECK(fast.samples > 0);
            check_same(fast, run(host, surface, (qp_precision)p, 1, &cases[c]));
            if (opencl == NULL || (p == QP_DOUBLE && !qp_device_has_double(opencl))) continue;
            check_same(fast, run(opencl, surface, (qp_precision)p, 0, &cases[c]));
            /* Buffers of 16 KiB: many batches. */
            uint64_t most = opencl->info.max_buffer_bytes, memory = opencl->info.memory_bytes;
            qp_frame *frame = NULL;
            qp_stream stream;
            qp_error err = {0};
            qp_frame_options options = {.precision = (qp_precision)p, .want_triangles = 1, .want_hash = 1};
            if (CHECK_OK(qp_frame_create(opencl, surface, &options, &frame, &err), err)) {
                opencl->info.max_buffer_bytes = 1 << 20;
                opencl->info.memory_bytes = 1 << 16;
                if (CHECK_OK(qp_frame_eval(frame, &cases[c], &stream, &err), err)) {
                    CHECK(stream.hash == fast.hash);
                    /* A batch may exceed the buffer by one patch, and a deep plan has 1500 points. */
                    CHECK(stream.support_bytes <= (1 << 16));
                }
                opencl->info.max_buffer_bytes = most;
                opencl->info.memory_bytes = memory;
            }
            qp_frame_free(frame);
        }
    }
    free(factors);
}

/* ---- Cracks ---- */

typedef struct crack_point {
    double p[3];
    uint32_t sample, id;
} crack_point;

static int by_position(const void *a, const void *b) {
    const crack_point *x = a, *y = b;
    for (int c = 0; c < 3; ++c) {
        if (x->p[c] != y->p[c]) return x->p[c] < y->p[c] ? -1 : 1;
    }
    return 0;
}
static int by_pair(const void *a, const void *b) {
    const uint64_t *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

/* Triangles welded at equal positions (rounded to 1e-9) must close: every edge once in each direction. */
static void check_closed(const qp_stream *stream) {
    const size_t n = (size_t)stream->n_samples, n_edges = 3 * (size_t)stream->n_triangles;
    crack_point *points = malloc((n + 1) * sizeof *points);
    uint32_t *id = malloc((n + 1) * sizeof *id);
    uint64_t *pairs = malloc((n_edges + 1) * sizeof *pairs);
    if (CHECK(points != NULL && id != NULL && pairs != NULL)) {
        const double *v = stream->vertices;
        for (size_t i = 0; i < n; ++i) {
            for (int c = 0; c < 3; ++c) points[i].p[c] = floor((v[6 * i + (size_t)c] + 0.123456789) * 1e8);
            points[i].sample = (uint32_t)i;
        }
        qsort(points, n, sizeof *points, by_position);
        for (size_t i = 0; i < n; ++i)
            id[points[i].sample] = i > 0 && by_position(&points[i - 1], &points[i]) == 0
                                       ? id[points[i - 1].sample]
                                       : (uint32_t)i;
        size_t kept = 0;
        for (size_t t = 0; t < n_edges; t += 3) {
            for (size_t k = 0; k < 3; ++k) {
                uint64_t a = id[stream->triangles[t + k]], b = id[stream->triangles[t + (k + 1) % 3]];
                if (a != b) pairs[kept++] = (a < b ? a << 32 | b : b << 32 | a);
            }
        }
        qsort(pairs, kept, sizeof *pairs, by_pair);
        size_t odd = 0;
        for (size_t i = 0, j; i < kept; i = j) {
            for (j = i; j < kept && pairs[j] == pairs[i];) ++j;
            odd += (j - i) % 2;
        }
        CHECK(odd == 0);
    }
    free(points);
    free(id);
    free(pairs);
}

static void test_cracks(qp_device *host, const qp_surface *surface) {
    const qp_tessellation cases[] = {{.factor = 1},
                                     {.factor = 5},
                                     {.factor = 8},
                                     {.factor = 16},
                                     {.factor = 6, .spacing = QP_FRACTIONAL_EVEN},
                                     {.factor = 5.3f, .spacing = QP_FRACTIONAL_EVEN},
                                     {.factor = 1, .spacing = QP_FRACTIONAL_ODD},
                                     {.factor = 9.3f, .spacing = QP_FRACTIONAL_ODD}};
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_frame_options options = {.precision = QP_DOUBLE, .want_triangles = 1};
    if (CHECK_OK(qp_frame_create(host, surface, &options, &frame, &err), err)) {
        for (size_t c = 0; c < sizeof cases / sizeof cases[0]; ++c) {
            qp_stream stream;
            if (CHECK_OK(qp_frame_eval(frame, &cases[c], &stream, &err), err)) check_closed(&stream);
        }
    }
    qp_frame_free(frame);
}

/* ---- Points, positions, refusals ---- */

static void test_points(qp_device *host, const qp_mesh *mesh, const qp_surface *surface) {
    enum { N = 3000 };
    static uint32_t patch[N];
    static double uv[2 * N];
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream;
    qp_tessellation tessellation = {.factor = 8};
    if (!CHECK_OK(qp_frame_create(host, surface, NULL, &frame, &err), err)) return;
    if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) {
        /* The same samples in another order are the same. */
        uint64_t n = stream.n_samples < N ? stream.n_samples : N;
        float *copy = malloc((size_t)n * 6 * sizeof(float));
        if (CHECK(copy != NULL)) {
            for (uint64_t i = 0; i < n; ++i) {
                uint64_t from = n - 1 - i;
                patch[i] = stream.sample_patch[from];
                for (uint64_t k = 0; k < 2; ++k) uv[2 * i + k] = (double)stream.uv[2 * from + k];
                memcpy(copy + 6 * i, (const float *)stream.vertices + 6 * from, 6 * sizeof(float));
            }
            if (CHECK_OK(qp_frame_eval_points(frame, n, patch, uv, &stream, &err), err)) {
                CHECK(stream.n_samples == n);
                CHECK(memcmp(stream.vertices, copy, (size_t)n * 6 * sizeof(float)) == 0);
                CHECK(memcmp(stream.sample_patch, patch, (size_t)n * sizeof(uint32_t)) == 0);
            }
        }
        free(copy);
    }
    const uint32_t no_patch = mesh->n_patches, first = patch[0];
    const double good[2] = {0.25, 1}, outside[2] = {0.5, 1.5}, fine[2] = {0x1p-25, 0.1}, nan_uv[2] = {NAN, 0};
    CHECK(qp_frame_eval_points(frame, 1, &no_patch, good, &stream, &err) == QP_BAD_INPUT);
    CHECK(qp_frame_eval_points(frame, 1, &first, outside, &stream, &err) == QP_BAD_INPUT);
    CHECK_OK(qp_frame_eval_points(frame, 1, &first, fine, &stream, &err), err);
    CHECK(qp_frame_eval_points(frame, 1, &first, nan_uv, &stream, &err) == QP_BAD_INPUT);
    CHECK_OK(qp_frame_eval_points(frame, 0, NULL, NULL, &stream, &err), err);
    CHECK(stream.n_samples == 0);
    tessellation.factor = 0.5f;
    CHECK(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_BAD_INPUT);
    tessellation.factor = NAN;
    CHECK(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_BAD_INPUT);
    qp_frame_free(frame);
}

/* Positions that move by a shift the surface follows; and back. */
static void test_positions(qp_device *host, qp_mesh *mesh, const qp_surface *surface) {
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream;
    qp_frame_options options = {.precision = QP_DOUBLE, .want_hash = 1};
    const qp_tessellation tessellation = {.factor = 3};
    if (!CHECK_OK(qp_frame_create(host, surface, &options, &frame, &err), err)) return;
    if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) {
        uint64_t hash = stream.hash;
        double x = ((const double *)stream.vertices)[0], kept = mesh->positions[0];
        for (uint32_t v = 0; v < mesh->n_vertices; ++v) mesh->positions[3 * v] *= 2;
        CHECK_OK(qp_frame_update_positions(frame, &err), err);
        if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) {
            CHECK_NEAR(((const double *)stream.vertices)[0], 2 * x, 1e-14);
            CHECK(stream.hash != hash);
        }
        for (uint32_t v = 0; v < mesh->n_vertices; ++v) mesh->positions[3 * v] /= 2;
        CHECK(mesh->positions[0] == kept);
        CHECK_OK(qp_frame_update_positions(frame, &err), err);
        if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) CHECK(stream.hash == hash);
        options.precision = QP_FLOAT;
        mesh->positions[0] = 1e300;
        qp_frame *too_large = NULL;
        CHECK(qp_frame_create(host, surface, &options, &too_large, &err) == QP_BAD_INPUT &&
              too_large == NULL);
        mesh->positions[0] = kept;
    }
    qp_frame_free(frame);
}

/* Holes make no samples; a mesh of nothing but holes makes an empty stream. */
static void test_holes(qp_device *device) {
    const char two[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 5 6 3\n";
    for (int holes = 1; holes <= 2; ++holes) {
        char text[256];
        snprintf(text, sizeof text, "%st hole 1/0/0 1\n%s", two, holes == 2 ? "t hole 1/0/0 0\n" : "");
        qp_error err = {0};
        qp_mesh *mesh = NULL;
        qp_surface *surface = NULL;
        qp_frame *frame = NULL;
        qp_stream stream;
        const qp_tessellation tessellation = {.factor = 2};
        const uint32_t hole = 1;
        const double uv[2] = {0, 0};
        if (CHECK_OK(qp_mesh_parse_obj("two", text, strlen(text), NULL, &mesh, &err), err) &&
            CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
            CHECK_OK(qp_frame_create(device, surface, NULL, &frame, &err), err) &&
            CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) {
            CHECK(stream.n_samples == (holes == 1 ? 9 : 0));
            CHECK(qp_frame_eval_points(frame, 1, &hole, uv, &stream, &err) == QP_BAD_INPUT);
        }
        qp_frame_free(frame);
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
}

/* QUADPLAN_KERNELS: the sources of the tree give the same bits; a folder without them, or with broken ones, one
 * line. */
static void test_kernel_folder(qp_device *opencl, const qp_surface *surface) {
    const char *source = getenv("QUADPLAN_SOURCE_DIR");
    char folder[4096];
    qp_error err = {0};
    qp_frame *frame = NULL;
    const qp_tessellation tessellation = {.factor = 4};
    if (opencl == NULL) return;
    setenv("QUADPLAN_KERNELS", "no-such-folder", 1);
    CHECK(qp_frame_create(opencl, surface, NULL, &frame, &err) == QP_BAD_INPUT && frame == NULL);
    CHECK(strstr(err.message, "no-such-folder/") != NULL);
    unsetenv("QUADPLAN_KERNELS");
    if (source == NULL) return;
    result embedded = run(opencl, surface, QP_FLOAT, 0, &tessellation);
    snprintf(folder, sizeof folder, "%s/kernels", source);
    setenv("QUADPLAN_KERNELS", folder, 1);
    check_same(embedded, run(opencl, surface, QP_FLOAT, 0, &tessellation));
    unsetenv("QUADPLAN_KERNELS");
}

/* What a device could be instead: other register widths, float division that is not correctly rounded. The same
 * bits. */
static void test_variants(qp_device *opencl, const qp_surface *surface) {
    const qp_tessellation tessellation = {.factor = 7};
    if (opencl == NULL) return;
    const qp_device kept = *opencl;
    for (int p = QP_FLOAT; p <= QP_DOUBLE; ++p) {
        if (p == QP_DOUBLE && !qp_device_has_double(opencl)) continue;
        result usual = run(opencl, surface, (qp_precision)p, 0, &tessellation);
        for (uint32_t lanes = 1; lanes <= 16; lanes = lanes == 1 ? 4 : 2 * lanes) {
            for (int correct = 0; correct < 2; ++correct) {
                opencl->lanes_float = lanes;
                opencl->lanes_double = lanes;
                opencl->info.rounds_correctly = correct && kept.info.rounds_correctly;
                check_same(usual, run(opencl, surface, (qp_precision)p, 0, &tessellation));
                opencl->info.rounds_correctly = kept.info.rounds_correctly;
            }
        }
        opencl->lanes_float = kept.lanes_float;
        opencl->lanes_double = kept.lanes_double;
        /* Work-groups of the size that other devices than processors get. */
        opencl->info.is_cpu = false;
        check_same(usual, run(opencl, surface, (qp_precision)p, 0, &tessellation));
        opencl->info.is_cpu = kept.info.is_cpu;
    }
}

static void test_mesh(qp_device *host, qp_device *opencl, const generated *g) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_generate_options options = {.n = {g->n0, 0, 0}, .sharpness = -1, .seed = g->seed, .faces = 60};
    if (CHECK_OK(qp_mesh_generate(g->kind, &options, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        test_same_bits(host, opencl, mesh, surface);
        if (g->closed) test_cracks(host, surface);
        test_points(host, mesh, surface);
        test_positions(host, mesh, surface);
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    qp_error err;
    qp_device *host = NULL, *opencl = NULL;
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    if (qp_device_open(NULL, &opencl, &err) != QP_OK) printf("without OpenCL: %s\n", err.message);
    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; ++i) test_mesh(host, opencl, &meshes[i]);
    test_holes(host);
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_generate_options options = {.sharpness = -1};
    if (CHECK_OK(qp_mesh_generate("creased-torus", &options, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        test_kernel_folder(opencl, surface);
        if (!CHECK_SANITIZED) test_variants(opencl, surface);
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    qp_device_free(host);
    qp_device_free(opencl);
    return check_report();
}
