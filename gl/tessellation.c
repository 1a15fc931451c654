#include "gl/tessellation.h"
#include "gl/program.h"
#include "host/frame/factors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* As plan_data.glsl has them. */
typedef struct patch_record {
    uint32_t head, ring, support, rows, rotation, unused[3];
} patch_record;
typedef struct part_record {
    float outer[4], inner[2], corner[2], colour[3], side;
    uint32_t patch, number, unused[2];
} part_record;

enum { HEADS, TREES, REALS, RINGS, VERTICES, PATCHES, PARTS, SUPPORT, BUFFERS };
enum { PASSES = 3 };

/* Parts that are drawn together: their control points, and their points if they are captured, fit a buffer. */
typedef struct run {
    uint32_t first_patch, n_patches, first_part, n_parts;
    uint64_t points, samples;
} run;

struct qp_gl_surface {
    qp_gl *gl;
    qp_spacing spacing;
    GLuint buffers[BUFFERS], captured, array, query;
    GLuint framebuffer, renderbuffer; /* for captures: without a surface there is none to begin with */
    GLuint programs[PASSES][QP_GL_KINDS], hull;
    float centre[3], centre_rest[3], scale;
    patch_record *patches; /* of all runs, one after the other; likewise parts */
    part_record *parts;
    run *runs[QP_GL_KINDS];
    uint32_t n_runs[QP_GL_KINDS];
    uint64_t most_points, most_samples; /* of a run */
};

/* Limits of a run: 64 MB of control points; and what Mesa's llvmpipe tessellates in one draw, whose vertices it numbers by 16 bits
 * (22.3.6: of 65,537 captured points the last is the first again). */
enum { RUN_POINTS = 1 << 22, RUN_SAMPLES = 65535 };

/* ---- What goes to the GPU once ---- */

static void bind(qp_gl_surface *s, int buffer) {
    qp_gl *gl = s->gl;
    QP_GL(gl, BindBufferBase(GL_SHADER_STORAGE_BUFFER, (GLuint)buffer, s->buffers[buffer]));
}

static qp_status fill(qp_gl_surface *s, int buffer, const void *from, size_t bytes, const char *what,
                      qp_error *err) {
    qp_gl *gl = s->gl;
    GLint most = 0;
    QP_GL(gl, GetIntegerv(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &most));
    if (bytes > (size_t)most)
        return qp_fail(err, QP_SYSTEM, "%s take %zu bytes, and a buffer of this GL holds %d", what, bytes,
                       most);
    bind(s, buffer);
    /* A buffer without any bytes cannot be bound. */
    QP_GL(gl, BufferData(GL_SHADER_STORAGE_BUFFER, (GLsizeiptr)(bytes == 0 ? 16 : bytes),
                         bytes == 0 ? NULL : from, GL_STATIC_DRAW));
    return qp_gl_status(gl, err);
}

/* The surfaces whose plans the frame uses, in the order of its numbering; first_ring: of each of its steps. */
static uint32_t list_surfaces(const qp_frame *frame, const qp_surface **surfaces, uint64_t *first_ring,
                              uint64_t *ring_entries) {
    uint32_t n = 0;
    *ring_entries = 0;
    for (uint32_t step = 0; step <= QP_PLAN_STEPS; ++step) {
        const qp_surface *at = step == 0 ? frame->surface : frame->deep[step - 1];
        first_ring[step] = *ring_entries;
        if (at == NULL) continue;
        surfaces[n++] = at;
        *ring_entries += at->ring_entries;
    }
    return n;
}

