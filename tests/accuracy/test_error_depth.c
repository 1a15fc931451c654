/* Depth costs time, never accuracy: the same errors whatever level a surface's plans end at, with no sample past them. (u,v) = 2^-k
 * about every corner, k = 1..24; numbers that only floating point has; tessellations with tiny segments. */
#include "tests/accuracy/measure.h"

static qp_device *device;
static measure_sum sums[2];

static void judge(const char *name, const char *what, uint32_t depth, qp_precision precision, bool normals,
                  const qp_error_report *r) {
    if (normals) measure_add(&sums[precision], r);
    int good = CHECK(r->past_depth == 0);
    good = CHECK(r->position_max <= (precision == QP_DOUBLE ? 1e-13 : 3e-7)) && good;
    good = CHECK(r->nonfinite == 0) && good;
    if (normals) good = CHECK(r->normal_max_deg <= (precision == QP_DOUBLE ? 1e-5 : 0.01)) && good;
    if (good) return;
    printf("%s, %s, depth %u, %s: position %.3g at patch %u (%.17g, %.17g), normal %.3g at patch %u (%.17g, "
           "%.17g)\n",
           name, what, (unsigned)depth, precision == QP_DOUBLE ? "double" : "float", r->position_max,
           r->worst_patch, r->worst_u, r->worst_v, r->normal_max_deg, r->worst_normal_patch,
           r->worst_normal_u, r->worst_normal_v);
}

/* Coordinates close to both ends, far below 2^-24, and next to where quadtrees split; or where no plan reaches. */
static uint32_t odd_coordinates(bool past, double *out) {
    static const double offsets[] = {1e-10, 0x1p-40, 0x1.8p-50, 0x1p-53, 3e-20, 0x1p-61, 1e-30, 1e-37};
    uint32_t n = 0;
    out[n++] = 0;
    out[n++] = 1;
    for (size_t i = past ? 4 : 0; i < (past ? 8 : 4); ++i) {
        out[n++] = offsets[i];
        if (1 - (1 - offsets[i]) == offsets[i]) out[n++] = 1 - offsets[i];
    }
    for (int k = 1; k <= 2 && !past; ++k) {
        out[n++] = nextafter(ldexp(1, -k), 0);
        out[n++] = nextafter(ldexp(1, -k), 1);
        out[n++] = (double)nextafterf(ldexpf(1, -k), 0);
        out[n++] = (double)nextafterf(ldexpf(1, -k), 1);
    }
    return n;
}

/* Each patch at every pair of them, patches taking turns where that is too much. Past all levels normals are not judged: at high
 * valences the modes of a corner part slowly, and at valence 2 the reference itself runs out of digits there. */
static void check_odd_points(const char *name, const qp_surface *surface, qp_precision precision, bool past) {
    double at[64];
    const uint32_t n = odd_coordinates(past, at), n_patches = surface->mesh->n_patches;
    uint32_t *patch = qp_alloc((size_t)n * n * n_patches, sizeof *patch, false);
    double *uv = qp_alloc((size_t)n * n * n_patches, 2 * sizeof *uv, false);
    uint64_t count = 0;
    for (uint32_t p = 0; p < n_patches && CHECK(patch != NULL && uv != NULL); ++p) {
        if (surface->patch_plan[p] == QP_NONE) continue;
        for (uint32_t i = 0; i < n * n; ++i) {
            if (n_patches > 20 && (i + p) % 17 != 0) continue;
            patch[count] = p;
            uv[2 * count] = at[i % n];
            uv[2 * count++ + 1] = at[i / n];
        }
    }
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_frame_options options = {.precision = precision};
    qp_stream stream;
    qp_error_report r = {0};
    if (CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err) &&
        CHECK_OK(qp_frame_eval_points(frame, count, patch, uv, &stream, &err), err) &&
        CHECK_OK(qp_reference_compare(surface->mesh, &stream, uv, &r, &err), err))
        judge(name, past ? "past all levels" : "odd numbers", surface->options.depth, precision, !past, &r);
    qp_frame_free(frame);
    free(patch);
    free(uv);
}

