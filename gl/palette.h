/* The colours of triangles. */
#ifndef QP_GL_PALETTE_H
#define QP_GL_PALETTE_H

#include "host/plan/plan.h"
#include "host/scene/scene.h"

/* Colour (linear light) of a triangle of the stream, as scene->colour_by asks; surface may be NULL for
 * material, patch and normal. */
void qp_triangle_colour(const qp_scene *scene, const qp_surface *surface, const qp_stream *stream,
                        const uint32_t triangle[3], float colour[3]);

#endif