static qp_status upload_plans(qp_gl_surface *s, const qp_surface *const *surfaces, uint32_t n,
                              uint64_t ring_entries, qp_error *err) {
    qp_plan_pack pack;
    qp_status status = qp_surface_pack(surfaces, n, QP_FLOAT, &pack, err);
    if (status != QP_OK) return status;
    status = fill(s, HEADS, pack.heads, pack.head_words * sizeof(uint32_t), "the heads of plans", err);
    if (status == QP_OK)
        status = fill(s, TREES, pack.tree, pack.tree_words * sizeof(uint32_t), "quadtrees", err);
    if (status == QP_OK)
        status = fill(s, REALS, pack.reals, pack.real_count * sizeof(float), "stencils", err);
    free(pack.heads);
    free(pack.tree);
    free(pack.reals);
    uint32_t *rings = qp_alloc((size_t)ring_entries, sizeof *rings, false);
    if (rings == NULL) return qp_fail_memory(err, (size_t)ring_entries * sizeof *rings, "1-rings");
    uint64_t at = 0;
    for (uint32_t k = 0; k < n; at += surfaces[k++]->ring_entries)
        if (surfaces[k]->ring_entries != 0)
            memcpy(rings + at, surfaces[k]->rings, (size_t)surfaces[k]->ring_entries * sizeof *rings);
    if (status == QP_OK) status = fill(s, RINGS, rings, (size_t)ring_entries * sizeof *rings, "1-rings", err);
    free(rings);
    return status;
}

static qp_status upload_vertices(qp_gl_surface *s, const qp_mesh *mesh, qp_error *err) {
    const size_t count = 3 * (size_t)mesh->n_vertices;
    const qp_local_frame f = qp_mesh_local_frame(mesh);
    float *local = qp_alloc(count, sizeof *local, false);
    if (local == NULL) return qp_fail_memory(err, count * sizeof *local, "positions");
    for (size_t i = 0; i < count; ++i)
        local[i] = (float)ldexp(mesh->positions[i] - f.centre[i % 3], -f.exponent);
    for (size_t k = 0; k < 3; ++k) {
        s->centre[k] = (float)f.centre[k];
        s->centre_rest[k] = (float)(f.centre[k] - (double)s->centre[k]);
    }
    s->scale = ldexpf(1.0f, f.exponent);
    qp_status status = fill(s, VERTICES, local, count * sizeof *local, "positions", err);
    free(local);
    return status;
}

/* ---- Records ---- */

/* Appends item `i` of the layout to a kind's last run, or to a new one. */
static bool append(qp_gl_surface *s, int kind, const run *of_patch, const run *of_part) {
    run *last = s->n_runs[kind] != 0 ? &s->runs[kind][s->n_runs[kind] - 1] : NULL;
    if (last == NULL || last->points + of_patch->points > RUN_POINTS ||
        last->samples + of_part->samples > RUN_SAMPLES) {
        run *grown = realloc(s->runs[kind], (s->n_runs[kind] + 1) * sizeof *grown);
        if (grown == NULL) return false;
        s->runs[kind] = grown;
        last = &grown[s->n_runs[kind]++];
        *last = (run){.first_patch = of_patch->first_patch, .first_part = of_part->first_part};
    }
    last->n_patches += of_patch->n_patches;
    last->points += of_patch->points;
    last->n_parts += of_part->n_parts;
    last->samples += of_part->samples;
    if (last->points > s->most_points) s->most_points = last->points;
    if (last->samples > s->most_samples) s->most_samples = last->samples;
    return true;
}

static part_record record_part(const qp_part_factors *factors, uint64_t i, uint64_t first, bool quarters,
                               uint32_t patch, const float *colour) {
    part_record r = {.side = quarters ? 0.5f : 1.0f, .patch = patch, .number = (uint32_t)i};
    const uint64_t quarter = i - first;
    memcpy(r.outer, factors->values + 6 * i, sizeof r.outer);
    memcpy(r.inner, factors->values + 6 * i + 4, sizeof r.inner);
    if (quarters) {
        r.corner[0] = quarter & 1 ? 0.5f : 0.0f;
        r.corner[1] = quarter & 2 ? 0.5f : 0.0f;
    }
    for (size_t k = 0; k < 3; ++k) r.colour[k] = colour != NULL ? sqrtf(fminf(fmaxf(colour[k], 0), 1)) : 1.0f;
    return r;
}

