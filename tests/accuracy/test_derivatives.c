/* First derivatives and normals at any (u,v), with all the digits of a double, against the reference. */
#include "host/base/random.h"
#include "host/plan/plan.h"
#include "host/reference/reference.h"
#include "tests/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct worst {
    uint64_t samples, frames;
    double position, derivative; /* of the diagonal; of the larger of the two derivatives */
} worst;

/* Coordinates at all scales: anywhere, close to either end, beside the middle. */
static double coordinate(qp_random *random) {
    const double x = qp_random_unit(random);
    switch (qp_random_below(random, 8)) {
    case 0:
        return ldexp(x, -(int)qp_random_below(random, 40));
    case 1:
        return 1 - ldexp(x, -(int)qp_random_below(random, 40));
    case 2:
        return nextafter(0.5, qp_random_below(random, 2));
    case 3:
        return qp_random_below(random, 2);
    default:
        return x;
    }
}

static double distance(const double a[3], const double b[3]) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

static double element(const qp_stream *s, const void *reals, size_t i) {
    return s->precision == QP_DOUBLE ? ((const double *)reals)[i] : (double)((const float *)reals)[i];
}

static void compare(const qp_mesh *mesh, const qp_stream *s, const double *uv, worst *w) {
    static const double zero[3];
    qp_error err;
    for (size_t i = 0; i < s->n_samples; ++i) {
        qp_reference_sample r;
        double p[3], d[2][3];
        if (!CHECK_OK(qp_reference_eval(mesh, mesh->positions, s->sample_patch[i], 1, uv + 2 * i, &r, &err),
                      err))
            return;
        for (size_t c = 0; c < 3; ++c) {
            p[c] = element(s, s->vertices, 6 * i + c);
            d[0][c] = element(s, s->derivatives, 6 * i + c);
            d[1][c] = element(s, s->derivatives, 6 * i + 3 + c);
        }
        ++w->samples;
        w->position = fmax(w->position, distance(p, r.p) / mesh->diagonal);
        if (s->flags[i] & QP_SAMPLE_LIMIT_FRAME) {
            ++w->frames;
            continue;
        }
        const double scale = fmax(distance(r.du, zero), distance(r.dv, zero));
        if (scale < 1e-3 * mesh->diagonal) continue;
        w->derivative = fmax(w->derivative, fmax(distance(d[0], r.du), distance(d[1], r.dv)) / scale);
    }
}

static void check_mesh(const char *kind, uint64_t seed, qp_device *device, worst totals[2]) {
    enum { N = 600 };
    static uint32_t patch[N];
    static double uv[2 * N];
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    const qp_generate_options generate = {.sharpness = -1, .seed = seed, .faces = 60};
    qp_random random = {seed};
    if (!CHECK_OK(qp_mesh_generate(kind, &generate, &mesh, &err), err)) return;
    /* Positions that float holds, so that both precisions have one reference. */
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; ++i)
        mesh->positions[i] = (double)(float)mesh->positions[i];
    if (CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        size_t n = 0;
        while (n < N) {
            const uint32_t p = qp_random_below(&random, mesh->n_patches);
            if (surface->patch_plan[p] == QP_NONE) continue;
            patch[n] = p;
            uv[2 * n] = coordinate(&random);
            uv[2 * n++ + 1] = coordinate(&random);
        }
        for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
            const qp_frame_options options = {.precision = (qp_precision)precision, .want_derivatives = 1};
            qp_frame *frame = NULL;
            qp_stream stream;
            if (CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err) &&
                CHECK_OK(qp_frame_eval_points(frame, N, patch, uv, &stream, &err), err))
                compare(mesh, &stream, uv, &totals[precision]);
            qp_frame_free(frame);
        }
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    static const char *const kinds[] = {"cube", "torus", "fan", "prism", "random-closed", "random-open"};
    const uint64_t seeds = CHECK_SANITIZED ? 1 : 6;
    qp_error err = {0};
    qp_device *device = NULL;
    worst totals[2] = {{0}};
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; ++k)
        for (uint64_t seed = 1; seed <= seeds; ++seed) check_mesh(kinds[k], seed, device, totals);
    for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
        const worst *w = &totals[precision];
        printf("%s: %llu samples, position %.3g of the diagonal, derivatives %.3g of the larger one; %llu "
               "limit frames\n",
               precision == QP_DOUBLE ? "double" : "float", (unsigned long long)w->samples, w->position,
               w->derivative, (unsigned long long)w->frames);
        CHECK(w->samples > 0 && w->position <= (precision == QP_DOUBLE ? 1e-13 : 3e-7));
        CHECK(w->derivative <= (precision == QP_DOUBLE ? 1e-12 : 1e-4) && w->frames > 0);
    }
    qp_device_free(device);
    return check_report();
}
