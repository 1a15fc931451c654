/* Meshes for tests: the same faces and tags under other rules. */
#ifndef QP_TESTS_VARIANTS_H
#define QP_TESTS_VARIANTS_H

#include "host/mesh/mesh.h"

#include <math.h>
#include <stdlib.h>

enum { VARIANT_RULES = 12 };

/* A copy of mesh, from its tags as given, under rule set 0..11: boundary by rules % 3, crease method, triangle
 * rule. Finite sharpness above `limit` is folded below it. NULL when that fails; *err says why. */
static inline qp_mesh *variant_make(const qp_mesh *mesh, unsigned rules, float limit, qp_error *err) {
    uint32_t *sizes = qp_alloc(mesh->n_faces, sizeof *sizes, false);
    float *creases = qp_alloc(mesh->n_creases, sizeof *creases, false);
    float *corners = qp_alloc(mesh->n_corner_tags, sizeof *corners, false);
    qp_mesh *made = NULL;
    if (sizes && creases && corners) {
        for (uint32_t f = 0; f < mesh->n_faces; ++f) sizes[f] = qp_face_size(mesh, f);
        for (uint32_t i = 0; i < mesh->n_creases; ++i) {
            float s = mesh->crease_sharpness[i];
            creases[i] = s < QP_SHARPNESS_INFINITE && s > limit ? fmodf(s, limit) : s;
        }
        for (uint32_t i = 0; i < mesh->n_corner_tags; ++i) {
            float s = mesh->corner_tag_sharpness[i];
            corners[i] = s < QP_SHARPNESS_INFINITE && s > limit ? fmodf(s, limit) : s;
        }
        qp_mesh_desc d = {.n_vertices = mesh->n_vertices,
                          .n_faces = mesh->n_faces,
                          .positions = mesh->positions,
                          .face_sizes = sizes,
                          .face_vertices = mesh->face_vertices,
                          .n_creases = mesh->n_creases,
                          .crease_vertices = mesh->crease_vertices,
                          .crease_sharpness = creases,
                          .n_corners = mesh->n_corner_tags,
                          .corner_vertices = mesh->corner_tag_vertices,
                          .corner_sharpness = corners,
                          .n_holes = mesh->n_hole_tags,
                          .hole_faces = mesh->hole_tag_faces,
                          .boundary = (qp_boundary)(rules % 3),
                          .crease_method = (qp_crease_method)(rules / 3 % 2),
                          .triangle_rule = (qp_triangle_rule)(rules / 6 % 2)};
        if (qp_mesh_create(&d, &made, err) != QP_OK) made = NULL;
    } else {
        qp_fail(err, QP_SYSTEM, "out of memory");
    }
    free(sizes);
    free(creases);
    free(corners);
    return made;
}

/* Largest finite sharpness among the effective tags. */
static inline float variant_sharpest(const qp_mesh *mesh) {
    float most = 0;
    for (uint32_t e = 0; e < mesh->n_edges; ++e)
        if (mesh->edge_sharpness[e] < QP_SHARPNESS_INFINITE) most = fmaxf(most, mesh->edge_sharpness[e]);
    for (uint32_t v = 0; v < mesh->n_vertices; ++v)
        if (mesh->vertex_sharpness[v] < QP_SHARPNESS_INFINITE) most = fmaxf(most, mesh->vertex_sharpness[v]);
    return most;
}

#endif
