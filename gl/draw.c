#include "gl/draw.h"
#include "gl/program.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SHADOW_SIDE = 1024, SAMPLES = 4 };

enum { PLACE, FACING, MATERIAL, MAPS };
static const GLenum map_formats[MAPS] = {GL_RGBA32F, GL_RGBA16F, GL_RGBA16F};

typedef struct drawing {
    qp_gl *gl;
    const qp_draw_input *in;
    uint32_t lights, lamp_count;
    bool shadowed;
    qp_lamp *lamps;
    double ground_centre[3], ground_u[3], ground_v[3]; /* of the ground's square */
    GLuint ground_program, shade_program, empty_array;
    GLuint shadows;    /* texture array, one layer a light */
    GLuint maps[MAPS]; /* multisampled textures: what geometry.frag.glsl writes */
    GLuint shadow_target, geometry_target, target;
    GLuint depth, colour; /* renderbuffers */
} drawing;

/* ---- Set-up ---- */

static qp_status make_programs(drawing *d, qp_error *err) {
    char defines[64];
    snprintf(defines, sizeof defines, "#define LIGHTS %u\n", d->lights);
    qp_gl_program_desc ground = {
        .vertex = "ground.vert.glsl", .fragment = "geometry.frag.glsl", .defines = "#define GROUND\n"};
    qp_gl_program_desc shade = {
        .vertex = "screen.vert.glsl", .fragment = "shade.frag.glsl", .defines = defines};
    qp_status status = qp_gl_make_program(d->gl, &ground, &d->ground_program, err);
    if (status == QP_OK) status = qp_gl_make_program(d->gl, &shade, &d->shade_program, err);
    return status;
}

static qp_status check_target(qp_gl *gl, qp_error *err) {
    GLenum state = gl->CheckFramebufferStatus(GL_FRAMEBUFFER);
    qp_gl_note(gl, "glCheckFramebufferStatus");
    if (state != GL_FRAMEBUFFER_COMPLETE)
        return qp_fail(err, QP_SYSTEM, "GL cannot draw into a picture of this size (status 0x%x, %s)", state,
                       gl->backend);
    return qp_gl_status(gl, err);
}

static qp_status make_targets(drawing *d, qp_error *err) {
    qp_gl *gl = d->gl;
    int width = (int)d->in->scene->width, height = (int)d->in->scene->height;
    QP_GL(gl, GenFramebuffers(1, &d->geometry_target));
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, d->geometry_target));
    QP_GL(gl, GenTextures(MAPS, d->maps));
    GLenum places[MAPS];
    for (int k = 0; k < MAPS; k++) {
        places[k] = GL_COLOR_ATTACHMENT0 + (GLenum)k;
        QP_GL(gl, ActiveTexture(GL_TEXTURE1 + (GLenum)k));
        QP_GL(gl, BindTexture(GL_TEXTURE_2D_MULTISAMPLE, d->maps[k]));
        QP_GL(gl, TexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, SAMPLES, map_formats[k], width, height,
                                        GL_TRUE));
        QP_GL(gl, FramebufferTexture2D(GL_FRAMEBUFFER, places[k], GL_TEXTURE_2D_MULTISAMPLE, d->maps[k], 0));
    }
    QP_GL(gl, DrawBuffers(MAPS, places));
    QP_GL(gl, GenRenderbuffers(1, &d->depth));
    QP_GL(gl, BindRenderbuffer(GL_RENDERBUFFER, d->depth));
    QP_GL(gl, RenderbufferStorageMultisample(GL_RENDERBUFFER, SAMPLES, GL_DEPTH_COMPONENT32F, width, height));
    QP_GL(gl, FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, d->depth));
    qp_status status = check_target(gl, err);
    if (status != QP_OK) return status;
    QP_GL(gl, GenFramebuffers(1, &d->target));
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, d->target));
    QP_GL(gl, GenRenderbuffers(1, &d->colour));
    QP_GL(gl, BindRenderbuffer(GL_RENDERBUFFER, d->colour));
    QP_GL(gl, RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA32F, width, height));
    QP_GL(gl, FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, d->colour));
    return check_target(gl, err);
}

/* ---- Passes ---- */

/* What a drawer's programs are told in the pass at hand. */
typedef struct pass_uniforms {
    drawing *d;
    const float *rows; /* of a shadow: affine map to [-1, 1]^3; NULL: the camera's pass */
} pass_uniforms;

