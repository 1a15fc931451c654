#include "gl/capture.h"
#include "gl/program.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Factor 64 everywhere: 2 * 63 * 63 + 256 triangles; one more to see an overflow. */
enum { MAX_TRIANGLES = 2 * 63 * 63 + 256 + 1, BUFFER_FLOATS = MAX_TRIANGLES * 6 };

static const char *const spacing_names[3] = {"equal_spacing", "fractional_even_spacing",
                                             "fractional_odd_spacing"};

qp_status qp_gl_capture_open(qp_gl *gl, qp_gl_capture *capture, qp_error *err) {
    memset(capture, 0, sizeof *capture);
    capture->gl = gl;
    QP_GL(gl, GenVertexArrays(1, &capture->vertex_array));
    QP_GL(gl, GenBuffers(1, &capture->buffer));
    QP_GL(gl, GenQueries(1, &capture->query));
    QP_GL(gl, BindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, capture->buffer));
    QP_GL(gl, BufferData(GL_TRANSFORM_FEEDBACK_BUFFER, BUFFER_FLOATS * sizeof(float), NULL, GL_STATIC_READ));
    QP_GL(gl, GenFramebuffers(1, &capture->framebuffer));
    QP_GL(gl, GenRenderbuffers(1, &capture->renderbuffer));
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, capture->framebuffer));
    QP_GL(gl, BindRenderbuffer(GL_RENDERBUFFER, capture->renderbuffer));
    QP_GL(gl, RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 16, 16));
    QP_GL(gl, FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                      capture->renderbuffer));
    return qp_gl_status(gl, err);
}

void qp_gl_capture_close(qp_gl_capture *capture) {
    qp_gl *gl = capture->gl;
    if (gl == NULL) return;
    for (int s = 0; s < 3; s++)
        for (int p = 0; p < 2; p++)
            if (capture->program[s][p] != 0) QP_GL(gl, DeleteProgram(capture->program[s][p]));
    QP_GL(gl, DeleteVertexArrays(1, &capture->vertex_array));
    QP_GL(gl, DeleteBuffers(1, &capture->buffer));
    QP_GL(gl, DeleteQueries(1, &capture->query));
    QP_GL(gl, DeleteFramebuffers(1, &capture->framebuffer));
    QP_GL(gl, DeleteRenderbuffers(1, &capture->renderbuffer));
    memset(capture, 0, sizeof *capture);
}

static qp_status need_program(qp_gl_capture *capture, qp_spacing spacing, bool points, qp_error *err) {
    if (capture->program[spacing][points] != 0) return QP_OK;
    char defines[160];
    snprintf(defines, sizeof defines, "#define LAYOUT quads, %s, ccw%s\n", spacing_names[spacing],
             points ? ", point_mode" : "");
    static const char *const varyings[] = {"uv"};
    qp_gl_program_desc desc = {.vertex = "capture.vert.glsl",
                               .tess_control = "capture.tesc.glsl",
                               .tess_evaluation = "capture.tese.glsl",
                               .defines = defines,
                               .capture = varyings,
                               .capture_count = 1};
    return qp_gl_make_program(capture->gl, &desc, &capture->program[spacing][points], err);
}

/* Draws the patch and reads what was captured: (u,v) of each point, or of each triangle's vertices. */
static qp_status capture_once(qp_gl_capture *capture, qp_spacing spacing, bool points, const float outer[4],
                              const float inner[2], uint32_t *count, float **uv, qp_error *err) {
    qp_gl *gl = capture->gl;
    qp_status status = need_program(capture, spacing, points, err);
    if (status != QP_OK) return status;
    GLuint program = capture->program[spacing][points];
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, capture->framebuffer));
    QP_GL(gl, BindVertexArray(capture->vertex_array));
    QP_GL(gl, UseProgram(program));
    QP_GL(gl, Uniform4f(gl->GetUniformLocation(program, "outer"), outer[0], outer[1], outer[2], outer[3]));
    QP_GL(gl, Uniform2f(gl->GetUniformLocation(program, "inner"), inner[0], inner[1]));
    QP_GL(gl, PatchParameteri(GL_PATCH_VERTICES, 1));
    QP_GL(gl, Enable(GL_RASTERIZER_DISCARD));
    QP_GL(gl, BindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, capture->buffer));
    QP_GL(gl, BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, capture->buffer));
    QP_GL(gl, BeginQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, capture->query));
    QP_GL(gl, BeginTransformFeedback(points ? GL_POINTS : GL_TRIANGLES));
    QP_GL(gl, DrawArrays(GL_PATCHES, 0, 1));
    QP_GL(gl, EndTransformFeedback());
    QP_GL(gl, EndQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN));
    QP_GL(gl, Disable(GL_RASTERIZER_DISCARD));
    GLuint written = 0;
    QP_GL(gl, GetQueryObjectuiv(capture->query, GL_QUERY_RESULT, &written));
    status = qp_gl_status(gl, err);
    if (status != QP_OK) return status;
    size_t floats = (size_t)written * (points ? 2 : 6);
    if (floats >= BUFFER_FLOATS)
        return qp_fail(err, QP_SYSTEM, "GL made more than %d triangles of a patch", MAX_TRIANGLES - 1);
    *uv = qp_alloc(floats, sizeof(float), false);
    if (*uv == NULL) return qp_fail_memory(err, floats * sizeof(float), "captured points");
    *count = written;
    if (floats > 0)
        QP_GL(gl,
              GetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, (GLsizeiptr)(floats * sizeof(float)), *uv));
    return qp_gl_status(gl, err);
}

qp_status qp_gl_capture_quad(qp_gl_capture *capture, qp_spacing spacing, const float outer[4],
                             const float inner[2], qp_gl_captured *captured, qp_error *err) {
    memset(captured, 0, sizeof *captured);
    qp_status status = capture_once(capture, spacing, false, outer, inner, &captured->n_triangles,
                                    &captured->triangles, err);
    if (status == QP_OK)
        status =
            capture_once(capture, spacing, true, outer, inner, &captured->n_points, &captured->points, err);
    if (status != QP_OK) qp_gl_captured_free(captured);
    return status;
}

void qp_gl_captured_free(qp_gl_captured *captured) {
    free(captured->points);
    free(captured->triangles);
    memset(captured, 0, sizeof *captured);
}
