/* Fuzz target: any bytes are a sound mesh or refused with one line. Run by tests/fuzz/standalone.c in ctest; for
 * libFuzzer build with clang, -DQUADPLAN_FUZZERS=ON -DQUADPLAN_SANITIZE=ON and -fsanitize=fuzzer-no-link in
 * CMAKE_C_FLAGS, and run libfuzz_obj on a copy of corpus/obj. */
#include "host/mesh/mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static void demand(bool good, const char *what) {
    if (good) return;
    fprintf(stderr, "fuzz_obj: %s\n", what);
    abort();
}

static void count_warning(void *context, const char *line) {
    ++*(unsigned *)context;
    demand(line[0] != '\0' && strpbrk(line, "\n\r") == NULL, "a warning is not one line");
}

static void check_mesh(const qp_mesh *m) {
    demand(m->n_faces > 0 && m->face_offsets[m->n_faces] == m->n_corners, "faces do not add up");
    for (uint32_t h = 0; h < m->n_corners; ++h) {
        const uint32_t twin = m->corner_twin[h];
        demand(m->face_vertices[h] < m->n_vertices && m->corner_edge[h] < m->n_edges,
               "an index is out of range");
        demand(twin == QP_NONE || (twin < m->n_corners && m->corner_twin[twin] == h), "twins do not match");
        demand(twin != QP_NONE || m->edge_flags[m->corner_edge[h]] != 0,
               "an interior edge lacks its other side");
    }
    for (uint32_t e = 0; e < m->n_edges; ++e) {
        demand(m->edge_sharpness[e] >= 0 && m->edge_sharpness[e] <= QP_SHARPNESS_INFINITE, "edge sharpness");
    }
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        demand(m->vertex_sharpness[v] >= 0 && m->vertex_sharpness[v] <= QP_SHARPNESS_INFINITE,
               "vertex sharpness");
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
    unsigned warnings = 0;
    qp_mesh_options options = {.warn = count_warning, .warn_context = &warnings};
    qp_mesh *mesh = NULL;
    qp_error err = {0};
    const qp_status status = qp_mesh_parse_obj("fuzz", (const char *)bytes, size, &options, &mesh, &err);
    demand(status == QP_OK || status == QP_BAD_INPUT, "neither good nor bad input");
    demand((status == QP_OK) == (mesh != NULL), "status and mesh disagree");
    if (status == QP_OK) {
        check_mesh(mesh);
    } else {
        demand(warnings == 0, "a warning about a mesh that is refused");
        demand(strncmp(err.message, "fuzz:", 5) == 0 && strpbrk(err.message, "\n\r") == NULL,
               "the message is not one line with the file's name");
    }
    qp_mesh_free(mesh);
    return 0;
}
