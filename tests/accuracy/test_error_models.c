/* Every manifold model against the extended-precision reference: the tessellator's points at factor 16 and 20,000 anywhere, in
 * float and double, on the default OpenCL device. */
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

static void visit(const char *name, qp_mesh *mesh) {
    if (!is_manifold(mesh)) {
        printf("%s: not manifold, left out\n", name);
        return;
    }
    qp_error err = {0};
    qp_surface *surface = NULL;
    if (!CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) return;
    qp_tessellation tessellation = {.spacing = QP_EQUAL, .factor = CHECK_SANITIZED ? 2.0f : 16.0f};
    for (int precision = 0; precision <= qp_device_has_double(device); ++precision) {
        for (int random = 0; random < 2; ++random) {
            qp_error_report r = {0};
            const char *set = random ? "random" : "grid";
            if (!measure(surface, device, (qp_precision)precision, set, &tessellation,
                         CHECK_SANITIZED ? 300 : 20000, 1, &r))
                continue;
            measure_add(&sums[precision], &r);
            if (within_bounds(&r, (qp_precision)precision)) continue;
            printf(
                "%s, %s, %s: position %.3g at patch %u (%.9g, %.9g), normal %.3g at patch %u (%.9g, %.9g)\n",
                name, set, precision ? "double" : "float", r.position_max, r.worst_patch, (double)r.worst_u,
                (double)r.worst_v, r.normal_max_deg, r.worst_normal_patch, (double)r.worst_normal_u,
                (double)r.worst_normal_v);
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
