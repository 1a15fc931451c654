#include "gl/drawers.h"
#include "gl/palette.h"
#include "gl/tessellation.h"

#include <stdlib.h>

typedef struct tessellation_drawer {
    qp_drawer base;
    qp_gl *gl;
    qp_gl_surface *surface;
} tessellation_drawer;

static qp_status draw(qp_drawer *drawer, qp_gl_pass pass, void (*set)(void *, GLuint), void *context,
                      qp_error *err) {
    tessellation_drawer *d = (tessellation_drawer *)drawer;
    qp_status status = QP_OK;
    for (int kind = 0; kind < QP_GL_KINDS && status == QP_OK; ++kind) {
        GLuint program;
        if (qp_gl_surface_is_empty(d->surface, kind)) continue;
        status = qp_gl_surface_program(d->surface, pass, kind, &program, err);
        if (status != QP_OK) break;
        QP_GL(d->gl, UseProgram(program));
        set(context, program);
        status = qp_gl_surface_draw(d->surface, pass, kind, err);
    }
    return status;
}

static void close_drawer(qp_drawer *drawer) {
    tessellation_drawer *d = (tessellation_drawer *)drawer;
    qp_gl_surface_close(d->surface);
    free(d);
}

qp_status qp_drawer_tessellation(qp_gl *gl, const qp_drawn *drawn, qp_drawer **drawer, qp_error *err) {
    *drawer = NULL;
    float *colours = NULL;
    qp_status status = qp_patch_colours(drawn->scene, drawn->surface, drawn->components, &colours, err);
    if (status != QP_OK) return status;
    tessellation_drawer *d = qp_alloc(1, sizeof *d, true);
    if (d == NULL) status = qp_fail_memory(err, sizeof *d, "a surface to draw");
    if (status == QP_OK) {
        d->base = (qp_drawer){draw, close_drawer};
        d->gl = gl;
        status = qp_gl_surface_open(gl, drawn->frame, drawn->tessellation, colours, &d->surface, err);
    }
    free(colours);
    if (status == QP_OK)
        *drawer = &d->base;
    else
        free(d);
    return status;
}