/* The records of all patches of a kind. Patches of a run are numbered from 0, and so are their parts and points. */
static bool record_kind(qp_gl_surface *s, const qp_frame *frame, const qp_part_factors *factors, int kind,
                        const uint64_t *first_ring, const float *colours, uint32_t *n_patches,
                        uint32_t *n_parts) {
    const qp_surface *surface = frame->surface;
    for (uint32_t p = 0; p < surface->mesh->n_patches; ++p) {
        const uint64_t first = factors->first[p], end = factors->first[p + 1];
        if (first == end || (surface->patch_plan[p] == surface->regular_plan) != (kind == QP_GL_REGULAR))
            continue;
        const qp_frame_plan plan = qp_frame_plan_of(frame, p);
        const uint8_t step = frame->patch_step == NULL ? 0 : frame->patch_step[p];
        const uint32_t rows = kind == QP_GL_REGULAR ? 0 : plan.plan->rows[frame->layout.items[first].level];
        run of_patch = {.first_patch = *n_patches, .n_patches = 1, .points = rows};
        run of_part = {.first_part = *n_parts, .n_parts = (uint32_t)(end - first)};
        for (uint64_t i = first; i < end; ++i) of_part.samples += frame->layout.items[i].samples;
        if (!append(s, kind, &of_patch, &of_part)) return false;
        const run *last = &s->runs[kind][s->n_runs[kind] - 1];
        s->patches[(*n_patches)++] =
            (patch_record){.head = plan.index * QP_HEAD_WORDS,
                           .ring = (uint32_t)(first_ring[step] + plan.surface->patch_ring[p]),
                           .support = (uint32_t)(last->points - rows),
                           .rows = rows,
                           .rotation = plan.rotation};
        for (uint64_t i = first; i < end; ++i)
            s->parts[(*n_parts)++] = record_part(factors, i, first, end - first == 4, last->n_patches - 1,
                                                 colours != NULL ? colours + 3 * (size_t)p : NULL);
    }
    return true;
}

static qp_status make_records(qp_gl_surface *s, const qp_frame *frame, const qp_tessellation *tessellation,
                              const uint64_t *first_ring, const float *colours, qp_error *err) {
    qp_part_factors factors;
    qp_status status = qp_factors_make(frame->surface, tessellation, &factors, err);
    if (status != QP_OK) return status;
    const uint32_t n_patches = frame->surface->mesh->n_patches;
    const uint64_t n_parts = factors.first[n_patches];
    s->patches = qp_alloc(n_patches, sizeof *s->patches, false);
    s->parts = qp_alloc((size_t)n_parts, sizeof *s->parts, false);
    uint32_t patches = 0, parts = 0;
    if (s->patches == NULL || s->parts == NULL)
        status = qp_fail_memory(err, (size_t)n_parts * sizeof *s->parts, "patches to draw");
    for (int kind = 0; kind < QP_GL_KINDS && status == QP_OK; ++kind)
        if (!record_kind(s, frame, &factors, kind, first_ring, colours, &patches, &parts))
            status = qp_fail_memory(err, sizeof(run), "patches to draw");
    qp_factors_free(&factors);
    return status;
}

/* ---- Opening ---- */

static qp_status check_version(qp_gl *gl, qp_error *err) {
    GLint major = 0, minor = 0;
    QP_GL(gl, GetIntegerv(GL_MAJOR_VERSION, &major));
    QP_GL(gl, GetIntegerv(GL_MINOR_VERSION, &minor));
    if (10 * major + minor < 45)
        return qp_fail(err, QP_SYSTEM, "the tessellation path needs OpenGL 4.5, and this is %d.%d (%s)",
                       major, minor, gl->backend);
    return qp_gl_status(gl, err);
}