static void set_pass(void *context, GLuint program);

static qp_status draw_shadows(drawing *d, qp_error *err) {
    qp_gl *gl = d->gl;
    QP_GL(gl, GenTextures(1, &d->shadows));
    QP_GL(gl, ActiveTexture(GL_TEXTURE0));
    QP_GL(gl, BindTexture(GL_TEXTURE_2D_ARRAY, d->shadows));
    int side = d->shadowed ? SHADOW_SIDE : 1, layers = d->shadowed ? (int)d->lights : 1;
    QP_GL(gl, TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT16, side, side, layers, 0,
                         GL_DEPTH_COMPONENT, GL_UNSIGNED_SHORT, NULL));
    QP_GL(gl, TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR));
    QP_GL(gl, TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR));
    QP_GL(gl, TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE));
    QP_GL(gl, TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE));
    QP_GL(gl, TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE));
    QP_GL(gl, TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL));
    if (!d->shadowed) return qp_gl_status(gl, err);

    QP_GL(gl, GenFramebuffers(1, &d->shadow_target));
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, d->shadow_target));
    QP_GL(gl, DrawBuffer(GL_NONE));
    QP_GL(gl, ReadBuffer(GL_NONE));
    QP_GL(gl, Viewport(0, 0, SHADOW_SIDE, SHADOW_SIDE));
    QP_GL(gl, Enable(GL_DEPTH_TEST));
    QP_GL(gl, Enable(GL_POLYGON_OFFSET_FILL));
    QP_GL(gl, PolygonOffset(2.0f, 4.0f));
    qp_status status = QP_OK;
    for (uint32_t k = 0; k < d->lights && status == QP_OK; k++) {
        QP_GL(gl, FramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, d->shadows, 0, (GLint)k));
        if (k == 0) status = check_target(gl, err);
        QP_GL(gl, Clear(GL_DEPTH_BUFFER_BIT));
        pass_uniforms uniforms = {d, d->lamps[k].rows};
        if (status == QP_OK)
            status = d->in->drawer->draw(d->in->drawer, QP_GL_PASS_SHADOW, set_pass, &uniforms, err);
    }
    QP_GL(gl, Disable(GL_POLYGON_OFFSET_FILL));
    return status == QP_OK ? qp_gl_status(gl, err) : status;
}

/* Uniforms that the compiler left out have location -1, which GL ignores. */
static void set_float(qp_gl *gl, GLuint program, const char *name, double x) {
    QP_GL(gl, Uniform1f(gl->GetUniformLocation(program, name), (float)x));
}
static void set_int(qp_gl *gl, GLuint program, const char *name, int x) {
    QP_GL(gl, Uniform1i(gl->GetUniformLocation(program, name), x));
}
static void set_vector(qp_gl *gl, GLuint program, const char *name, const double x[3]) {
    QP_GL(gl, Uniform3f(gl->GetUniformLocation(program, name), (float)x[0], (float)x[1], (float)x[2]));
}
static void set_scaled(qp_gl *gl, GLuint program, const char *name, const double x[3], double scale) {
    const double scaled[3] = {x[0] * scale, x[1] * scale, x[2] * scale};
    set_vector(gl, program, name, scaled);
}

/* Under the lowest point, a little below it so that the two do not fight. */
static void place_ground(drawing *d) {
    const qp_view *view = d->in->view;
    const double *up = view->world_up;
    double side = 10 * view->radius, lift = view->floor - 2e-3 * view->radius;
    for (int k = 0; k < 3; k++) lift -= up[k] * view->centre[k];
    int least = 0; /* the axis that is least along up gives a direction across it */
    for (int k = 1; k < 3; k++)
        if (fabs(up[k]) < fabs(up[least])) least = k;
    double *u = d->ground_u, *v = d->ground_v;
    for (int k = 0; k < 3; k++) {
        d->ground_centre[k] = view->centre[k] + lift * up[k];
        u[k] = side * ((k == least) - up[least] * up[k]);
    }
    for (int k = 0; k < 3; k++) v[k] = up[(k + 1) % 3] * u[(k + 2) % 3] - up[(k + 2) % 3] * u[(k + 1) % 3];
}

