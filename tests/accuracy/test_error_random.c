/* Random meshes with random tags, under every boundary, crease and triangle rule, against the reference. 500 of them, of up to 60
 * faces; QUADPLAN_FULL=1: 1,000 of up to 200 faces, each at 20,000 points and at factor 16 in both precisions (six minutes of one core);
 * QUADPLAN_SEEDS=A-B picks others. */
#include "tests/accuracy/measure.h"

static measure_sum sums[2];

static void one(qp_device *device, const qp_surface *surface, unsigned seed, qp_precision precision,
                const char *set, float factor, uint64_t samples) {
    qp_error_report r = {0};
    qp_tessellation tessellation = {.spacing = (qp_spacing)(factor == 16.0f ? 0 : seed % 3),
                                    .factor = factor};
    if (!measure(surface, device, precision, set, &tessellation, samples, seed, &r)) return;
    measure_add(&sums[precision], &r);
    if (within_bounds(&r, precision)) return;
    printf("seed %u, %s, %s: position %.3g at patch %u (%.9g, %.9g), normal %.3g at patch %u (%.9g, %.9g)\n",
           seed, set, precision == QP_DOUBLE ? "double" : "float", r.position_max, r.worst_patch,
           (double)r.worst_u, (double)r.worst_v, r.normal_max_deg, r.worst_normal_patch,
           (double)r.worst_normal_u, (double)r.worst_normal_v);
}

static void one_seed(qp_device *device, unsigned seed, bool full) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_generate_options options = {.seed = seed, .sharpness = -1.0, .faces = full ? 200 : 60};
    const char *kind = seed % 2 == 0 ? "random-closed" : "random-open";
    if (CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        if (full || seed % 4 == 0) one(device, surface, seed, QP_FLOAT, "grid", 16.0f, 0);
        if (full || seed % 4 != 0) one(device, surface, seed, QP_FLOAT, "grid", 6.7f, 0);
        one(device, surface, seed, QP_FLOAT, "random", 0.0f, full ? 20000 : 400);
        if (full) one(device, surface, seed, QP_DOUBLE, "grid", 16.0f, 0);
        one(device, surface, seed, QP_DOUBLE, "grid", 3.4f, 0);
        one(device, surface, seed, QP_DOUBLE, "random", 0.0f, full ? 20000 : 400);
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    unsigned first = 0, last = check_full() ? 999 : CHECK_SANITIZED ? 39 : 499;
    const char *seeds = getenv("QUADPLAN_SEEDS");
    if (seeds != NULL && sscanf(seeds, "%u-%u", &first, &last) != 2) {
        fprintf(stderr, "QUADPLAN_SEEDS is to be A-B\n");
        return 1;
    }
    qp_error err = {0};
    qp_device *device = NULL;
    /* The host runs the kernels' own lines and needs no build for every mesh; unit.frame checks that OpenCL gives the same
     * bits. */
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    for (unsigned seed = first; seed <= last; ++seed) one_seed(device, seed, check_full());
    measure_print("float ", &sums[0]);
    measure_print("double", &sums[1]);
    qp_device_free(device);
    return check_report();
}