static qp_status make_buffers(qp_gl_surface *s, qp_error *err) {
    qp_gl *gl = s->gl;
    QP_GL(gl, GenVertexArrays(1, &s->array));
    QP_GL(gl, GenBuffers(BUFFERS, s->buffers));
    QP_GL(gl, GenBuffers(1, &s->captured));
    QP_GL(gl, GenQueries(1, &s->query));
    QP_GL(gl, GenFramebuffers(1, &s->framebuffer));
    QP_GL(gl, GenRenderbuffers(1, &s->renderbuffer));
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, s->framebuffer));
    QP_GL(gl, BindRenderbuffer(GL_RENDERBUFFER, s->renderbuffer));
    QP_GL(gl, RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 16, 16));
    QP_GL(gl,
          FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, s->renderbuffer));
    return qp_gl_status(gl, err);
}

qp_status qp_gl_surface_open(qp_gl *gl, const qp_frame *frame, const qp_tessellation *tessellation,
                             const float *colours, qp_gl_surface **surface, qp_error *err) {
    *surface = NULL;
    qp_gl_surface *s = qp_alloc(1, sizeof *s, true);
    if (s == NULL) return qp_fail_memory(err, sizeof *s, "a surface to draw");
    s->gl = gl;
    s->spacing = tessellation->spacing;
    const qp_surface *surfaces[1 + QP_PLAN_STEPS];
    uint64_t first_ring[1 + QP_PLAN_STEPS], ring_entries;
    const uint32_t n = list_surfaces(frame, surfaces, first_ring, &ring_entries);
    qp_status status = check_version(gl, err);
    if (status == QP_OK) status = make_buffers(s, err);
    if (status == QP_OK) status = upload_plans(s, surfaces, n, ring_entries, err);
    if (status == QP_OK) status = upload_vertices(s, frame->surface->mesh, err);
    if (status == QP_OK) status = make_records(s, frame, tessellation, first_ring, colours, err);
    if (status == QP_OK)
        status = fill(s, SUPPORT, NULL, (size_t)s->most_points * 4 * sizeof(float), "control points", err);
    if (status != QP_OK) {
        qp_gl_surface_close(s);
        return status;
    }
    *surface = s;
    return QP_OK;
}

void qp_gl_surface_close(qp_gl_surface *s) {
    if (s == NULL) return;
    qp_gl *gl = s->gl;
    for (int pass = 0; pass < PASSES; ++pass)
        for (int kind = 0; kind < QP_GL_KINDS; ++kind)
            if (s->programs[pass][kind] != 0) QP_GL(gl, DeleteProgram(s->programs[pass][kind]));
    if (s->hull != 0) QP_GL(gl, DeleteProgram(s->hull));
    QP_GL(gl, DeleteBuffers(BUFFERS, s->buffers));
    QP_GL(gl, DeleteBuffers(1, &s->captured));
    QP_GL(gl, DeleteVertexArrays(1, &s->array));
    QP_GL(gl, DeleteQueries(1, &s->query));
    QP_GL(gl, DeleteFramebuffers(1, &s->framebuffer));
    QP_GL(gl, DeleteRenderbuffers(1, &s->renderbuffer));
    free(s->patches);
    free(s->parts);
    for (int kind = 0; kind < QP_GL_KINDS; ++kind) free(s->runs[kind]);
    free(s);
}

bool qp_gl_surface_is_empty(const qp_gl_surface *s, int kind) {
    return s->n_runs[kind] == 0;
}

/* ---- Programs ---- */