static void draw_ground(drawing *d) {
    qp_gl *gl = d->gl;
    GLuint program = d->ground_program;
    QP_GL(gl, UseProgram(program));
    QP_GL(gl, UniformMatrix4fv(gl->GetUniformLocation(program, "view_projection"), 1, GL_FALSE,
                               d->in->view->view_projection));
    set_vector(gl, program, "ground_centre", d->ground_centre);
    set_vector(gl, program, "ground_u", d->ground_u);
    set_vector(gl, program, "ground_v", d->ground_v);
    set_vector(gl, program, "up", d->in->view->world_up);
    set_vector(gl, program, "ground_colour", d->in->scene->ground_colour);
    QP_GL(gl, BindVertexArray(d->empty_array));
    QP_GL(gl, DrawArrays(GL_TRIANGLE_STRIP, 0, 4));
}

static void set_pass(void *context, GLuint program) {
    const pass_uniforms *u = context;
    qp_gl *gl = u->d->gl;
    const qp_scene *s = u->d->in->scene;
    float map[16] = {0};
    for (int k = 0; u->rows != NULL && k < 12; k++) map[4 * (k % 4) + k / 4] = u->rows[k];
    map[15] = 1;
    QP_GL(gl, UniformMatrix4fv(gl->GetUniformLocation(program, "view_projection"), 1, GL_FALSE,
                               u->rows != NULL ? map : u->d->in->view->view_projection));
    if (u->rows != NULL) return;
    bool lines = s->colour_by == QP_COLOUR_KIND || s->colour_by == QP_COLOUR_LEVEL ||
                 s->colour_by == QP_COLOUR_PLAN || s->colour_by == QP_COLOUR_PATCH;
    set_vector(gl, program, "eye", u->d->in->view->eye);
    set_float(gl, program, "wire_width", s->wire_width);
    set_float(gl, program, "border_width", lines ? 1.6 : 0);
}

static qp_status draw_geometry(drawing *d, qp_error *err) {
    qp_gl *gl = d->gl;
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, d->geometry_target));
    QP_GL(gl, Viewport(0, 0, (GLsizei)d->in->scene->width, (GLsizei)d->in->scene->height));
    QP_GL(gl, Enable(GL_DEPTH_TEST));
    QP_GL(gl, ClearColor(0, 0, 0, 0));
    QP_GL(gl, Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT));
    if (d->in->scene->ground) draw_ground(d);
    pass_uniforms uniforms = {d, NULL};
    qp_status status = d->in->drawer->draw(d->in->drawer, QP_GL_PASS_SHADE, set_pass, &uniforms, err);
    QP_GL(gl, Disable(GL_DEPTH_TEST));
    return status == QP_OK ? qp_gl_status(gl, err) : status;
}

static void set_lights(drawing *d, GLuint program) {
    qp_gl *gl = d->gl;
    const qp_scene *s = d->in->scene;
    char name[40];
    for (uint32_t k = 0; k < d->lights; k++) {
        snprintf(name, sizeof name, "light_direction[%u]", k);
        QP_GL(gl, Uniform3fv(gl->GetUniformLocation(program, name), 1, d->lamps[k].direction));
        snprintf(name, sizeof name, "light_radiance[%u]", k);
        QP_GL(gl, Uniform3fv(gl->GetUniformLocation(program, name), 1, d->lamps[k].radiance));
        snprintf(name, sizeof name, "light_rows[%u]", 3 * k);
        QP_GL(gl, Uniform4fv(gl->GetUniformLocation(program, name), 3, d->lamps[k].rows));
    }
    set_int(gl, program, "light_count", (int)d->lights);
    set_int(gl, program, "lamp_count", (int)d->lamp_count);
    set_int(gl, program, "has_shadows", d->shadowed);
    set_scaled(gl, program, "sky_zenith", s->sky_zenith, s->sky_intensity);
    set_scaled(gl, program, "sky_horizon", s->sky_horizon, s->sky_intensity);
    set_scaled(gl, program, "sky_ground", s->sky_ground, s->sky_intensity);
}

