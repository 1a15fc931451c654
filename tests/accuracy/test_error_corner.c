/* (u,v) = 2^-k, k = 1..24, about every corner, at high valences, on a model and on random meshes: no sample is left out for depth.
 * QUADPLAN_FULL=1 takes 1,000 random meshes; QUADPLAN_SEEDS=A-B picks others. */
#include "tests/accuracy/measure.h"

static qp_device *device;
static measure_sum sums[2];

/* strict: the bound of normals holds for ill-conditioned tangents too. */
static void check_mesh(const char *name, const qp_mesh *mesh, bool strict) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    if (!CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) return;
    for (int precision = 0; precision < 2; ++precision) {
        qp_error_report r = {0};
        if (!measure(surface, device, (qp_precision)precision, "corner", NULL, 0, 0, &r)) continue;
        measure_add(&sums[precision], &r);
        int good = within_bounds(&r, (qp_precision)precision);
        if (precision == QP_DOUBLE) good = CHECK(r.normal_max_deg <= 1e-9) && good;
        if (strict) good = CHECK(r.ill_normal_max_deg <= (precision == QP_DOUBLE ? 1e-6 : 0.01)) && good;
        if (good) continue;
        printf(
            "%s, %s: position %.3g at patch %u (%.9g, %.9g), normal %.3g at patch %u (%.9g, %.9g), ill %.3g, "
            "over condition %.3g\n",
            name, precision ? "double" : "float", r.position_max, r.worst_patch, (double)r.worst_u,
            (double)r.worst_v, r.normal_max_deg, r.worst_normal_patch, (double)r.worst_normal_u,
            (double)r.worst_normal_v, r.ill_normal_max_deg, r.ill_normal_deg_per_condition);
    }
    qp_surface_free(surface);
}

static void check_generated(const char *kind, uint32_t n, unsigned seed, uint32_t faces, bool strict) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_generate_options options = {.n = {n, 0, 0}, .sharpness = -1.0, .seed = seed, .faces = faces};
    char name[64];
    snprintf(name, sizeof name, "%s %u seed %u faces %u", kind, n, seed, faces);
    if (CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err)) check_mesh(name, mesh, strict);
    qp_mesh_free(mesh);
}

static void check_rook(void) {
    char path[1024];
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    snprintf(path, sizeof path, "%s/rook.obj", check_models());
    if (CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err)) check_mesh("rook", mesh, true);
    qp_mesh_free(mesh);
}

int main(void) {
    static const uint32_t valences[] = {3, 5, 6, 7, 9, 16, 50, 200};
    unsigned first = 0, last = CHECK_SANITIZED ? 3 : 39;
    if (check_full()) last = 999;
    const char *seeds = getenv("QUADPLAN_SEEDS");
    if (seeds != NULL && sscanf(seeds, "%u-%u", &first, &last) != 2) {
        fprintf(stderr, "QUADPLAN_SEEDS is to be A-B\n");
        return 1;
    }
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    for (size_t v = 0; v < sizeof valences / sizeof *valences && seeds == NULL; ++v) {
        if (CHECK_SANITIZED && valences[v] > 16) continue;
        check_generated("fan", valences[v], 0, 0, true);
        check_generated("prism", valences[v] > 50 ? 50 : valences[v], 0, 0, true);
    }
    if (check_models() != NULL && !CHECK_SANITIZED && seeds == NULL) check_rook();
    for (unsigned seed = first; seed <= last; ++seed)
        check_generated(seed % 2 ? "random-open" : "random-closed", 0, seed, 20 + seed % 41, false);
    measure_print("float ", &sums[0]);
    measure_print("double", &sums[1]);
    qp_device_free(device);
    return check_report();
}
