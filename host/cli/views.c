#define _GNU_SOURCE
#include "host/cli/views.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Puts the options in place of what a scene or one of its passes says. */
static void override(const cli_views_options *o, qp_scene *scene) {
    if (o->tess_given || o->tolerance != 0) {
        scene->factor = o->tess_given ? o->tess : 64;
        scene->tolerance = o->tolerance;
        scene->random_factors = false;
    }
    if (o->spacing_given) scene->spacing = (qp_spacing)o->spacing;
}

static qp_status open_scene(const char *path, const cli_views_options *o, cli_views *views,
                            qp_surface_options *surface_options, qp_error *err) {
    if (o->mesh.boundary_given || o->mesh.creases_given || o->mesh.triangles_given)
        return qp_fail(err, QP_BAD_INPUT,
                       "%s: a scene has subdivision rules of its own (--boundary, --creases, --triangles)",
                       path);
    qp_status status = qp_scene_read(path, &views->scene, err);
    if (status == QP_OK) status = qp_scene_mesh(views->scene, cli_print_warning, NULL, &views->mesh, err);
    if (status != QP_OK) return status;
    *surface_options = views->scene->surface_options;
    const size_t count = 1 + (size_t)views->scene->n_passes;
    views->list = qp_alloc(count, sizeof *views->list, true);
    if (views->list == NULL) return qp_fail_memory(err, count * sizeof *views->list, "the passes of a scene");
    views->count = count;
    for (size_t i = 0; i < count && status == QP_OK; ++i) {
        qp_scene *scene = i == 0 ? views->scene : &views->scene->passes[i - 1];
        cli_view *view = &views->list[i];
        override(o, scene);
        view->name = scene->name;
        view->factor = scene->random_factors || scene->tolerance != 0 ? 0 : scene->factor;
        status = qp_scene_tessellation(scene, views->mesh, &view->tessellation, &view->factors, err);
    }
    return status;
}

static qp_status open_mesh(const char *argument, const cli_views_options *o, cli_views *views,
                           qp_error *err) {
    qp_status status = cli_mesh_open(argument, &o->mesh, &views->mesh, err);
    if (status != QP_OK) return status;
    views->list = qp_alloc(1, sizeof *views->list, true);
    if (views->list == NULL) return qp_fail_memory(err, sizeof *views->list, "a view");
    views->count = 1;
    views->list[0].factor = o->tolerance != 0 ? 0 : o->tess;
    const bool largest = o->tolerance != 0 && !o->tess_given;
    views->list[0].tessellation = (qp_tessellation){.spacing = (qp_spacing)o->spacing,
                                                    .factor = largest ? 64 : (float)o->tess,
                                                    .tolerance = o->tolerance};
    return QP_OK;
}

qp_status cli_views_open(const char *argument, const cli_views_options *options, cli_views *views,
                         qp_error *err) {
    const char *dot = strrchr(argument, '.');
    const bool is_scene = dot != NULL && strcasecmp(dot, ".json") == 0 && strncmp(argument, "gen:", 4) != 0;
    qp_surface_options surface_options = {0};
    *views = (cli_views){0};
    qp_status status = is_scene ? open_scene(argument, options, views, &surface_options, err)
                                : open_mesh(argument, options, views, err);
    if (options->depth != 0) surface_options.depth = (uint32_t)options->depth;
    if (status == QP_OK) status = qp_surface_create(views->mesh, &surface_options, &views->surface, err);
    if (status != QP_OK) cli_views_close(views);
    return status;
}

void cli_views_close(cli_views *views) {
    for (size_t i = 0; views->list != NULL && i < views->count; ++i) free(views->list[i].factors);
    free(views->list);
    qp_surface_free(views->surface);
    qp_mesh_free(views->mesh);
    qp_scene_free(views->scene);
    *views = (cli_views){0};
}

static int by_size(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* The sizes of one item of a list. */
static bool add_item(const char *item, uint64_t **sizes, size_t *count, size_t *capacity, bool *memory) {
    cli_byte_range range;
    if (!cli_byte_range_read(item, &range) || range.first == 0) return false;
    for (uint64_t size = range.first;; size *= 2) {
        if (!qp_grow((void **)sizes, capacity, *count + 1, sizeof **sizes)) {
            *memory = false;
            return false;
        }
        (*sizes)[(*count)++] = size;
        if (size > range.last / 2) return true;
    }
}

qp_status cli_size_list_read(const char *option, const char *text, uint64_t **sizes, size_t *count,
                             qp_error *err) {
    size_t capacity = 0, kept = 0;
    bool memory = true, good = true;
    *sizes = NULL;
    *count = 0;
    char *copy = strdup(text), *rest = copy;
    if (copy == NULL) return qp_fail_memory(err, strlen(text), "a list of sizes");
    while (rest != NULL && good) good = add_item(strsep(&rest, ","), sizes, count, &capacity, &memory);
    free(copy);
    if (!good) {
        free(*sizes);
        *sizes = NULL;
        *count = 0;
        if (!memory) return qp_fail_memory(err, capacity * sizeof **sizes, "a list of sizes");
        return qp_fail(err, QP_BAD_INPUT, "%s: '%s' is no list of sizes such as 64K..32M or 100K,1M", option,
                       text);
    }
    qsort(*sizes, *count, sizeof **sizes, by_size);
    for (size_t i = 0; i < *count; ++i)
        if (kept == 0 || (*sizes)[kept - 1] != (*sizes)[i]) (*sizes)[kept++] = (*sizes)[i];
    *count = kept;
    return QP_OK;
}
