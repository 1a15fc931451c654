/* What `bench error-time` measures: the samples, and the configurations of quadplan and of its peers. */
#include "host/base/module.h"
#include "host/base/random.h"
#include "host/cli/error_time.h"
#include "host/plan/plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Odd multiples of the grid, so that none lies on a tessellation's points, where approximations are at their best. */
static double off_grid(double x) {
    return (2 * floor(x * (0.5 / QP_PEER_GRID)) + 1) * QP_PEER_GRID;
}

qp_status et_make_samples(et_run *run, qp_error *err) {
    const qp_mesh *mesh = run->mesh;
    const uint64_t each = run->options->samples;
    uint64_t patches = 0;
    for (uint32_t f = 0; f < mesh->n_faces; ++f)
        if (!(mesh->face_flags[f] & QP_FACE_HOLE))
            patches += mesh->patch_offsets[f + 1] - mesh->patch_offsets[f];
    if (patches == 0) return qp_fail(err, QP_BAD_INPUT, "%s: no face has a surface", run->mesh_name);
    const uint64_t count = patches * each;
    if (count > 100000000)
        return qp_fail(err, QP_BAD_INPUT, "--samples: %llu samples in all are too many; at most 100000000",
                       (unsigned long long)count);
    run->patch = qp_alloc(count, sizeof *run->patch, false);
    run->uv = qp_alloc(count, 2 * sizeof *run->uv, false);
    run->peer_uv = qp_alloc(count, 2 * sizeof *run->peer_uv, false);
    if (run->patch == NULL || run->uv == NULL || run->peer_uv == NULL)
        return qp_fail_memory(err, count * 28, "samples");
    qp_random random = {run->options->seed};
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        for (uint32_t p = mesh->patch_offsets[f]; p < mesh->patch_offsets[f + 1]; ++p) {
            if (mesh->face_flags[f] & QP_FACE_HOLE) continue;
            /* The additive recurrence R2 (Roberts 2018), started anew in each patch. */
            double u = qp_random_unit(&random), v = qp_random_unit(&random);
            for (uint64_t i = 0; i < each; ++i, ++run->count) {
                run->patch[run->count] = p;
                run->uv[2 * run->count] = off_grid(u);
                run->uv[2 * run->count + 1] = off_grid(v);
                u = fmod(u + 0.7548776662466927, 1);
                v = fmod(v + 0.5698402909980532, 1);
            }
        }
    }
    for (uint64_t i = 0; i < 2 * count; ++i) run->peer_uv[i] = (float)run->uv[i];
    return QP_OK;
}

/* ---- quadplan ---- */

typedef struct et_surface {
    qp_surface *surface;
    double ms;
    uint64_t bytes; /* of plans, in float */
    uint32_t flags; /* of all its plans */
} et_surface;

/* By depth, crease nodes, terminal nodes. */
enum { VARIANTS = 4 };

void et_free_surfaces(et_run *run) {
    for (size_t i = 0; run->surfaces != NULL && i < (ET_MOST_LEVEL + 1) * VARIANTS; ++i)
        qp_surface_free(run->surfaces[i].surface);
    free(run->surfaces);
    run->surfaces = NULL;
}

static qp_status make_surface(const et_run *run, unsigned depth, bool crease_nodes, bool terminal_nodes,
                              et_surface *made, qp_error *err) {
    const qp_surface_options options = {
        .depth = depth, .no_crease_nodes = !crease_nodes, .no_terminal_nodes = !terminal_nodes};
    const double start = qp_now_ms();
    qp_status status = qp_surface_create(run->mesh, &options, &made->surface, err);
    made->ms = qp_now_ms() - start;
    if (status != QP_OK) return status;
    made->bytes = made->surface->ring_entries * sizeof(uint32_t);
    for (uint32_t i = 0; i < made->surface->n_plans; ++i) {
        const qp_plan *plan = made->surface->plans[i];
        made->flags |= plan->flags;
        made->bytes += 4 * ((uint64_t)plan->tree_words + (uint64_t)plan->point_count * plan->ring_size +
                            plan->constant_count);
    }
    return QP_OK;
}

static et_configuration *add_configuration(et_run *run, qp_error *err) {
    if (!qp_grow((void **)&run->configurations, &run->capacity, run->n_configurations + 1,
                 sizeof *run->configurations)) {
        qp_fail_memory(err, (run->n_configurations + 1) * sizeof *run->configurations, "configurations");
        return NULL;
    }
    et_configuration *c = &run->configurations[run->n_configurations++];
    memset(c, 0, sizeof *c);
    return c;
}

/* One plan set in both precisions, with the exact tail and without. */
static qp_status add_quadplan(et_run *run, unsigned depth, bool crease_nodes, bool terminal_nodes,
                              const et_surface *from, qp_error *err) {
    static const char *const names[] = {"quadplan-float", "quadplan-double"};
    const int precisions = qp_device_has_double(run->device) ? 2 : 1;
    for (int i = 0; i < 2 * precisions; ++i) {
        et_configuration *c = add_configuration(run, err);
        if (c == NULL) return err->status;
        c->name = names[i / 2];
        c->level = depth;
        c->precision = i / 2 == 0 ? QP_FLOAT : QP_DOUBLE;
        c->crease_nodes = crease_nodes;
        c->terminal_nodes = terminal_nodes;
        c->exact_tail = i % 2 == 0;
        c->surface = from->surface;
        c->surface_ms = from->ms;
        c->plan_bytes = from->bytes;
    }
    return QP_OK;
}

