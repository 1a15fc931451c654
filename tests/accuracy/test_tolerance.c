/* Frames with a tolerance: points inside the triangles are nowhere farther from the surface than the bound says, the bound is within the
 * tolerance where the factors allow, and it takes fewer samples than one factor for all. QUADPLAN_FULL=1: more meshes, tolerances. */
#include "host/plan/plan.h"
#include "host/reference/reference.h"
#include "tests/check.h"
#include "tests/unit/mesh_files.h"

#include <string.h>

static qp_device *device;

/* Places in a triangle. */
static const double weights[6][3] = {{0.5, 0.5, 0},     {0, 0.5, 0.5},
                                     {0.5, 0, 0.5},     {1 / 3., 1 / 3., 1 / 3.},
                                     {0.8, 0.15, 0.05}, {0.1, 0.3, 0.6}};
enum { PLACES = 6 };

typedef struct measured {
    double error; /* largest, of the diagonal */
    uint64_t samples;
    qp_stream stream; /* its numbers; arrays are gone */
} measured;

static double coordinate(const qp_stream *s, size_t i) {
    return s->precision == QP_DOUBLE ? ((const double *)s->vertices)[i]
                                     : (double)((const float *)s->vertices)[i];
}

typedef struct points {
    uint64_t count;
    uint32_t *patch;
    double *uv, *p; /* on the triangle */
} points;

static int points_alloc(points *at, uint64_t count) {
    at->count = 0;
    at->patch = qp_alloc((size_t)count, sizeof *at->patch, false);
    at->uv = qp_alloc(2 * (size_t)count, sizeof *at->uv, false);
    at->p = qp_alloc(3 * (size_t)count, sizeof *at->p, false);
    return CHECK(at->patch != NULL && at->uv != NULL && at->p != NULL);
}
static void points_free(points *at) {
    free(at->patch);
    free(at->uv);
    free(at->p);
}

static int at_corner(const qp_stream *s, uint32_t i) {
    const float u = s->uv[2 * (size_t)i], v = s->uv[2 * (size_t)i + 1];
    return (u == 0 || u == 1) && (v == 0 || v == 1);
}

/* At most about `most` points of the stream's triangles, spread evenly, and those of all triangles at corners of patches. */
static int collect(const qp_stream *s, uint64_t most, points *at) {
    uint64_t stride = s->n_triangles * PLACES / most + 1;
    if (stride > 1) stride |= 1; /* both triangles of a cell, in turn */
    uint64_t count = 0;
    for (int pass = 0; pass < 2; ++pass) {
        for (uint64_t t = 0; t < s->n_triangles; ++t) {
            const uint32_t *corner = s->triangles + 3 * t;
            if (t % stride != 0 && !at_corner(s, corner[0]) && !at_corner(s, corner[1]) &&
                !at_corner(s, corner[2]))
                continue;
            if (pass == 0) {
                count += PLACES;
                continue;
            }
            for (int k = 0; k < PLACES; ++k) {
                double uv[2] = {0, 0}, p[3] = {0, 0, 0};
                for (int c = 0; c < 3; ++c) {
                    for (size_t x = 0; x < 2; ++x)
                        uv[x] += weights[k][c] * (double)s->uv[2 * (size_t)corner[c] + x];
                    for (size_t x = 0; x < 3; ++x)
                        p[x] += weights[k][c] * coordinate(s, 6 * (size_t)corner[c] + x);
                }
                at->patch[at->count] = s->sample_patch[corner[0]];
                for (size_t x = 0; x < 2; ++x) at->uv[2 * at->count + x] = fmin(fmax(uv[x], 0), 1);
                memcpy(at->p + 3 * at->count++, p, sizeof p);
            }
        }
        if (pass == 0 && !points_alloc(at, count)) return 0;
    }
    return 1;
}

static double distance(const double *a, const double *b) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* Largest distance of the points from the surface; by the reference at every 1,000th, by evaluation in double at all. */
static double farthest(const qp_surface *surface, qp_frame *exact, const points *at) {
    const qp_mesh *mesh = surface->mesh;
    qp_error err = {0};
    qp_stream s;
    double most = 0;
    if (!CHECK_OK(qp_frame_eval_points(exact, at->count, at->patch, at->uv, &s, &err), err)) return NAN;
    for (uint64_t i = 0; i < at->count; ++i) {
        const double *p = (const double *)s.vertices + 6 * i;
        most = fmax(most, distance(p, at->p + 3 * i));
        if (i % 1000 != 7) continue;
        qp_reference_sample r;
        if (!CHECK_OK(qp_reference_eval(mesh, mesh->positions, at->patch[i], 1, at->uv + 2 * i, &r, &err),
                      err))
            return NAN;
        CHECK(distance(r.p, p) <= 1e-12 * mesh->diagonal);
    }
    return most / mesh->diagonal;
}

