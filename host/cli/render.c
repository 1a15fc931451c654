/* quadplan render: a scene to a picture. */
#include "gl/render.h"
#include "host/cli/supports.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#define COLOURS "material|kind|level|plan|patch|normal|component"

/* What the command line asks for over what the scene says. */
typedef struct overrides {
    bool colour_given, wireframe, tess_given, spacing_given, size_given;
    int colour, spacing, precision, backend; /* backend: the API's values */
    double tess, tolerance;                  /* tolerance 0: the scene's */
    uint64_t depth;
    cli_sizes size;
    const char *device;
    cli_supports_options supports;
} overrides;

static qp_status apply(const overrides *o, qp_scene *scene, qp_error *err) {
    if (o->colour_given) scene->colour_by = (qp_colour)o->colour;
    if (o->wireframe && !(scene->wire_width > 0)) scene->wire_width = 1;
    if (o->tess_given) {
        scene->factor = o->tess;
        scene->random_factors = false;
        scene->tolerance = 0;
    }
    if (o->tolerance != 0) {
        scene->tolerance = o->tolerance;
        if (!o->tess_given) scene->factor = 64;
    }
    if (o->spacing_given) scene->spacing = (qp_spacing)o->spacing;
    if (o->depth != 0) scene->surface_options.depth = (uint32_t)o->depth;
    if (!o->size_given) return QP_OK;
    const uint32_t *n = o->size.n;
    if (o->size.count != 2 || n[0] < 1 || n[1] < 1 || n[0] > QP_IMAGE_SIDE_MAX || n[1] > QP_IMAGE_SIDE_MAX)
        return qp_fail(err, QP_BAD_INPUT, "--size: width and height are from 1 to %u", QP_IMAGE_SIDE_MAX);
    scene->width = n[0];
    scene->height = n[1];
    return QP_OK;
}

/* All that a picture is made from; freed together. */
typedef struct work {
    qp_scene *scene;
    qp_mesh *mesh;
    qp_surface *surface;
    qp_device *device;
    qp_frame *frame;
    float *factors;
    qp_image image;
    qp_stream stream;
    char backend[128];
    struct pass *passes; /* of the scene, if they are drawn */
    uint32_t n_passes;
} work;

/* A further view that has been drawn. */
typedef struct pass {
    char *picture; /* its file */
    uint64_t samples, hash;
    double frame_ms;
    qp_supports_report supports;
} pass;

static void work_free(work *w) {
    for (uint32_t i = 0; i < w->n_passes; ++i) free(w->passes[i].picture);
    free(w->passes);
    qp_image_free(&w->image);
    free(w->factors);
    qp_frame_free(w->frame);
    qp_device_free(w->device);
    qp_surface_free(w->surface);
    qp_mesh_free(w->mesh);
    qp_scene_free(w->scene);
}

static qp_status open_work(const char *path, const overrides *o, work *w, qp_error *err) {
    qp_frame_options frame_options = {
        .precision = (qp_precision)o->precision, .want_triangles = 1, .want_hash = 1};
    qp_status status = cli_supports_get(&o->supports, &frame_options.supports, err);
    if (status == QP_OK) status = qp_scene_read(path, &w->scene, err);
    if (status == QP_OK) status = apply(o, w->scene, err);
    if (status == QP_OK) status = qp_scene_mesh(w->scene, cli_print_warning, NULL, &w->mesh, err);
    if (status == QP_OK) status = qp_surface_create(w->mesh, &w->scene->surface_options, &w->surface, err);
    if (status == QP_OK) status = qp_device_open(o->device, &w->device, err);
    if (status == QP_OK) status = qp_frame_create(w->device, w->surface, &frame_options, &w->frame, err);
    return status;
}