/* The deepest plans, with the tolerance that takes the shallowest ones of them that will do. */
static qp_status add_tolerances(et_run *run, qp_error *err) {
    static const double tolerances[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7};
    const et_surface *from = run->surfaces + run->options->max_level * VARIANTS;
    for (size_t i = 0; i < sizeof tolerances / sizeof *tolerances; ++i) {
        const size_t first = run->n_configurations;
        qp_status status = add_quadplan(run, (unsigned)run->options->max_level, true, true, from, err);
        if (status != QP_OK) return status;
        size_t kept = first;
        for (size_t k = first; k < run->n_configurations; ++k) {
            et_configuration *c = &run->configurations[k];
            c->tolerance = tolerances[i];
            if (c->exact_tail) run->configurations[kept++] = *c;
        }
        run->n_configurations = kept;
    }
    return QP_OK;
}

qp_status et_list_quadplan(et_run *run, qp_error *err) {
    run->surfaces = qp_alloc((ET_MOST_LEVEL + 1) * VARIANTS, sizeof *run->surfaces, true);
    if (run->surfaces == NULL) return qp_fail_memory(err, sizeof *run->surfaces, "surfaces");
    qp_status status = QP_OK;
    for (unsigned depth = 1; depth <= run->options->max_level && status == QP_OK; ++depth) {
        et_surface *first = run->surfaces + (size_t)depth * VARIANTS;
        for (unsigned v = 0; v < VARIANTS && status == QP_OK; ++v) {
            const bool crease_nodes = v % 2 == 0, terminal_nodes = v / 2 == 0;
            /* Forbidding a kind of node that no plan has changes nothing. */
            if ((!crease_nodes && !(first->flags & QP_PLAN_CREASE)) ||
                (!terminal_nodes && !(first->flags & QP_PLAN_TERMINAL)))
                continue;
            status = make_surface(run, depth, crease_nodes, terminal_nodes, first + v, err);
            if (status == QP_OK)
                status = add_quadplan(run, depth, crease_nodes, terminal_nodes, first + v, err);
        }
    }
    if (status == QP_OK) status = add_tolerances(run, err);
    if (status == QP_OK && !qp_device_has_double(run->device))
        status = et_skip_add(run, "quadplan-double", 0, "the device has no double precision", err);
    return status;
}

/* ---- Peers ---- */

bool et_peer_chosen(const char *list, const char *name) {
    if (list == NULL || strcmp(list, "all") == 0) return true;
    for (const char *at = list;; ++at) {
        const size_t length = strcspn(at, ",");
        if (length > 0 && strncmp(at, name, length) == 0 &&
            (name[length] == '\0' || name[length] == '-' || name[length] == '/'))
            return true;
        at += length;
        if (*at == '\0') return false;
    }
}

/* Every name of the list must choose something. */
static qp_status check_list(const char *list, const qp_peer_module *const *modules, int n_modules,
                            qp_error *err) {
    for (const char *at = list;; ++at) {
        char word[64];
        const size_t length = strcspn(at, ",");
        bool known = false;
        if (length < sizeof word) {
            memcpy(word, at, length);
            word[length] = '\0';
            for (int i = 0; i < n_modules; ++i)
                for (unsigned l = 0; l < QP_PEER_LISTS; ++l)
                    for (unsigned s = 0; s < modules[i]->lists[l].count; ++s)
                        known = known || et_peer_chosen(word, modules[i]->lists[l].series[s].name);
        }
        if (!known)
            return qp_fail(err, QP_BAD_INPUT,
                           "--peers: there is no peer '%.*s'; see `quadplan bench error-time --help`",
                           (int)(length < 64 ? length : 64), at);
        at += length;
        if (*at == '\0') return QP_OK;
    }
}

static qp_status add_series(et_run *run, const qp_peer_series *series, qp_error *err) {
    if (!et_peer_chosen(run->options->peers, series->name)) return QP_OK;
    for (unsigned level = series->first_level; level <= series->last_level; ++level) {
        if (level > run->options->max_level) break;
        et_configuration *c = add_configuration(run, err);
        if (c == NULL) return err->status;
        c->name = series->name;
        c->series = series;
        c->level = level;
        c->precision = series->in_double ? QP_DOUBLE : QP_FLOAT;
    }
    return QP_OK;
}

qp_status et_list_peers(et_run *run, qp_error *err) {
    static const struct {
        const char *name, *file;
    } files[] = {{"OpenSubdiv", "quadplan_opensubdiv.so"}, {"Embree", "quadplan_embree.so"}};
    enum { FILES = sizeof files / sizeof files[0] };
    const qp_peer_module *modules[FILES];
    int n_modules = 0;
    const char *list = run->options->peers;
    if (list != NULL && strcmp(list, "none") == 0) return QP_OK;
    qp_status status = QP_OK;
    for (size_t i = 0; i < FILES && status == QP_OK; ++i) {
        const void *found;
        qp_error missing = {0};
        if (qp_module_load(files[i].name, files[i].file, QP_MODULE_FOLDER, QP_PEER_MODULE_SYMBOL, &found,
                           &missing) == QP_OK)
            modules[n_modules++] = found;
        else
            status = et_skip_add(run, files[i].name, 0, missing.message, err);
    }
    if (status == QP_OK && list != NULL && strcmp(list, "all") != 0)
        status = check_list(list, modules, n_modules, err);
    for (int i = 0; i < n_modules; ++i)
        for (unsigned l = 0; l < QP_PEER_LISTS; ++l)
            for (unsigned s = 0; s < modules[i]->lists[l].count && status == QP_OK; ++s)
                status = add_series(run, &modules[i]->lists[l].series[s], err);
    return status;
}
