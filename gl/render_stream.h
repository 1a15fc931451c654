/* A picture of a vertex stream, as a scene asks for it. */
#ifndef QP_GL_RENDER_STREAM_H
#define QP_GL_RENDER_STREAM_H

#include "host/plan/plan.h"
#include "host/scene/image.h"
#include "host/scene/scene.h"

/* Draws stream, which needs its triangles, with 4x multisampling into *out (created here; qp_image_free it).
 * The GL comes from OSMesa or else EGL without a surface; environment variable QUADPLAN_GL=osmesa|egl insists
 * on one. backend_used names it, with its version and renderer. QP_SYSTEM when there is no such GL or it
 * fails, QP_BAD_INPUT when the stream does not fit the surface. */
qp_status qp_render_stream(const qp_scene *scene, const qp_surface *surface, const qp_stream *stream,
                           qp_image *out, char backend_used[128], qp_error *err);

#endif