/* The scene as it is, or one of its passes. */
static qp_status draw_view(const qp_scene *view, const overrides *o, work *w, qp_error *err) {
    qp_tessellation tessellation;
    free(w->factors);
    w->factors = NULL;
    qp_image_free(&w->image);
    qp_status status = qp_scene_tessellation(view, w->mesh, &tessellation, &w->factors, err);
    if (status == QP_OK) status = qp_frame_eval(w->frame, &tessellation, &w->stream, err);
    if (status == QP_OK)
        status = qp_render(view, w->frame, &tessellation, &w->stream, (qp_backend)o->backend, &w->image,
                           w->backend, err);
    if (status == QP_OK) cli_tolerance_warn(view->tolerance, &w->stream);
    return status;
}

/* "picture-N.png" of "picture.png", malloced; NULL when memory is out. */
static char *numbered(const char *picture, uint32_t n) {
    const size_t length = strlen(picture), size = length + 16;
    const char *dot = strrchr(picture, '.');
    const int stem = (int)(dot == NULL ? length : (size_t)(dot - picture));
    char *name = qp_alloc(size, 1, false);
    if (name != NULL) snprintf(name, size, "%.*s-%u%s", stem, picture, (unsigned)n, picture + stem);
    return name;
}

/* All passes of the scene, one picture each. */
static qp_status draw_passes(const char *picture, const overrides *o, work *w, qp_error *err) {
    const uint32_t count = w->scene->n_passes;
    w->passes = qp_alloc(count, sizeof *w->passes, true);
    if (w->passes == NULL) return qp_fail_memory(err, count * sizeof *w->passes, "passes");
    qp_status status = QP_OK;
    for (uint32_t i = 0; i < count && status == QP_OK; ++i) {
        qp_scene view = w->scene->passes[i];
        pass *p = &w->passes[w->n_passes++];
        p->picture = numbered(picture, i + 2);
        status =
            p->picture == NULL ? qp_fail_memory(err, strlen(picture), "a file name") : apply(o, &view, err);
        if (status == QP_OK) status = draw_view(&view, o, w, err);
        if (status == QP_OK) status = qp_image_write(p->picture, &w->image, err);
        p->samples = w->stream.n_samples;
        p->hash = w->stream.hash;
        p->frame_ms = w->stream.frame_ms;
        p->supports = w->stream.supports;
    }
    return status;
}

static void print_passes(qp_json *json, const overrides *o, const work *w) {
    if (json != NULL) qp_json_open_array(json, "passes");
    for (uint32_t i = 0; i < w->n_passes; ++i) {
        const pass *p = &w->passes[i];
        if (json == NULL) {
            printf("%s: pass %s, %" PRIu64 " samples, evaluated in %.2f ms\n", p->picture,
                   w->scene->passes[i].name, p->samples, p->frame_ms);
            cli_supports_text(&o->supports, &p->supports);
            continue;
        }
        char hash[20];
        snprintf(hash, sizeof hash, "%016" PRIx64, p->hash);
        qp_json_open_object(json, NULL);
        qp_json_text(json, "name", w->scene->passes[i].name);
        qp_json_text(json, "picture", p->picture);
        qp_json_integer(json, "samples", p->samples);
        qp_json_real(json, "frame_ms", p->frame_ms);
        cli_supports_json(json, &o->supports, &p->supports);
        qp_json_text(json, "stream_hash", hash);
        qp_json_close(json);
    }
    if (json != NULL) qp_json_close(json);
}

/* s, image: of the first view; the passes follow. */
static void print_result(bool as_json, const char *scene, const char *picture, const overrides *o,
                         const work *w, const qp_stream *s, const qp_image *image) {
    if (!as_json) {
        printf("%s: %" PRIu32 "x%" PRIu32 ", %" PRIu64 " samples, %" PRIu64 " triangles\n", picture,
               image->width, image->height, s->n_samples, s->n_triangles);
        printf("  evaluated on %s in %.2f ms, drawn by %s\n", qp_device_name(w->device), s->frame_ms,
               w->backend);
        cli_supports_text(&o->supports, &s->supports);
        cli_tolerance_text(w->scene->tolerance, s);
        print_passes(NULL, o, w);
        return;
    }
    char hash[20];
    snprintf(hash, sizeof hash, "%016" PRIx64, s->hash);
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_text(&json, "scene", scene);
    qp_json_text(&json, "picture", picture);
    qp_json_integer(&json, "width", image->width);
    qp_json_integer(&json, "height", image->height);
    qp_json_integer(&json, "patches", w->mesh->n_patches);
    qp_json_integer(&json, "samples", s->n_samples);
    qp_json_integer(&json, "triangles", s->n_triangles);
    cli_tolerance_json(&json, w->scene->tolerance, s);
    qp_json_real(&json, "frame_ms", s->frame_ms);
    cli_supports_json(&json, &o->supports, &s->supports);
    qp_json_text(&json, "stream_hash", hash);
    qp_json_text(&json, "device", qp_device_name(w->device));
    qp_json_text(&json, "backend", o->backend == QP_BACKEND_TESSELLATION ? "tessellation" : "stream");
    qp_json_text(&json, "gl", w->backend);
    if (w->passes != NULL) print_passes(&json, o, w);
    qp_json_finish(&json);
}