static void draw_light(drawing *d) {
    qp_gl *gl = d->gl;
    const qp_scene *s = d->in->scene;
    const qp_view *view = d->in->view;
    GLuint program = d->shade_program;
    bool polished = s->colour_by == QP_COLOUR_MATERIAL || s->colour_by == QP_COLOUR_COMPONENT;
    QP_GL(gl, BindFramebuffer(GL_FRAMEBUFFER, d->target));
    QP_GL(gl, UseProgram(program));
    set_lights(d, program);
    set_int(gl, program, "shadows", 0);
    set_int(gl, program, "place_map", 1 + PLACE);
    set_int(gl, program, "facing_map", 1 + FACING);
    set_int(gl, program, "material_map", 1 + MATERIAL);
    set_float(gl, program, "shadow_offset", 3.0 * view->radius / SHADOW_SIDE);
    set_float(gl, program, "radius", view->radius);
    set_vector(gl, program, "up", view->world_up);
    set_vector(gl, program, "eye", view->eye);
    set_float(gl, program, "exposure", s->exposure);
    set_vector(gl, program, "back_colour", s->back_colour);
    set_int(gl, program, "use_back_colour", polished);
    set_int(gl, program, "show_normals", s->colour_by == QP_COLOUR_NORMAL);
    set_float(gl, program, "gloss", polished ? s->gloss : 0.3);
    set_float(gl, program, "specular", polished ? s->specular : 0.3);
    set_vector(gl, program, "wire_colour", s->wire_colour);
    set_vector(gl, program, "ground_centre", d->ground_centre);
    set_float(gl, program, "ground_fade", 6 * view->radius);
    set_vector(gl, program, "background_top", s->background_top);
    set_vector(gl, program, "background_bottom", s->background_bottom);
    set_float(gl, program, "background_alpha", s->background_alpha);
    set_float(gl, program, "height", s->height);
    QP_GL(gl, BindVertexArray(d->empty_array));
    QP_GL(gl, DrawArrays(GL_TRIANGLES, 0, 3));
}

static qp_status read_back(drawing *d, float *pixels, qp_error *err) {
    qp_gl *gl = d->gl;
    int width = (int)d->in->scene->width, height = (int)d->in->scene->height;
    QP_GL(gl, PixelStorei(GL_PACK_ALIGNMENT, 4));
    /* GL counts rows from the bottom. */
    for (int y = 0; y < height; y++)
        QP_GL(gl, ReadPixels(0, height - 1 - y, width, 1, GL_RGBA, GL_FLOAT,
                             pixels + (size_t)y * (size_t)width * 4));
    return qp_gl_status(gl, err);
}

static void free_drawing(drawing *d) {
    qp_gl *gl = d->gl;
    const GLuint programs[] = {d->ground_program, d->shade_program};
    for (size_t k = 0; k < sizeof programs / sizeof programs[0]; k++)
        if (programs[k] != 0) QP_GL(gl, DeleteProgram(programs[k]));
    const GLuint targets[] = {d->shadow_target, d->geometry_target, d->target};
    const GLuint renderbuffers[] = {d->colour, d->depth};
    QP_GL(gl, DeleteVertexArrays(1, &d->empty_array)); /* 0 is ignored in all of these */
    QP_GL(gl, DeleteFramebuffers(3, targets));
    QP_GL(gl, DeleteRenderbuffers(2, renderbuffers));
    QP_GL(gl, DeleteTextures(1, &d->shadows));
    QP_GL(gl, DeleteTextures(MAPS, d->maps));
    free(d->lamps);
}

/* Shadows of very many triangles from fewer directions, so that the time stays within bounds. */
static void choose_lights(drawing *d) {
    const uint64_t budget = 100u << 20;
    uint32_t wish = d->in->scene->shadow_samples;
    d->shadowed = wish > 0;
    d->lights = wish > 0 ? wish : 32;
    if (d->shadowed && d->lights * d->in->n_triangles > budget)
        d->lights = (uint32_t)(budget / d->in->n_triangles);
    if (d->lights < 16) d->lights = 16;
}

qp_status qp_gl_draw(qp_gl *gl, const qp_draw_input *input, float *pixels, qp_error *err) {
    drawing d = {.gl = gl, .in = input};
    choose_lights(&d);
    d.lamps = qp_alloc(d.lights, sizeof *d.lamps, true);
    if (d.lamps == NULL) return qp_fail_memory(err, d.lights * sizeof *d.lamps, "lights");
    place_ground(&d);
    qp_view_lamps(input->scene, input->view, d.lights, d.lamps, &d.lamp_count);
    qp_status status = make_programs(&d, err);
    if (status == QP_OK) {
        QP_GL(gl, GenVertexArrays(1, &d.empty_array));
        status = draw_shadows(&d, err);
    }
    if (status == QP_OK) status = make_targets(&d, err);
    if (status == QP_OK) status = draw_geometry(&d, err);
    if (status == QP_OK) {
        draw_light(&d);
        status = read_back(&d, pixels, err);
    }
    free_drawing(&d);
    return status;
}
