/* Normals where the surface is degenerate: always finite and of length 1; flagged unless they are the limit from within the patch,
 * which the reference, evaluated a little way in, has to confirm. */
#include "host/base/random.h"
#include "host/plan/plan.h"
#include "host/reference/reference.h"
#include "tests/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 900 };
static uint32_t patches[N];
static double uvs[2 * N];

typedef struct tally {
    uint64_t samples, flagged, limits; /* limits: found where du x dv is 0 in the reference */
    double limit_deg, plain_deg;       /* worst of those, and of well-conditioned ordinary ones */
} tally;

static double angle(const double a[3], const double b[3]) {
    const double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return atan2(sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) *
           57.29577951308232;
}

/* Worst angle to the reference's normals a step into the patch, in both directions and both together. */
static double angle_within(const qp_mesh *mesh, uint32_t patch, const double *uv, const double n[3]) {
    const double step = 1e-5;
    double worst = 0;
    for (int k = 1; k < 4; ++k) {
        qp_reference_sample r;
        qp_error err;
        double at[2];
        for (int c = 0; c < 2; ++c) at[c] = uv[c] + (k & (1 << c) ? (uv[c] < 0.5 ? step : -step) : 0);
        if (!CHECK_OK(qp_reference_eval(mesh, mesh->positions, patch, 1, at, &r, &err), err)) return 180;
        if (r.normal_defined) worst = fmax(worst, angle(n, r.n));
    }
    return worst;
}

static void check_stream(const qp_mesh *mesh, const qp_stream *s, tally *t) {
    for (uint64_t i = 0; i < s->n_samples; ++i) {
        double n[3], square = 0;
        for (uint64_t c = 0; c < 3; ++c) {
            n[c] = s->precision == QP_DOUBLE ? ((const double *)s->vertices)[6 * i + 3 + c]
                                             : (double)((const float *)s->vertices)[6 * i + 3 + c];
            square += n[c] * n[c];
        }
        CHECK(fabs(square - 1) < 1e-6);
        ++t->samples;
        if (s->flags[i] & QP_SAMPLE_NO_NORMAL) {
            ++t->flagged;
            continue;
        }
        qp_reference_sample r;
        qp_error err;
        if (!CHECK_OK(qp_reference_eval(mesh, mesh->positions, patches[i], 1, uvs + 2 * i, &r, &err), err))
            return;
        if (r.condition < QP_WELL_CONDITIONED) t->plain_deg = fmax(t->plain_deg, angle(n, r.n));
        if (r.normal_defined || s->flags[i] & QP_SAMPLE_LIMIT_FRAME) continue;
        ++t->limits;
        t->limit_deg = fmax(t->limit_deg, angle_within(mesh, patches[i], uvs + 2 * i, n));
    }
}

static void check_mesh(const qp_mesh *mesh, qp_device *device, tally totals[2]) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    qp_random random = {7};
    if (!CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) return;
    for (size_t i = 0; i < N; ++i) {
        do patches[i] = qp_random_below(&random, mesh->n_patches);
        while (surface->patch_plan[patches[i]] == QP_NONE);
        for (size_t c = 0; c < 2; ++c) {
            const uint32_t kind = qp_random_below(&random, 4);
            uvs[2 * i + c] = kind < 2 ? kind : qp_random_unit(&random);
        }
    }
    for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
        /* Each patch by itself: a shared normal is the limit from within its owner. */
        const qp_frame_options options = {.precision = (qp_precision)precision, .no_sharing = 1};
        for (int slow = 0; slow < 2; ++slow) {
            qp_frame_options o = options;
            qp_frame *frame = NULL;
            qp_stream stream;
            o.no_regular_pass = slow;
            if (CHECK_OK(qp_frame_create(device, surface, &o, &frame, &err), err) &&
                CHECK_OK(qp_frame_eval_points(frame, N, patches, uvs, &stream, &err), err))
                check_stream(mesh, &stream, &totals[precision]);
            qp_frame_free(frame);
        }
    }
    qp_surface_free(surface);
}

