#include "gl/render.h"
#include "gl/drawers.h"
#include "gl/palette.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What the shaders and the palette index must be there. */
static qp_status check_stream(const qp_surface *surface, const qp_stream *stream, qp_error *err) {
    if (stream->n_samples == 0 || stream->n_triangles == 0)
        return qp_fail(err, QP_BAD_INPUT, "there is nothing to draw: the surface has no triangles");
    if (stream->triangles == NULL || stream->uv == NULL || stream->sample_patch == NULL)
        return qp_fail(err, QP_BAD_INPUT, "a vertex stream without triangles cannot be drawn");
    for (uint64_t k = 0; k < 3 * stream->n_triangles; k++)
        if (stream->triangles[k] >= stream->n_samples)
            return qp_fail(err, QP_BAD_INPUT, "triangle %llu of the stream has a corner that is no sample",
                           (unsigned long long)(k / 3));
    for (uint64_t k = 0; k < stream->n_samples; k++)
        if (stream->sample_patch[k] >= surface->mesh->n_patches)
            return qp_fail(err, QP_BAD_INPUT, "sample %llu of the stream lies on no patch of the surface",
                           (unsigned long long)k);
    return QP_OK;
}

/* The stream's positions as floats in *positions, malloced. */
static qp_status take_positions(const qp_stream *stream, float **positions, qp_error *err) {
    uint64_t n = stream->n_samples;
    *positions = qp_alloc(n, 3 * sizeof(float), false);
    if (*positions == NULL) return qp_fail_memory(err, n * 3 * sizeof(float), "positions");
    for (uint64_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) {
            float x = qp_drawn_number(stream, i, k);
            if (!isfinite(x))
                return qp_fail(err, QP_CHECK_FAILED, "sample %llu on patch %u is not finite",
                               (unsigned long long)i, stream->sample_patch[i]);
            (*positions)[3 * i + k] = x;
        }
    return QP_OK;
}

/* Linear up to 0.7, then rolled off so that highlights keep their shape; to an sRGB byte. */
static uint8_t display(float x) {
    if (!(x > 0)) return 0;
    if (x > 0.7f) x = 0.7f + 0.3f * (1 - expf((0.7f - x) / 0.3f));
    float s = x <= 0.0031308f ? 12.92f * x : 1.055f * powf(x, 1 / 2.4f) - 0.055f;
    return (uint8_t)(fminf(s, 1) * 255 + 0.5f);
}

static void to_bytes(qp_image *image) {
    size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++) {
        const float *in = image->rgba_f + 4 * i;
        float alpha = fminf(fmaxf(in[3], 0), 1);
        for (int k = 0; k < 3; k++) image->rgba[4 * i + (size_t)k] = alpha > 0 ? display(in[k] / alpha) : 0;
        image->rgba[4 * i + 3] = (uint8_t)(alpha * 255 + 0.5f);
    }
}

static qp_status open_drawer(qp_gl *gl, qp_backend backend, const qp_drawn *drawn, qp_drawer **drawer,
                             qp_error *err) {
    return backend == QP_BACKEND_TESSELLATION ? qp_drawer_tessellation(gl, drawn, drawer, err)
                                              : qp_drawer_stream(gl, drawn, drawer, err);
}

qp_status qp_render(const qp_scene *scene, const qp_frame *frame, const qp_tessellation *tessellation,
                    const qp_stream *stream, qp_backend backend, qp_image *out, char backend_used[128],
                    qp_error *err) {
    memset(out, 0, sizeof *out);
    backend_used[0] = '\0';
    float *positions = NULL;
    uint32_t *components = NULL;
    qp_gl *gl = NULL;
    qp_drawer *drawer = NULL;
    qp_view view;
    qp_status status = check_stream(frame->surface, stream, err);
    if (status == QP_OK) status = take_positions(stream, &positions, err);
    if (status == QP_OK && scene->colour_by == QP_COLOUR_COMPONENT)
        status = qp_patch_components(frame->surface->mesh, &components, err);
    if (status == QP_OK) status = qp_image_create(scene->width, scene->height, out, err);
    if (status == QP_OK) status = qp_gl_open(&gl, err);
    const qp_drawn drawn = {scene, frame, frame->surface, tessellation, stream, positions, components};
    if (status == QP_OK) status = open_drawer(gl, backend, &drawn, &drawer, err);
    if (status == QP_OK) {
        snprintf(backend_used, 128, "%s", gl->backend);
        qp_view_make(scene, positions, stream->n_samples, &view);
        const qp_draw_input input = {scene, &view, stream->n_triangles, drawer};
        status = qp_gl_draw(gl, &input, out->rgba_f, err);
    }
    if (status == QP_OK) to_bytes(out);
    if (status != QP_OK) qp_image_free(out);
    if (drawer != NULL) drawer->close(drawer);
    qp_gl_close(gl);
    free(positions);
    free(components);
    return status;
}