static qp_status run(int argc, char **argv, qp_error *err) {
    overrides o = {.supports = CLI_SUPPORTS_DEFAULTS};
    const char *picture = NULL;
    bool json = false, passes = false;
    const cli_option options[] = {
        {"-o", "FILE", "where to write the picture: .png or .exr", CLI_TEXT, &picture, 0, 0, NULL},
        {"--color", COLOURS, "what to colour by", CLI_CHOICE, &o.colour, 0, 0, &o.colour_given},
        {"--backend", "stream|tessellation",
         "who draws: the triangles of the vertex stream (default), or GL's own tessellator from the plans",
         CLI_CHOICE, &o.backend, 0, 0, NULL},
        {"--wireframe", NULL, "draw the tessellation's edges", CLI_FLAG, &o.wireframe, 0, 0, NULL},
        {"--tess", "F", "one tessellation factor for all, 1 to 64", CLI_REAL, &o.tess, 1, 64, &o.tess_given},
        {"--tolerance", "T",
         "instead, the least factors that err by no more than T times the bounding box's diagonal", CLI_REAL,
         &o.tolerance, 1e-300, 1e300, NULL},
        {"--spacing", CLI_SPACINGS, "of the tessellator", CLI_CHOICE, &o.spacing, 0, 0, &o.spacing_given},
        {"--size", "WxH", "of the picture, in pixels", CLI_SIZES, &o.size, 0, 0, &o.size_given},
        {"--precision", CLI_PRECISIONS, "of stencils and kernels (default float)", CLI_CHOICE, &o.precision,
         0, 0, NULL},
        {"--depth", "N", "deepest subdivision level of the plans, 1 to 60", CLI_COUNT, &o.depth, 1,
         QP_DEPTH_LIMIT, NULL},
        {"--device", "D", "host, P.D, or part of a name, as `quadplan devices` lists them", CLI_TEXT,
         &o.device, 0, 0, NULL},
        {"--passes", NULL, "draw the scene's passes too: FILE-2.png and so on", CLI_FLAG, &passes, 0, 0,
         NULL},
        CLI_SUPPORTS_OPTIONS(o.supports),
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_render, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    if (picture == NULL) return qp_fail(err, QP_BAD_INPUT, "render needs -o FILE.png or -o FILE.exr");
    status = qp_image_check_path(picture, err);
    if (status != QP_OK) return status;

    work w = {0};
    status = open_work(arguments.values[0], &o, &w, err);
    if (status == QP_OK) status = draw_view(w.scene, &o, &w, err);
    const qp_stream first = w.stream;
    const qp_image size = {.width = w.image.width, .height = w.image.height};
    if (status == QP_OK) status = qp_image_write(picture, &w.image, err);
    if (status == QP_OK && passes) status = draw_passes(picture, &o, &w, err);
    if (status == QP_OK) print_result(json, arguments.values[0], picture, &o, &w, &first, &size);
    work_free(&w);
    return status;
}

const cli_command cli_render = {
    "render", "SCENE", "Draws a scene file to a picture.",
    "SCENE is a JSON file; what the options say goes before it. The picture is drawn by "
    "OSMesa, or by EGL\nwithout a surface; QUADPLAN_GL=osmesa|egl insists on one.",
    run};
