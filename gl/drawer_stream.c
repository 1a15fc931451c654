#include "gl/drawers.h"
#include "gl/palette.h"
#include "gl/program.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { BATCH = 1 << 17 }; /* triangles that are sent at once */

/* One corner of a triangle as the vertex shader reads it. */
typedef struct corner {
    float position[3], normal[3], uv[2];
    uint8_t colour[4]; /* the square root of linear light, for which 8 bits are enough */
} corner;

typedef struct stream_drawer {
    qp_drawer base;
    qp_gl *gl;
    qp_drawn in;
    GLuint shadow_program, surface_program;
    GLuint points_array, corners_array;
    GLuint points, indices, corners; /* buffers */
    bool points_sent;
} stream_drawer;

static void fill_corners(const qp_drawn *in, uint64_t first, uint64_t count, corner *corners) {
    for (uint64_t t = first; t < first + count; t++) {
        const uint32_t *triangle = in->stream->triangles + 3 * t;
        float colour[3];
        uint8_t bytes[4] = {0, 0, 0, 255};
        qp_triangle_colour(in->scene, in->surface, in->components, in->stream, triangle, colour);
        for (int k = 0; k < 3; k++) bytes[k] = (uint8_t)(sqrtf(fminf(fmaxf(colour[k], 0), 1)) * 255 + 0.5f);
        for (int c = 0; c < 3; c++, corners++) {
            size_t sample = triangle[c];
            memcpy(corners->position, in->positions + 3 * sample, sizeof corners->position);
            for (size_t k = 0; k < 3; k++) corners->normal[k] = qp_drawn_number(in->stream, sample, 3 + k);
            memcpy(corners->uv, in->stream->uv + 2 * sample, sizeof corners->uv);
            memcpy(corners->colour, bytes, sizeof bytes);
        }
    }
}

static void attribute(qp_gl *gl, GLuint index, GLint size, GLenum type, size_t stride, size_t offset) {
    QP_GL(gl, EnableVertexAttribArray(index));
    QP_GL(gl, VertexAttribPointer(index, size, type, type == GL_UNSIGNED_BYTE, (GLsizei)stride,
                                  (const void *)(uintptr_t)offset));
}

/* Points and indices, which only shadows want. */
static void send_points(stream_drawer *d) {
    qp_gl *gl = d->gl;
    const qp_stream *stream = d->in.stream;
    QP_GL(gl, BindVertexArray(d->points_array));
    QP_GL(gl, BindBuffer(GL_ARRAY_BUFFER, d->points));
    QP_GL(gl, BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(stream->n_samples * 3 * sizeof(float)),
                         d->in.positions, GL_STATIC_DRAW));
    attribute(gl, 0, 3, GL_FLOAT, 3 * sizeof(float), 0);
    QP_GL(gl, BindBuffer(GL_ELEMENT_ARRAY_BUFFER, d->indices));
    QP_GL(gl, BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(stream->n_triangles * 3 * sizeof(uint32_t)),
                         stream->triangles, GL_STATIC_DRAW));
    d->points_sent = true;
}

static qp_status draw_shadow(stream_drawer *d, void (*set)(void *, GLuint), void *context, qp_error *err) {
    qp_gl *gl = d->gl;
    if (!d->points_sent) send_points(d);
    QP_GL(gl, UseProgram(d->shadow_program));
    set(context, d->shadow_program);
    QP_GL(gl, BindVertexArray(d->points_array));
    QP_GL(gl, DrawElements(GL_TRIANGLES, (GLsizei)(3 * d->in.stream->n_triangles), GL_UNSIGNED_INT, NULL));
    return qp_gl_status(gl, err);
}