static int measure(qp_frame *frame, qp_frame *exact, const qp_surface *surface, const qp_tessellation *t,
                   uint64_t most, measured *m) {
    qp_error err = {0};
    points at = {0};
    int good = CHECK_OK(qp_frame_eval(frame, t, &m->stream, &err), err) && collect(&m->stream, most, &at);
    if (good) m->error = farthest(surface, exact, &at);
    m->samples = m->stream.n_samples;
    points_free(&at);
    return good && CHECK(m->error >= 0);
}

static double least_ratio = 1, most_ratio, log_ratios, log_savings;
static unsigned measurements, comparisons;

/* Samples of the least uniform factor that errs no more than `error`; 0 when 64 does. */
static uint64_t uniform_samples(qp_frame *frame, qp_frame *exact, const qp_surface *surface, double error,
                                uint64_t most, unsigned *factor) {
    unsigned low = 0, high = 65;
    uint64_t samples = 0;
    while (high - low > 1) {
        const unsigned middle = (low + high) / 2;
        measured m;
        if (!measure(frame, exact, surface, &(qp_tessellation){.factor = (float)middle}, most, &m)) return 0;
        if (m.error <= error) {
            high = middle;
            samples = m.samples;
        } else {
            low = middle;
        }
    }
    *factor = high;
    return samples;
}

static void one(const char *name, qp_frame *frame, qp_frame *exact, const qp_surface *surface,
                qp_spacing spacing, double tolerance, uint64_t most, int compare) {
    const qp_tessellation t = {.spacing = spacing, .tolerance = tolerance};
    measured m;
    if (!measure(frame, exact, surface, &t, most, &m)) return;
    const qp_stream *s = &m.stream;
    CHECK(m.error <= s->bound);
    CHECK((s->over_tolerance != 0) == (s->bound > tolerance));
    if (s->over_tolerance != 0) CHECK(s->factor_max == 64);
    const double ratio = m.error / s->bound;
    ++measurements;
    log_ratios += log(ratio);
    least_ratio = fmin(least_ratio, ratio);
    most_ratio = fmax(most_ratio, ratio);
    printf("%s, spacing %d, tolerance %g: factors %g to %g, mean %.3g; %llu samples; bound %.3g, measured "
           "%.3g (%.2f); "
           "%llu over",
           name, (int)spacing, tolerance, (double)s->factor_min, (double)s->factor_max,
           (double)s->factor_mean, (unsigned long long)s->n_samples, s->bound, m.error, ratio,
           (unsigned long long)s->over_tolerance);
    if (compare) {
        unsigned factor;
        const uint64_t uniform = uniform_samples(frame, exact, surface, m.error, most, &factor);
        if (uniform != 0) {
            printf("; factor %u for all: %llu samples, %.1f times as many", factor,
                   (unsigned long long)uniform, (double)uniform / (double)m.samples);
            ++comparisons;
            log_savings += log((double)uniform / (double)m.samples);
        }
    }
    printf("\n");
}

static double light_least = 1, light_most, light_bytes;
static unsigned lights;

/* Points within a tolerance: samples all over, and close to corners. */
static void points_within(const qp_surface *surface, qp_frame *exact, double tolerance,
                          qp_precision precision, uint64_t samples) {
    const qp_mesh *mesh = surface->mesh;
    qp_error err = {0};
    qp_frame *frame = NULL;
    const qp_frame_options options = {.precision = precision, .tolerance = tolerance};
    if (!CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) return;
    for (int corner = 0; corner < 2; ++corner) {
        qp_sample_set set = {0};
        qp_stream s, e;
        if (!CHECK_OK(qp_sample_set_make(mesh, corner ? "corner" : "random", samples, 5, &set, &err), err))
            break;
        if (CHECK_OK(qp_frame_eval_points(frame, set.count, set.patch, set.uv, &s, &err), err) &&
            CHECK_OK(qp_frame_eval_points(exact, set.count, set.patch, set.uv, &e, &err), err)) {
            double most = 0;
            for (uint64_t i = 0; i < set.count; ++i) {
                double p[3];
                for (size_t x = 0; x < 3; ++x) p[x] = coordinate(&s, 6 * i + x);
                most = fmax(most, distance(p, (const double *)e.vertices + 6 * i));
            }
            most /= mesh->diagonal;
            CHECK(most <= s.bound);
            CHECK(s.bound <= tolerance || tolerance < 1e-6);
            if (tolerance >= 1e-4 && corner) {
                light_least = fmin(light_least, most / s.bound);
                light_most = fmax(light_most, most / s.bound);
                light_bytes += (double)s.support_bytes / (double)(e.support_bytes / 2);
                ++lights;
            }
        }
        qp_sample_set_free(&set);
    }
    qp_frame_free(frame);
}