static void check_mesh(const char *name, const qp_mesh *mesh, const qp_surface_options *options) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    if (!CHECK_OK(qp_surface_create(mesh, options, &surface, &err), err)) return;
    for (int precision = 0; precision < 2; ++precision) {
        const qp_tessellation tiny = {.spacing = QP_FRACTIONAL_ODD,
                                      .factor = options->depth == 10 ? 1.001f : 5.001f};
        qp_error_report r = {0};
        if (measure(surface, device, (qp_precision)precision, "corner", NULL, 0, 0, &r))
            judge(name, "corner", options->depth, (qp_precision)precision, true, &r);
        if (measure(surface, device, (qp_precision)precision, "grid", &tiny, 0, 0, &r))
            judge(name, "tiny segments", options->depth, (qp_precision)precision, true, &r);
        check_odd_points(name, surface, (qp_precision)precision, false);
        check_odd_points(name, surface, (qp_precision)precision, true);
    }
    qp_surface_free(surface);
}

static void check_generated(const char *kind, uint32_t n, uint64_t seed, const qp_surface_options *options) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_generate_options generate = {.n = {n, 0, 0}, .sharpness = -1.0, .seed = seed, .faces = 30};
    char name[64];
    snprintf(name, sizeof name, "%s %u seed %u", kind, n, (unsigned)seed);
    if (CHECK_OK(qp_mesh_generate(kind, &generate, &mesh, &err), err)) check_mesh(name, mesh, options);
    qp_mesh_free(mesh);
}

/* Where a frame has been shows in no bit of what it makes. */
static void check_history(void) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_generate_options generate = {.sharpness = -1.0, .seed = 3, .faces = 60};
    qp_surface_options options = {.depth = 3, .no_crease_nodes = 1};
    qp_frame_options frame_options = {.want_hash = 1};
    if (CHECK_OK(qp_mesh_generate("random-open", &generate, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, &options, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, &frame_options, &frame, &err), err)) {
        const qp_tessellation grids[] = {{.factor = 4}, {.factor = 5.001f, .spacing = QP_FRACTIONAL_ODD}};
        const double offsets[] = {0, 0x1p-30, 0x1p-55, 0x1p-14};
        uint64_t hash[6] = {0};
        for (int round = 0; round < 2; ++round) {
            qp_stream s;
            for (int k = 0; k < 2; ++k) {
                if (!CHECK_OK(qp_frame_eval(frame, &grids[k], &s, &err), err)) break;
                CHECK(round == 0 || hash[k] == s.hash);
                hash[k] = s.hash;
            }
            for (uint32_t k = 0; k < 4; ++k) {
                uint32_t patch[8];
                double uv[16];
                for (uint32_t i = 0; i < 8; ++i) {
                    patch[i] = i;
                    uv[2 * i] = offsets[k];
                    uv[2 * i + 1] = offsets[(k + i) % 4];
                    if (surface->patch_plan[i] == QP_NONE) patch[i] = 8;
                }
                if (!CHECK_OK(qp_frame_eval_points(frame, 8, patch, uv, &s, &err), err)) break;
                CHECK(round == 0 || hash[2 + k] == s.hash);
                hash[2 + k] = s.hash;
            }
        }
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    static const uint32_t depths[] = {1, 3, 6, 10}, valences[] = {3, 5, 7, 12, 40};
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    for (uint32_t d = 0; d < 4; ++d) {
        qp_surface_options options = {.depth = depths[d]};
        for (size_t v = 0; v < sizeof valences / sizeof *valences; ++v) {
            if ((v + d) % 2 != 0 || (CHECK_SANITIZED && valences[v] > 7)) continue;
            check_generated("fan", valences[v], 0, &options);
            check_generated("prism", valences[v], 0, &options);
        }
        /* The comparison switches too, in turn: deeper plans are made without them. */
        for (uint64_t seed = 0; seed < (CHECK_SANITIZED ? 1 : 3); ++seed) {
            options.no_crease_nodes = seed % 4 == 1;
            options.no_terminal_nodes = seed % 4 == 2;
            check_generated(seed % 2 ? "random-open" : "random-closed", 0, 100 * d + seed, &options);
        }
    }
    check_history();
    measure_print("float ", &sums[0]);
    measure_print("double", &sums[1]);
    qp_device_free(device);
    return check_report();
}