static qp_status draw_surface(stream_drawer *d, void (*set)(void *, GLuint), void *context, qp_error *err) {
    qp_gl *gl = d->gl;
    QP_GL(gl, UseProgram(d->surface_program));
    set(context, d->surface_program);
    QP_GL(gl, BindVertexArray(d->corners_array));
    QP_GL(gl, BindBuffer(GL_ARRAY_BUFFER, d->corners));
    corner *corners = qp_alloc(3 * BATCH, sizeof *corners, false);
    if (corners == NULL) return qp_fail_memory(err, 3 * BATCH * sizeof *corners, "triangles to draw");
    for (uint64_t first = 0; first < d->in.stream->n_triangles; first += BATCH) {
        uint64_t left = d->in.stream->n_triangles - first, count = left < BATCH ? left : BATCH;
        fill_corners(&d->in, first, count, corners);
        QP_GL(gl, BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(3 * count * sizeof *corners), corners,
                             GL_STREAM_DRAW));
        QP_GL(gl, DrawArrays(GL_TRIANGLES, 0, (GLsizei)(3 * count)));
    }
    free(corners);
    return qp_gl_status(gl, err);
}

static qp_status draw(qp_drawer *drawer, qp_gl_pass pass, void (*set)(void *, GLuint), void *context,
                      qp_error *err) {
    stream_drawer *d = (stream_drawer *)drawer;
    return pass == QP_GL_PASS_SHADOW ? draw_shadow(d, set, context, err) : draw_surface(d, set, context, err);
}

static void close_drawer(qp_drawer *drawer) {
    stream_drawer *d = (stream_drawer *)drawer;
    qp_gl *gl = d->gl;
    if (d->shadow_program != 0) QP_GL(gl, DeleteProgram(d->shadow_program));
    if (d->surface_program != 0) QP_GL(gl, DeleteProgram(d->surface_program));
    const GLuint arrays[] = {d->points_array, d->corners_array},
                 buffers[] = {d->points, d->indices, d->corners};
    QP_GL(gl, DeleteVertexArrays(2, arrays)); /* 0 is ignored */
    QP_GL(gl, DeleteBuffers(3, buffers));
    free(d);
}

qp_status qp_drawer_stream(qp_gl *gl, const qp_drawn *drawn, qp_drawer **drawer, qp_error *err) {
    *drawer = NULL;
    if (drawn->stream->n_triangles > INT32_MAX / 3)
        return qp_fail(err, QP_BAD_INPUT, "too many triangles to draw (%llu)",
                       (unsigned long long)drawn->stream->n_triangles);
    stream_drawer *d = qp_alloc(1, sizeof *d, true);
    if (d == NULL) return qp_fail_memory(err, sizeof *d, "a surface to draw");
    d->base = (qp_drawer){draw, close_drawer};
    d->gl = gl;
    d->in = *drawn;
    const qp_gl_program_desc surface = {.vertex = "surface.vert.glsl", .fragment = "geometry.frag.glsl"},
                             shadow = {.vertex = "shadow.vert.glsl", .fragment = "shadow.frag.glsl"};
    qp_status status = qp_gl_make_program(gl, &surface, &d->surface_program, err);
    if (status == QP_OK) status = qp_gl_make_program(gl, &shadow, &d->shadow_program, err);
    QP_GL(gl, GenVertexArrays(1, &d->points_array));
    QP_GL(gl, GenVertexArrays(1, &d->corners_array));
    QP_GL(gl, GenBuffers(1, &d->points));
    QP_GL(gl, GenBuffers(1, &d->indices));
    QP_GL(gl, GenBuffers(1, &d->corners));
    QP_GL(gl, BindVertexArray(d->corners_array));
    QP_GL(gl, BindBuffer(GL_ARRAY_BUFFER, d->corners));
    attribute(gl, 0, 3, GL_FLOAT, sizeof(corner), offsetof(corner, position));
    attribute(gl, 1, 3, GL_FLOAT, sizeof(corner), offsetof(corner, normal));
    attribute(gl, 2, 2, GL_FLOAT, sizeof(corner), offsetof(corner, uv));
    attribute(gl, 3, 3, GL_UNSIGNED_BYTE, sizeof(corner), offsetof(corner, colour));
    if (status == QP_OK) status = qp_gl_status(gl, err);
    *drawer = &d->base;
    if (status != QP_OK) {
        close_drawer(*drawer);
        *drawer = NULL;
    }
    return status;
}