static void report(const char *name, const tally totals[2]) {
    for (int p = QP_FLOAT; p <= QP_DOUBLE; ++p)
        printf("%s, %s: %llu samples, %llu flagged; %llu limits of normals, off by up to %.3g degrees; "
               "others %.3g\n",
               name, p == QP_DOUBLE ? "double" : "float", (unsigned long long)totals[p].samples,
               (unsigned long long)totals[p].flagged, (unsigned long long)totals[p].limits,
               totals[p].limit_deg, totals[p].plain_deg);
}

/* A cap whose inner boundary is pulled together into one point: du vanishes along an edge of every inner patch. */
static void test_pole(qp_device *device) {
    enum { SECTORS = 7, RINGS = 5 };
    double positions[3 * SECTORS * RINGS];
    uint32_t sizes[SECTORS * (RINGS - 1)], vertices[4 * SECTORS * (RINGS - 1)];
    for (uint32_t r = 0; r < RINGS; ++r)
        for (uint32_t s = 0; s < SECTORS; ++s) {
            const double t = 2 * 3.14159265358979 * s / SECTORS;
            double *p = positions + 3 * (r * SECTORS + s);
            p[0] = (double)(float)(r * cos(t) + 0.25);
            p[1] = (double)(float)(r * sin(t) - 3);
            p[2] = (double)(float)(-0.1 * r * r);
            if (r == 0) p[0] = 0.25, p[1] = -3;
        }
    for (uint32_t r = 0; r + 1 < RINGS; ++r)
        for (uint32_t s = 0; s < SECTORS; ++s) {
            const uint32_t f = r * SECTORS + s, next = r * SECTORS + (s + 1) % SECTORS;
            const uint32_t quad[4] = {f, f + SECTORS, next + SECTORS, next};
            sizes[f] = 4;
            memcpy(vertices + 4 * f, quad, sizeof quad);
        }
    const qp_mesh_desc desc = {.n_vertices = SECTORS * RINGS,
                               .n_faces = SECTORS * (RINGS - 1),
                               .positions = positions,
                               .face_sizes = sizes,
                               .face_vertices = vertices,
                               .boundary = QP_BOUNDARY_EDGE_ONLY};
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    tally totals[2] = {{0}};
    if (CHECK_OK(qp_mesh_create(&desc, &mesh, &err), err)) check_mesh(mesh, device, totals);
    report("pole", totals);
    for (int p = QP_FLOAT; p <= QP_DOUBLE; ++p) CHECK(totals[p].limits > 100 && totals[p].limit_deg < 0.02);
    qp_mesh_free(mesh);
}

/* Meshes whose vertices fall together: in groups, on a line, in one point, in a plane. */
static void test_collapsed(qp_device *device) {
    static const char *const names[] = {"groups", "line", "point", "plane"};
    const uint64_t seeds = CHECK_SANITIZED ? 1 : 4;
    for (int how = 0; how < 4; ++how) {
        tally totals[2] = {{0}};
        for (uint64_t seed = 1; seed <= seeds; ++seed) {
            const qp_generate_options generate = {.sharpness = -1, .seed = seed, .faces = 50};
            qp_error err = {0};
            qp_mesh *mesh = NULL;
            if (!CHECK_OK(qp_mesh_generate("random-open", &generate, &mesh, &err), err)) continue;
            for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
                double *p = mesh->positions + 3 * v;
                const double *to = mesh->positions + 3 * (how == 0 ? v - v % 5 : 0);
                for (int c = 0; c < 3; ++c) {
                    p[c] = (double)(float)p[c];
                    if (how == 0 || how == 2 || (how == 1 && c > 0) || (how == 3 && c == 1)) p[c] = to[c];
                }
            }
            check_mesh(mesh, device, totals);
            qp_mesh_free(mesh);
        }
        report(names[how], totals);
        for (int p = QP_FLOAT; p <= QP_DOUBLE; ++p) {
            CHECK(totals[p].samples > 0 && totals[p].limit_deg < 0.5);
            if (how == 1 || how == 2) CHECK(totals[p].flagged == totals[p].samples);
            CHECK(totals[p].plain_deg < (p == QP_FLOAT ? 0.5 : 1e-6));
        }
    }
}

int main(void) {
    qp_error err = {0};
    qp_device *device = NULL;
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    test_pole(device);
    test_collapsed(device);
    qp_device_free(device);
    return check_report();
}
