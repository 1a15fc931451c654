/* Every manifold model against the extended-precision reference: the tessellator's points at factor 16 (more than 2,000 patches in
 * double: 5) and 20,000 anywhere, in float and double, on the default OpenCL device. QUADPLAN_FULL=1: factor 16 for all, and fractional_odd
 * factors and points about every corner too. */
#include "tests/accuracy/measure.h"
#include "tests/unit/mesh_files.h"

static qp_device *device;
static measure_sum sums[2];

static bool is_manifold(const qp_mesh *mesh) {
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        if (mesh->vertex_flags[v] & QP_VERTEX_NONMANIFOLD) return false;
    }
    return true;
}

static void one(const char *name, const qp_surface *surface, qp_precision precision, const char *set,
                const qp_tessellation *tessellation) {
    qp_error_report r = {0};
    if (!measure(surface, device, precision, set, tessellation, CHECK_SANITIZED ? 300 : 20000, 1, &r)) return;
    measure_add(&sums[precision], &r);
    if (within_bounds(&r, precision)) return;
    printf("%s, %s, %s: position %.3g at patch %u (%.9g, %.9g), normal %.3g at patch %u (%.9g, %.9g)\n", name,
           set, precision == QP_DOUBLE ? "double" : "float", r.position_max, r.worst_patch, r.worst_u,
           r.worst_v, r.normal_max_deg, r.worst_normal_patch, r.worst_normal_u, r.worst_normal_v);
}

static void visit(const char *name, qp_mesh *mesh) {
    if (!is_manifold(mesh)) {
        printf("%s: not manifold, left out\n", name);
        return;
    }
    qp_error err = {0};
    qp_surface *surface = NULL;
    if (!CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) return;
    const bool large = mesh->n_patches > 2000 && !check_full();
    for (int precision = 0; precision <= qp_device_has_double(device); ++precision) {
        const float factor = CHECK_SANITIZED ? 2.0f : large && precision == QP_DOUBLE ? 5.0f : 16.0f;
        const qp_tessellation equal = {.spacing = QP_EQUAL, .factor = factor},
                              odd = {.spacing = QP_FRACTIONAL_ODD, .factor = 5.7f};
        one(name, surface, (qp_precision)precision, "grid", &equal);
        one(name, surface, (qp_precision)precision, "random", NULL);
        if (check_full()) {
            one(name, surface, (qp_precision)precision, "grid", &odd);
            one(name, surface, (qp_precision)precision, "corner", NULL);
        }
    }
    qp_surface_free(surface);
}

int main(void) {
    const char *folder = check_models();
    if (folder == NULL) return check_skip_models();
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open(CHECK_SANITIZED ? "host" : NULL, &device, &err), err)) return check_report();
    char shapes[1024];
    snprintf(shapes, sizeof shapes, "%s/osd_shapes", folder);
    unsigned refused = 0;
    CHECK(visit_folder(folder, visit, &refused) > 0);
    CHECK(visit_folder(shapes, visit, &refused) > 0);
    measure_print("float ", &sums[0]);
    if (qp_device_has_double(device)) measure_print("double", &sums[1]);
    qp_device_free(device);
    return check_report();
}
