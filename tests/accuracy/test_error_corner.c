/* (u,v) = 2^-k, k = 1..24, about every corner, at high valences, on a model and on random meshes: no sample is left out for depth, nor
 * from the bound of normals for tangents that are almost parallel. */
#include "tests/accuracy/measure.h"

static qp_device *device;
static measure_sum sums[2];

static void check_mesh(const char *name, const qp_mesh *mesh) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    if (!CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) return;
    for (int precision = 0; precision < 2; ++precision) {
        qp_error_report r = {0};
        if (!measure(surface, device, (qp_precision)precision, "corner", NULL, 0, 0, &r)) continue;
        measure_add(&sums[precision], &r);
        int good = CHECK(r.past_depth == 0);
        good = CHECK(r.position_max <= (precision == QP_DOUBLE ? 1e-13 : 3e-7)) && good;
        good = CHECK(r.nonfinite == 0) && good;
        good = CHECK(fmax(r.normal_max_deg, r.parallel_normal_max_deg) <=
                     (precision == QP_DOUBLE ? 1e-6 : 0.01)) &&
               good;
        if (good) continue;
        printf("%s, %s: position %.3g at patch %u (%.9g, %.9g), normal %.3g at patch %u (%.9g, %.9g)\n", name,
               precision ? "double" : "float", r.position_max, r.worst_patch, (double)r.worst_u,
               (double)r.worst_v, r.normal_max_deg, r.worst_normal_patch, (double)r.worst_normal_u,
               (double)r.worst_normal_v);
    }
    qp_surface_free(surface);
}

static void check_generated(const char *kind, uint32_t n, uint64_t seed) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_generate_options options = {.n = {n, 0, 0}, .sharpness = -1.0, .seed = seed, .faces = 60};
    char name[64];
    snprintf(name, sizeof name, "%s %u seed %u", kind, n, (unsigned)seed);
    if (CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err)) check_mesh(name, mesh);
    qp_mesh_free(mesh);
}

int main(void) {
    static const uint32_t valences[] = {3, 5, 6, 7, 9, 16, 50, 200};
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    for (size_t v = 0; v < sizeof valences / sizeof *valences; ++v) {
        if (CHECK_SANITIZED && valences[v] > 16) continue;
        check_generated("fan", valences[v], 0);
        check_generated("prism", valences[v] > 50 ? 50 : valences[v], 0);
    }
    for (uint64_t seed = 0; seed < (CHECK_SANITIZED ? 4 : 40); ++seed) {
        check_generated(seed % 2 ? "random-open" : "random-closed", 0, seed);
    }
    if (check_models() != NULL && !CHECK_SANITIZED) {
        char path[1024];
        qp_mesh *mesh = NULL;
        snprintf(path, sizeof path, "%s/rook.obj", check_models());
        if (CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err)) check_mesh("rook", mesh);
        qp_mesh_free(mesh);
    }
    measure_print("float ", &sums[0]);
    measure_print("double", &sums[1]);
    qp_device_free(device);
    return check_report();
}
