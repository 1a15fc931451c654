/* The colours of triangles. */
#ifndef QP_GL_PALETTE_H
#define QP_GL_PALETTE_H

#include "host/plan/plan.h"
#include "host/scene/scene.h"

/* Connected pieces of a mesh, numbered by their first face: one entry a patch, to be freed with free(). */
qp_status qp_patch_components(const qp_mesh *mesh, uint32_t **component, qp_error *err);

/* Colour (linear light) of a triangle of the stream, as scene->colour_by asks. component: of each patch; needed
 * for QP_COLOUR_COMPONENT only. */
void qp_triangle_colour(const qp_scene *scene, const qp_surface *surface, const uint32_t *component,
                        const qp_stream *stream, const uint32_t triangle[3], float colour[3]);

/* The same where it is one a patch: 3 floats each, to be freed with free(). QP_BAD_INPUT for the kinds and levels of nodes, of
 * which a patch has several. */
qp_status qp_patch_colours(const qp_scene *scene, const qp_surface *surface, const uint32_t *component,
                           float **colours, qp_error *err);

#endif
