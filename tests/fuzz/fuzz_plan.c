/* Fuzz target: the plans of any mesh that an OBJ file can hold, however odd its topology and tags. */
#include "host/plan/plan.h"

#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
    enum { FACES = 64, DEPTH = 3 }; /* small, so that many meshes are tried */
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    if (qp_mesh_parse_obj("fuzz", (const char *)bytes, size, NULL, &mesh, NULL) != QP_OK) return 0;
    if (mesh->n_faces <= FACES) {
        const qp_surface_options options = {.depth = DEPTH};
        qp_error err = {0};
        const qp_status status = qp_surface_create(mesh, &options, &surface, &err);
        if (status != QP_OK && status != QP_BAD_INPUT) {
            fprintf(stderr, "fuzz_plan: %s\n", err.message);
            abort();
        }
        qp_surface_free(surface);
    }
    qp_mesh_free(mesh);
    return 0;
}
