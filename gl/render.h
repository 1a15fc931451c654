/* A picture of a surface, as a scene asks for it. */
#ifndef QP_GL_RENDER_H
#define QP_GL_RENDER_H

#include "host/frame/frame.h"
#include "host/scene/image.h"
#include "host/scene/scene.h"

typedef enum qp_backend {
    QP_BACKEND_STREAM,      /* the triangles of the vertex stream */
    QP_BACKEND_TESSELLATION /* the plans, by GL's own tessellator and shaders */
} qp_backend;

/* Draws a surface with 4x multisampling into *out (created here; qp_image_free it). stream: what qp_frame_eval made of the frame with
 * this tessellation; it needs its triangles. All back ends share its camera, lights and materials.
 * The GL comes from OSMesa or else EGL without a surface; environment variable QUADPLAN_GL=osmesa|egl insists on one. backend_used names
 * it, with its version and renderer. QP_SYSTEM when there is no such GL or it fails, QP_BAD_INPUT when the stream does not fit
 * the surface, or the back end cannot colour as the scene asks. */
qp_status qp_render(const qp_scene *scene, const qp_frame *frame, const qp_tessellation *tessellation,
                    const qp_stream *stream, qp_backend backend, qp_image *out, char backend_used[128],
                    qp_error *err);

#endif
