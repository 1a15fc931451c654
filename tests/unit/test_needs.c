/* Points make only those control points that their samples read: the same bits as with all of them, and nothing else is read. */
#include "host/frame/frame.h"
#include "tests/check.h"

#include <string.h>

static double unit(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) * 0x1p-53;
}

/* A coordinate: anywhere, near an end, at a dyadic place, or at an end. */
static double coordinate(uint64_t *seed) {
    const double kind = unit(seed), x = unit(seed);
    double near = ldexp(x, -(int)(unit(seed) * 20));
    if (kind < 0.3) return x;
    if (kind < 0.6) return near;
    if (kind < 0.8) return 1 - near;
    if (kind < 0.9) return floor(x * 16) / 16;
    return x < 0.5 ? 0 : 1;
}

/* A few points in each patch, now and then one alone. */
static uint64_t make_points(uint32_t n_patches, const qp_surface *surface, uint64_t seed, uint32_t *patch,
                            double *uv) {
    uint64_t n = 0;
    for (uint32_t p = 0; p < n_patches; ++p) {
        const uint32_t count = 1 + (uint32_t)(unit(&seed) * 5);
        for (uint32_t k = 0; k < count && surface->patch_plan[p] != QP_NONE; ++k, ++n) {
            patch[n] = p;
            uv[2 * n] = coordinate(&seed);
            uv[2 * n + 1] = coordinate(&seed);
        }
    }
    return n;
}

/* The stream as a copy: vertices and flags. Control points that are not made are NaN. */
static int evaluate(qp_device *host, const qp_surface *surface, const qp_frame_options *options, uint64_t n,
                    const uint32_t *patch, const double *uv, char **copy, size_t *bytes, uint64_t *points) {
    qp_frame *frame = NULL;
    qp_error err = {0};
    qp_stream s;
    const size_t sample = 6 * (options->precision == QP_DOUBLE ? sizeof(double) : sizeof(float));
    int good = CHECK_OK(qp_frame_create(host, surface, options, &frame, &err), err) &&
               CHECK_OK(qp_buffer_reserve(host, &frame->support, 32u << 20, "control points", &err), err);
    if (good) memset(frame->support.host, 0xff, frame->support.bytes);
    good = good && CHECK_OK(qp_frame_eval_points(frame, n, patch, uv, &s, &err), err) &&
           CHECK(frame->support.bytes == 32u << 20);
    if (good) {
        *bytes = (size_t)n * (sample + 1);
        *points = s.supports.points_needed;
        *copy = malloc(*bytes);
        good = CHECK(*copy != NULL);
        if (good) {
            memcpy(*copy, s.vertices, (size_t)n * sample);
            memcpy(*copy + (size_t)n * sample, s.flags, (size_t)n);
        }
    }
    qp_frame_free(frame);
    return good;
}

static void check_mesh(qp_device *host, const char *kind, const qp_generate_options *generate, uint32_t depth,
                       uint64_t seed, uint64_t sum[2]) {
    const qp_surface_options with_depth = {.depth = depth};
    const qp_frame_options options = {.precision = seed % 2 ? QP_DOUBLE : QP_FLOAT,
                                      .no_exact_tail = seed % 5 == 4};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_error err = {0};
    char *few = NULL, *all = NULL;
    size_t bytes[2] = {0, 1};
    uint64_t points[2] = {0, 0};
    if (CHECK_OK(qp_mesh_generate(kind, generate, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, &with_depth, &surface, &err), err)) {
        uint32_t *patch = malloc(6 * sizeof *patch * mesh->n_patches);
        double *uv = malloc(12 * sizeof *uv * mesh->n_patches);
        if (CHECK(patch != NULL && uv != NULL)) {
            const uint64_t n = make_points(mesh->n_patches, surface, seed, patch, uv);
            if (evaluate(host, surface, &options, n, patch, uv, &few, &bytes[0], &points[0])) {
                for (uint32_t p = 0; p < surface->n_plans; ++p)
                    for (uint32_t i = 0; i < QP_LEVELS; ++i)
                        surface->plans[p]->rows[i] = surface->plans[p]->corner_rows[i] =
                            surface->plans[p]->point_count;
                if (evaluate(host, surface, &options, n, patch, uv, &all, &bytes[1], &points[1]) &&
                    !CHECK(bytes[0] == bytes[1] && memcmp(few, all, bytes[0]) == 0))
                    fprintf(stderr, "    %s, depth %u, seed %llu\n", kind, depth, (unsigned long long)seed);
                sum[0] += points[0];
                sum[1] += points[1];
            }
        }
        free(patch);
        free(uv);
    }
    free(few);
    free(all);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    qp_device *host = NULL;
    qp_error err = {0};
    uint64_t sum[2] = {0, 0};
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    static const char *const kinds[] = {"random-closed", "random-open", "irregular", "creased-torus",
                                        "prism"};
    for (uint64_t seed = 0; seed < (CHECK_SANITIZED ? 10 : 50); ++seed) {
        const qp_generate_options generate = {
            .n = {5 + (uint32_t)seed % 9}, .seed = seed, .faces = 80, .sharpness = (double)(seed % 8) * 0.7};
        const uint32_t depth = seed % 3 == 0 ? 0 : seed % 3 == 1 ? 4 : 14;
        check_mesh(host, kinds[seed % 5], &generate, depth, seed, sum);
    }
    /* It is worth it. */
    CHECK(sum[0] < sum[1] / 8 * 7);
    printf("%llu of %llu control points\n", (unsigned long long)sum[0], (unsigned long long)sum[1]);
    qp_device_free(host);
    return check_report();
}
