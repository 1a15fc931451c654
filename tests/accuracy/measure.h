/* One error measurement: mesh, precision, sample set. */
#ifndef QP_TESTS_MEASURE_H
#define QP_TESTS_MEASURE_H

#include "host/plan/plan.h"
#include "host/reference/reference.h"
#include "tests/check.h"

#include <string.h>

/* set: "grid" at factor and spacing of *tessellation, or one that qp_sample_set_make knows. */
static inline int measure(const qp_surface *surface, qp_device *device, qp_precision precision,
                          const char *set, const qp_tessellation *tessellation, uint64_t samples,
                          uint64_t seed, qp_error_report *report) {
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_frame_options options = {.precision = precision};
    qp_stream stream = {0};
    qp_sample_set points = {0};
    int good = CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err);
    if (good && strcmp(set, "grid") == 0) {
        good = CHECK_OK(qp_frame_eval(frame, tessellation, &stream, &err), err);
    } else if (good) {
        good =
            CHECK_OK(qp_sample_set_make(surface->mesh, set, samples, seed, &points, &err), err) &&
            CHECK_OK(qp_frame_eval_points(frame, points.count, points.patch, points.uv, &stream, &err), err);
    }
    good = good && CHECK_OK(qp_reference_compare(surface->mesh, &stream, points.uv, report, &err), err);
    qp_sample_set_free(&points);
    qp_frame_free(frame);
    return good;
}

/* The bounds of issue and README, positions as part of the diagonal. A normal that is ill conditioned may be off by as much more as
 * its condition says. */
static inline int within_bounds(const qp_error_report *r, qp_precision precision) {
    const double position = precision == QP_DOUBLE ? 1e-13 : 3e-7,
                 normal = precision == QP_DOUBLE ? 1e-4 : 0.01;
    int good = CHECK(r->position_max <= position);
    good = CHECK(r->normal_max_deg <= normal) && good;
    good = CHECK(r->ill_normal_deg_per_condition <= normal / QP_WELL_CONDITIONED) && good;
    good = CHECK(r->past_depth == 0) && good;
    return CHECK(r->nonfinite == 0) && good;
}

/* Sums over many measurements, for one closing line. */
typedef struct measure_sum {
    uint64_t samples, past_depth, undefined, ill;
    double position, normal, ill_normal;
} measure_sum;

static inline void measure_add(measure_sum *sum, const qp_error_report *r) {
    sum->samples += r->samples;
    sum->past_depth += r->past_depth;
    sum->undefined += r->normals_undefined;
    sum->ill += r->normals_ill;
    sum->position = fmax(sum->position, r->position_max);
    sum->normal = fmax(sum->normal, r->normal_max_deg);
    sum->ill_normal = fmax(sum->ill_normal, r->ill_normal_max_deg);
}

static inline void measure_print(const char *name, const measure_sum *s) {
    printf("%s: %llu samples, position max %.3g of the diagonal, normal max %.3g degrees; left out: %llu "
           "past depth, "
           "%llu without a normal, %llu with ill-conditioned tangents (%.2g of all; max %.3g degrees)\n",
           name, (unsigned long long)s->samples, s->position, s->normal, (unsigned long long)s->past_depth,
           (unsigned long long)s->undefined, (unsigned long long)s->ill,
           s->samples ? (double)s->ill / (double)s->samples : 0, s->ill_normal);
}

#endif