/* Each tolerance under another spacing, or all under equal spacing and compared with uniform factors. */
static void every_tolerance(const char *name, qp_mesh *mesh, const double *tolerances, unsigned n,
                            uint64_t most, int compare) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    qp_frame *frame = NULL, *exact = NULL;
    if (CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, &(qp_frame_options){.want_triangles = 1}, &frame, &err),
                 err) &&
        CHECK_OK(qp_frame_create(device, surface, &(qp_frame_options){.precision = QP_DOUBLE}, &exact, &err),
                 err)) {
        for (unsigned i = 0; i < n; ++i)
            one(name, frame, exact, surface, (qp_spacing)(compare ? QP_EQUAL : (int)(i % 3)), tolerances[i],
                most, compare);
        points_within(surface, exact, 1e-3, QP_FLOAT, most / 10);
        points_within(surface, exact, 1e-4, QP_FLOAT, most / 10);
        points_within(surface, exact, 1e-9, QP_DOUBLE, most / 10);
    }
    qp_frame_free(frame);
    qp_frame_free(exact);
    qp_surface_free(surface);
}

static void model(const char *folder, const char *file, unsigned n) {
    static const double tolerances[] = {1e-2, 1e-3, 3e-4, 1e-4};
    char path[1024];
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    snprintf(path, sizeof path, "%s/%s", folder, file);
    if (CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err))
        every_tolerance(file, mesh, tolerances, n, 100000, 1);
    qp_mesh_free(mesh);
}

static void random_mesh(unsigned seed) {
    static const double tolerances[] = {3e-2, 5e-3, 1e-3};
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    char name[32];
    const qp_generate_options options = {.seed = seed, .sharpness = -1.0, .faces = 30};
    snprintf(name, sizeof name, "random %u", seed);
    if (CHECK_OK(qp_mesh_generate(seed % 2 == 0 ? "random-closed" : "random-open", &options, &mesh, &err),
                 err))
        every_tolerance(name, mesh, tolerances, 3, 20000, 0);
    qp_mesh_free(mesh);
}

/* Flat patches need one piece, and a mesh moved in place is measured anew. */
static void test_flat_and_moved(void) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream s = {0};
    const qp_tessellation t = {.tolerance = 1e-3};
    if (CHECK_OK(
            qp_mesh_generate("terrain", &(qp_generate_options){.n = {6, 6}, .sharpness = -1}, &mesh, &err),
            err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        /* A regular grid in the plane. */
        double *moved = mesh->positions, z[49];
        CHECK(mesh->n_vertices == 49);
        for (uint32_t i = 0; i < 49; ++i) {
            z[i] = moved[3 * i + 1];
            moved[3 * i + 1] = 0;
        }
        if (CHECK_OK(qp_frame_create(device, surface, NULL, &frame, &err), err) &&
            CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err)) {
            CHECK(s.bound <= 1e-3 && s.over_tolerance == 0);
            const float flat = s.factor_mean;
            for (uint32_t i = 0; i < 49; ++i) moved[3 * i + 1] = z[i];
            CHECK_OK(qp_frame_update_positions(frame, &err), err);
            if (CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err))
                CHECK(s.factor_mean > flat && s.bound <= 1e-3);
            CHECK(qp_frame_eval(frame, &(qp_tessellation){.tolerance = -1}, &s, &err) == QP_BAD_INPUT);
            CHECK(qp_frame_eval(frame, &(qp_tessellation){.tolerance = NAN}, &s, &err) == QP_BAD_INPUT);
            CHECK(qp_frame_eval(frame, &(qp_tessellation){.tolerance = 1e-3, .factor = 0.5f}, &s, &err) ==
                  QP_BAD_INPUT);
            if (CHECK_OK(qp_frame_eval(frame, &(qp_tessellation){.tolerance = 1e-9, .factor = 3}, &s, &err),
                         err))
                CHECK(s.factor_max == 3 && s.over_tolerance != 0 && s.bound > 1e-9);
            if (CHECK_OK(qp_frame_eval(frame, &(qp_tessellation){.factor = 3}, &s, &err), err))
                CHECK(s.bound == 0 && s.over_tolerance == 0 && s.factor_max == 0);
        }
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    const char *folder = check_models(), *full = getenv("QUADPLAN_FULL");
    const bool all = full != NULL && full[0] == '1';
    test_flat_and_moved();
    for (unsigned seed = 0; seed < (CHECK_SANITIZED ? 2u : all ? 200u : 24u); ++seed) random_mesh(seed);
    if (folder != NULL && !CHECK_SANITIZED) {
        model(folder, "bigguy.obj", all ? 4 : 2);
        if (all) {
            model(folder, "monsterfrog.obj", 4);
            model(folder, "rook.obj", 4);
            model(folder, "armorguy.obj", 2);
        }
    }
    const double mean = exp(log_ratios / measurements),
                 saved = comparisons == 0 ? 0 : exp(log_savings / comparisons);
    printf("measured over bound: %.3g to %.3g, geometric mean %.3g; uniform factors take %.2f times the "
           "samples\n",
           least_ratio, most_ratio, mean, saved);
    printf("points: measured over bound %.3g to %.3g, control points %.2f of those of exact frames\n",
           light_least, light_most, light_bytes / lights);
    CHECK(light_most > 0.3 && light_bytes / lights < 0.7);
    CHECK(mean > 0.2);
    if (comparisons != 0) CHECK(saved > 1.2);
    qp_device_free(device);
    return check_report();
}
