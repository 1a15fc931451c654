/* The same faces and tags under other rules. */
#include "host/mesh/mesh.h"

#include <stdlib.h>

qp_status qp_mesh_apply_options(qp_mesh **mesh, const qp_mesh_options *options, qp_error *err) {
    if (!options->override_boundary && !options->override_crease_method && !options->override_triangle_rule) {
        return QP_OK;
    }
    qp_mesh *m = *mesh;
    uint32_t *sizes = qp_alloc(m->n_faces, sizeof *sizes, false);
    if (sizes == NULL) return qp_fail_memory(err, m->n_faces * sizeof *sizes, "face sizes");
    for (uint32_t f = 0; f < m->n_faces; ++f) sizes[f] = qp_face_size(m, f);
    qp_mesh_desc desc = {
        .n_vertices = m->n_vertices,
        .n_faces = m->n_faces,
        .positions = m->positions,
        .face_sizes = sizes,
        .face_vertices = m->face_vertices,
        .n_creases = m->n_creases,
        .crease_vertices = m->crease_vertices,
        .crease_sharpness = m->crease_sharpness,
        .n_corners = m->n_corner_tags,
        .corner_vertices = m->corner_tag_vertices,
        .corner_sharpness = m->corner_tag_sharpness,
        .n_holes = m->n_hole_tags,
        .hole_faces = m->hole_tag_faces,
        .boundary = options->override_boundary ? options->boundary : m->boundary,
        .crease_method = options->override_crease_method ? options->crease_method : m->crease_method,
        .triangle_rule = options->override_triangle_rule ? options->triangle_rule : m->triangle_rule,
    };
    qp_mesh *remade = NULL;
    qp_status status = qp_mesh_create(&desc, &remade, err);
    free(sizes);
    if (status != QP_OK) return status;
    qp_mesh_free(m);
    *mesh = remade;
    return QP_OK;
}