static qp_status make_program(qp_gl_surface *s, qp_gl_pass pass, int kind, qp_error *err) {
    static const char *const spacings[] = {"equal_spacing", "fractional_even_spacing",
                                           "fractional_odd_spacing"};
    static const char *const varyings[] = {"part_at", "part_normal", "part_uv", "part_number", "part_sine"};
    char defines[128];
    snprintf(defines, sizeof defines, "#define LAYOUT quads, %s, ccw%s\n", spacings[s->spacing],
             pass == QP_GL_PASS_CAPTURE ? ", point_mode" : "");
    const char *const data[] = {"plan_data.glsl", NULL}, *const surface[] = {"plan_data.glsl",
                                                                             "tess_surface.glsl", NULL};
    const qp_gl_program_desc desc = {.vertex = "tess_patch.vert.glsl",
                                     .tess_control = "tess_levels.tesc.glsl",
                                     .tess_control_first = data,
                                     .tess_evaluation = kind == QP_GL_REGULAR ? "tess_regular.tese.glsl"
                                                                              : "tess_walk.tese.glsl",
                                     .tess_evaluation_first = surface,
                                     .geometry = pass == QP_GL_PASS_SHADE ? "tess_corners.geom.glsl" : NULL,
                                     .fragment = pass == QP_GL_PASS_SHADE    ? "geometry.frag.glsl"
                                                 : pass == QP_GL_PASS_SHADOW ? "shadow.frag.glsl"
                                                                             : NULL,
                                     .defines = defines,
                                     .version = 450,
                                     .capture = varyings,
                                     .capture_count = pass == QP_GL_PASS_CAPTURE ? 5 : 0};
    return qp_gl_make_program(s->gl, &desc, &s->programs[pass][kind], err);
}

static void place(qp_gl_surface *s, GLuint program) {
    qp_gl *gl = s->gl;
    const float *c = s->centre, *r = s->centre_rest;
    QP_GL(gl, Uniform3f(gl->GetUniformLocation(program, "frame_centre"), c[0], c[1], c[2]));
    QP_GL(gl, Uniform3f(gl->GetUniformLocation(program, "frame_rest"), r[0], r[1], r[2]));
    QP_GL(gl, Uniform1f(gl->GetUniformLocation(program, "frame_scale"), s->scale));
}

qp_status qp_gl_surface_program(qp_gl_surface *s, qp_gl_pass pass, int kind, GLuint *program, qp_error *err) {
    qp_status status = QP_OK;
    if (s->programs[pass][kind] == 0) {
        status = make_program(s, pass, kind, err);
        if (status != QP_OK) return status;
        s->gl->UseProgram(s->programs[pass][kind]);
        qp_gl_note(s->gl, "glUseProgram");
        place(s, s->programs[pass][kind]);
    }
    *program = s->programs[pass][kind];
    return qp_gl_status(s->gl, err);
}

/* ---- A run ---- */

static qp_status run_hull(qp_gl_surface *s, const run *r, qp_error *err) {
    qp_gl *gl = s->gl;
    if (r->points == 0) return QP_OK;
    if (s->hull == 0) {
        const char *const data[] = {"plan_data.glsl", NULL};
        const qp_gl_program_desc desc = {
            .compute = "tess_hull.comp.glsl", .compute_first = data, .version = 450};
        qp_status status = qp_gl_make_program(gl, &desc, &s->hull, err);
        if (status != QP_OK) return status;
    }
    /* A dimension may have as few as 65,535 groups. */
    const GLuint wide = r->n_patches < 32768 ? r->n_patches : 32768, high = (r->n_patches + wide - 1) / wide;
    QP_GL(gl, UseProgram(s->hull));
    QP_GL(gl, Uniform1ui(gl->GetUniformLocation(s->hull, "patch_count"), r->n_patches));
    bind(s, SUPPORT);
    QP_GL(gl, DispatchCompute(wide, high, 1));
    QP_GL(gl, MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT));
    return qp_gl_status(gl, err);
}

/* Hull of a run, and everything bound for its draw. */
static qp_status start_run(qp_gl_surface *s, const run *r, GLuint program, qp_error *err) {
    qp_gl *gl = s->gl;
    for (int k = HEADS; k <= VERTICES; ++k) bind(s, k);
    qp_status status =
        fill(s, PATCHES, s->patches + r->first_patch, r->n_patches * sizeof(patch_record), "patches", err);
    if (status == QP_OK)
        status = fill(s, PARTS, s->parts + r->first_part, r->n_parts * sizeof(part_record), "patches", err);
    if (status == QP_OK) status = run_hull(s, r, err);
    bind(s, SUPPORT);
    QP_GL(gl, UseProgram(program));
    QP_GL(gl, BindVertexArray(s->array));
    QP_GL(gl, PatchParameteri(GL_PATCH_VERTICES, 1));
    return status == QP_OK ? qp_gl_status(gl, err) : status;
}

qp_status qp_gl_surface_draw(qp_gl_surface *s, qp_gl_pass pass, int kind, qp_error *err) {
    qp_gl *gl = s->gl;
    GLuint program;
    qp_status status = qp_gl_surface_program(s, pass, kind, &program, err);
    for (uint32_t k = 0; k < s->n_runs[kind] && status == QP_OK; ++k) {
        status = start_run(s, &s->runs[kind][k], program, err);
        if (status != QP_OK) break;
        QP_GL(gl, DrawArrays(GL_PATCHES, 0, (GLsizei)s->runs[kind][k].n_parts));
        status = qp_gl_status(gl, err);
    }
    return status;
}

/* ---- Reading back ---- */

static qp_status capture_run(qp_gl_surface *s, const run *r, GLuint program, qp_gl_vertex *vertices,
                             size_t room, size_t *count, qp_error *err) {
    qp_gl *gl = s->gl;
    qp_status status = start_run(s, r, program, err);
    if (status != QP_OK) return status;
    QP_GL(gl, Enable(GL_RASTERIZER_DISCARD));
    QP_GL(gl, BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, s->captured));
    QP_GL(gl, BeginQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, s->query));
    QP_GL(gl, BeginTransformFeedback(GL_POINTS));
    QP_GL(gl, DrawArrays(GL_PATCHES, 0, (GLsizei)r->n_parts));
    QP_GL(gl, EndTransformFeedback());
    QP_GL(gl, EndQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN));
    QP_GL(gl, Disable(GL_RASTERIZER_DISCARD));
    GLuint written = 0;
    QP_GL(gl, GetQueryObjectuiv(s->query, GL_QUERY_RESULT, &written));
    status = qp_gl_status(gl, err);
    if (status != QP_OK) return status;
    /* A full buffer may have cut points off; the room is for one more than there should be. */
    if (written >= room)
        return qp_fail(err, QP_CHECK_FAILED,
                       "GL's tessellator makes more points of %u patches than the %llu expected", r->n_parts,
                       (unsigned long long)r->samples);
    *count = written;
    if (written != 0)
        QP_GL(gl, GetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, (GLsizeiptr)(written * sizeof *vertices),
                                   vertices));
    return qp_gl_status(gl, err);
}

qp_status qp_gl_surface_capture(qp_gl_surface *s, qp_gl_take take, void *context, qp_error *err) {
    qp_gl *gl = s->gl;
    const size_t room = (size_t)s->most_samples + 1;
    qp_gl_vertex *vertices = qp_alloc(room, sizeof *vertices, false);
    if (vertices == NULL) return qp_fail_memory(err, room * sizeof *vertices, "captured vertices");
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, s->framebuffer));
    QP_GL(gl, BindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, s->captured));
    QP_GL(gl, BufferData(GL_TRANSFORM_FEEDBACK_BUFFER, (GLsizeiptr)(room * sizeof *vertices), NULL,
                         GL_STREAM_READ));
    qp_status status = qp_gl_status(gl, err);
    for (int kind = 0; kind < QP_GL_KINDS && status == QP_OK; ++kind) {
        GLuint program;
        if (s->n_runs[kind] != 0) status = qp_gl_surface_program(s, QP_GL_PASS_CAPTURE, kind, &program, err);
        for (uint32_t k = 0; k < s->n_runs[kind] && status == QP_OK; ++k) {
            size_t count = 0;
            status = capture_run(s, &s->runs[kind][k], program, vertices, room, &count, err);
            if (status == QP_OK) status = take(context, vertices, count, err);
        }
    }
    free(vertices);
    return status;
}
