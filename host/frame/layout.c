/* What a frame evaluates: the tessellator's points of every patch, or of some; and, behind them, samples that are evaluated only for
 * others to copy (share.h). */
#include "host/frame/layout.h"
#include "host/frame/factors.h"
#include "host/frame/grids.h"

#include <stdlib.h>
#include <string.h>

/* Patches looked at together for where a run is to end, so that their grids are made in parallel. */
enum { AHEAD = 32 };

typedef struct part {
    uint32_t patch, grid;
} part;

struct qp_layout_maker {
    const qp_surface *surface;
    const qp_share *share; /* or NULL */
    bool want_triangles;
    qp_factors *factors;
    qp_grids grids;
    uint64_t layouts; /* made so far */
    /* Of the layout that is being made: */
    size_t n_parts, part_capacity; /* of the patches, and then of the others */
    part *parts;
    size_t first_capacity, others_capacity;
    size_t *first_part, *others_part; /* share.h */
    qp_patch_list others;
    uint64_t *part_triangle; /* first triangle of each part */
    size_t triangle_capacity;
};

qp_status qp_layout_open(const qp_surface *surface, const qp_tessellation *tess, const qp_share *share,
                         bool want_triangles, qp_layout_maker **maker, qp_error *err) {
    *maker = NULL;
    qp_layout_maker *m = qp_alloc(1, sizeof *m, true);
    if (m == NULL) return qp_fail_memory(err, sizeof *m, "a frame");
    m->surface = surface;
    m->share = share;
    m->want_triangles = want_triangles;
    m->grids.spacing = tess->spacing;
    m->grids.triangles = want_triangles;
    qp_status status = qp_factors_open(surface, tess, &m->factors, err);
    if (status == QP_OK)
        *maker = m;
    else
        qp_layout_close(m);
    return status;
}

void qp_layout_close(qp_layout_maker *m) {
    if (m == NULL) return;
    qp_factors_close(m->factors);
    qp_grids_clear(&m->grids);
    free(m->parts);
    free(m->first_part);
    free(m->others_part);
    free(m->others.list);
    free(m->part_triangle);
    free(m);
}

void qp_layout_free(qp_frame_layout *layout) {
    free(layout->items);
    free(layout->grid_u);
    free(layout->grid_v);
    free(layout->uv);
    free(layout->sample_patch);
    free(layout->triangles);
    free(layout->order);
    free(layout->copies.list);
    *layout = (qp_frame_layout){0};
}

/* ---- Parts ---- */

static bool add_part(qp_layout_maker *m, uint32_t patch, const float factors[QP_GRID_FACTORS]) {
    if (!qp_grow((void **)&m->parts, &m->part_capacity, m->n_parts + 1, sizeof *m->parts)) return false;
    const uint32_t grid = qp_grids_find(&m->grids, factors);
    m->parts[m->n_parts++] = (part){patch, grid};
    return grid != QP_NONE;
}

static bool add_patch(qp_layout_maker *m, uint32_t patch) {
    float values[QP_FACTORS_MOST], f[QP_GRID_FACTORS];
    const uint32_t n = qp_factors_of(m->factors, patch, values);
    bool good = true;
    for (uint32_t i = 0; i < n && good; ++i) {
        memcpy(f, values + 6 * (size_t)i, 6 * sizeof *f);
        f[6] = n == 1 ? QP_GRID_WHOLE : (float)i;
        good = add_part(m, patch, f);
    }
    return good;
}

/* Adds the patches first .. end - 1 and makes their grids. first_part begins with the run's first patch. */
static qp_status add_patches(qp_layout_maker *m, uint32_t run_first, uint32_t first, uint32_t end,
                             qp_error *err) {
    const size_t places = (size_t)(end - run_first) + 1;
    bool good = qp_grow((void **)&m->first_part, &m->first_capacity, places, sizeof *m->first_part);
    for (uint32_t p = first; p < end && good; ++p) {
        m->first_part[p - run_first] = m->n_parts;
        good = add_patch(m, p);
    }
    if (!good) return qp_fail_memory(err, m->n_parts * sizeof *m->parts, "the patches of a frame");
    m->first_part[end - run_first] = m->n_parts;
    return qp_grids_make(&m->grids, err);
}

/* Takes patches from `first` on while they have room; *end is the first one that is left out. */
static qp_status take_patches(qp_layout_maker *m, uint32_t first, uint64_t most, uint32_t *end,
                              qp_error *err) {
    const uint32_t n_patches = m->surface->mesh->n_patches;
    const uint32_t ahead = most == UINT64_MAX ? n_patches : AHEAD;
    uint64_t samples = 0;
    m->n_parts = 0;
    for (uint32_t from = first; from < n_patches;) {
        const uint32_t to = n_patches - from < ahead ? n_patches : from + ahead;
        qp_status status = add_patches(m, first, from, to, err);
        if (status != QP_OK) return status;
        for (; from < to; ++from) {
            uint64_t own = 0;
            for (size_t i = m->first_part[from - first]; i < m->first_part[from - first + 1]; ++i)
                own += m->grids.list[m->parts[i].grid].tess.n_points;
            if (own > most)
                return qp_fail(err, QP_BAD_INPUT, "patch %u has %llu samples, and a chunk has room for %llu",
                               from, (unsigned long long)own, (unsigned long long)most);
            if (own > most - samples) {
                m->n_parts = m->first_part[from - first];
                *end = from;
                return QP_OK;
            }
            samples += own;
        }
    }
    *end = n_patches;
    return first < n_patches ? QP_OK : add_patches(m, first, first, first, err);
}

/* Adds the parts of the patches that own samples of the run. */
static qp_status take_others(qp_layout_maker *m, uint32_t first, uint32_t end, qp_error *err) {
    qp_status status = qp_share_others(m->share, first, end, &m->others, err);
    if (status != QP_OK) return status;
    const size_t n = m->others.count;
    bool good = qp_grow((void **)&m->others_part, &m->others_capacity, n + 1, sizeof *m->others_part);
    for (size_t i = 0; i < n && good; ++i) {
        m->others_part[i] = m->n_parts;
        good = add_patch(m, m->others.list[i]);
    }
    if (!good) return qp_fail_memory(err, n * sizeof *m->others_part, "shared samples");
    m->others_part[n] = m->n_parts;
    return qp_grids_make(&m->grids, err);
}

/* ---- Items ---- */

/* Parts of one patch begin at `at`; *n is their number and the result their level. Quarters take that of the finest, so that a sample
 * on two of them is evaluated in just the same way. */
static uint32_t patch_level(const qp_layout_maker *m, size_t at, size_t end, size_t *n) {
    uint32_t level = 0;
    size_t i = at;
    for (; i < end && m->parts[i].patch == m->parts[at].patch; ++i) {
        const qp_grid *grid = &m->grids.list[m->parts[i].grid];
        if (grid->level > level) level = grid->level;
    }
    *n = i - at;
    return level;
}

/* An item a part of the run, the first n_parts, and the places of their grids. */
static qp_status make_items(qp_layout_maker *m, size_t n_parts, qp_frame_layout *layout, qp_error *err) {
    ++m->layouts;
    layout->items = qp_alloc(n_parts, sizeof *layout->items, false);
    if (layout->items == NULL ||
        !qp_grow((void **)&m->part_triangle, &m->triangle_capacity, n_parts, sizeof *m->part_triangle))
        return qp_fail_memory(err, n_parts * sizeof *layout->items, "the patches of a frame");
    size_t n;
    for (size_t at = 0; at < n_parts; at += n) {
        const uint32_t level = patch_level(m, at, n_parts, &n);
        for (size_t i = at; i < at + n; ++i) {
            qp_grid *grid = &m->grids.list[m->parts[i].grid];
            if (grid->used != m->layouts) {
                grid->used = m->layouts;
                grid->first = layout->grid_points;
                layout->grid_points += grid->tess.n_points;
            }
            m->part_triangle[i] = layout->n_triangles;
            layout->items[layout->n_items++] = (qp_frame_item){.patch = m->parts[i].patch,
                                                               .samples = grid->tess.n_points,
                                                               .level = level,
                                                               .need = level,
                                                               .away = QP_LEVELS - 1,
                                                               .grid = grid->first,
                                                               .out = layout->n_samples,
                                                               .nearest = grid->nearest};
            layout->n_samples += grid->tess.n_points;
            layout->n_triangles += grid->tess.n_triangles;
        }
    }
    return QP_OK;
}

/* ---- Arrays ---- */

typedef struct fill_job {
    const qp_frame_layout *layout;
    const qp_layout_maker *maker;
} fill_job;

/* Expands the grids of some items into the stream's arrays. */
static void fill_items(void *context, size_t begin, size_t end, unsigned worker) {
    const fill_job *job = context;
    const qp_frame_layout *layout = job->layout;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const qp_frame_item *item = &layout->items[i];
        const qp_tess_grid *grid = &job->maker->grids.list[job->maker->parts[i].grid].tess;
        memcpy(layout->uv + 2 * item->out, grid->uv, 2 * sizeof(float) * item->samples);
        for (uint32_t s = 0; s < item->samples; ++s) layout->sample_patch[item->out + s] = item->patch;
        if (layout->triangles == NULL) continue;
        uint32_t *out = layout->triangles + 3 * job->maker->part_triangle[i];
        for (size_t t = 0; t < 3 * (size_t)grid->n_triangles; ++t)
            out[t] = (uint32_t)item->out + grid->triangles[t];
    }
}

/* The stream's arrays. */
static qp_status fill_stream(const qp_layout_maker *m, size_t n_parts, qp_frame_layout *layout,
                             qp_error *err) {
    if (layout->n_samples > SIZE_MAX / 64 || layout->n_triangles > SIZE_MAX / 64)
        return qp_fail_memory(err, SIZE_MAX, "the vertex stream");
    if (m->want_triangles && layout->n_samples > UINT32_MAX)
        return qp_fail(err, QP_BAD_INPUT, "%llu samples are too many for triangles of 32-bit indices",
                       (unsigned long long)layout->n_samples);
    const size_t samples = (size_t)layout->n_samples, triangles = (size_t)layout->n_triangles;
    layout->uv = qp_alloc(samples, 2 * sizeof(float), false);
    layout->sample_patch = qp_alloc(samples, sizeof(uint32_t), false);
    if (m->want_triangles) layout->triangles = qp_alloc(triangles, 3 * sizeof(uint32_t), false);
    if (layout->uv == NULL || layout->sample_patch == NULL ||
        (m->want_triangles && layout->triangles == NULL))
        return qp_fail_memory(err, samples * 12 + triangles * 12, "the vertex stream");
    fill_job job = {layout, m};
    qp_parallel(n_parts, 16, fill_items, &job);
    return QP_OK;
}

/* The grids that items use, with room for `more` points behind them. */
static qp_status fill_grids(const qp_layout_maker *m, size_t n_parts, size_t more, qp_frame_layout *layout,
                            qp_error *err) {
    const size_t points = layout->grid_points + more;
    size_t filled = 0;
    layout->grid_u = qp_alloc(points, sizeof(double), false);
    layout->grid_v = qp_alloc(points, sizeof(double), false);
    if (layout->grid_u == NULL || layout->grid_v == NULL)
        return qp_fail_memory(err, points * 16, "tessellation grids");
    for (size_t i = 0; i < n_parts; ++i) {
        const qp_grid *grid = &m->grids.list[m->parts[i].grid];
        if (grid->first != filled)
            continue; /* filled already, as grids have their places in the order of the parts */
        for (size_t k = 0; k < grid->tess.n_points; ++k) {
            layout->grid_u[filled + k] = (double)grid->tess.uv[2 * k];
            layout->grid_v[filled + k] = (double)grid->tess.uv[2 * k + 1];
        }
        filled += grid->tess.n_points;
    }
    return QP_OK;
}

/* ---- Shared samples ---- */

/* The copies of the layout, and the ghosts they need. */
static qp_status share_samples(qp_layout_maker *m, uint32_t first, uint32_t end, qp_frame_layout *layout,
                               qp_ghosts *ghosts, qp_error *err) {
    qp_share_part *parts = qp_alloc(m->n_parts, sizeof *parts, false);
    if (parts == NULL) return qp_fail_memory(err, m->n_parts * sizeof *parts, "shared samples");
    size_t n;
    for (size_t at = 0; at < m->n_parts; at += n) {
        const uint32_t level = patch_level(m, at, m->n_parts, &n);
        for (size_t i = at; i < at + n; ++i) {
            const qp_grid *grid = &m->grids.list[m->parts[i].grid];
            parts[i] = (qp_share_part){.out = i < layout->n_items ? layout->items[i].out : 0,
                                       .uv = grid->tess.uv,
                                       .rim = &grid->rim,
                                       .patch = m->parts[i].patch,
                                       .level = level};
        }
    }
    const qp_share_parts all = {.first = first,
                                .end = end,
                                .first_part = m->first_part,
                                .parts = parts,
                                .n_others = m->others.count,
                                .others = m->others.list,
                                .others_part = m->others_part};
    qp_status status = qp_share_tessellation(m->share, &all, &layout->copies, ghosts, err);
    free(parts);
    return status;
}

/* Ghosts that follow each other, of the same patch and level. */
typedef struct ghost_run {
    uint32_t patch, level;
    size_t first, count;
} ghost_run;

static int compare_runs(const void *a, const void *b) {
    const ghost_run *x = a, *y = b;
    if (x->patch != y->patch) return x->patch < y->patch ? -1 : 1;
    if (x->level != y->level) return x->level < y->level ? -1 : 1;
    return x->first < y->first ? -1 : x->first > y->first;
}

static size_t find_runs(const qp_ghosts *ghosts, ghost_run *runs) {
    size_t n = 0;
    for (size_t i = 0; i < ghosts->count; ++i) {
        const qp_ghost *ghost = &ghosts->list[i];
        if (n == 0 || runs[n - 1].patch != ghost->patch || runs[n - 1].level != ghost->level)
            runs[n++] = (ghost_run){ghost->patch, ghost->level, i, 0};
        ++runs[n - 1].count;
    }
    if (n != 0) qsort(runs, n, sizeof *runs, compare_runs);
    return n;
}

/* The items of the ghosts, an item a patch and level; at[i] is where ghost i comes to lie behind the others. */
static void place_runs(const qp_ghosts *ghosts, const ghost_run *runs, size_t n_runs, uint64_t first_point,
                       qp_frame_layout *layout, uint64_t *at) {
    uint64_t next = 0;
    qp_reach reach = QP_REACH_NONE;
    for (size_t r = 0; r < n_runs; ++r) {
        if (r == 0 || runs[r].patch != runs[r - 1].patch || runs[r].level != runs[r - 1].level) {
            reach = QP_REACH_NONE;
            layout->items[layout->n_items++] = (qp_frame_item){.patch = runs[r].patch,
                                                               .level = runs[r].level,
                                                               .grid = first_point + next,
                                                               .out = layout->n_samples + next};
        }
        qp_frame_item *item = &layout->items[layout->n_items - 1];
        for (size_t i = runs[r].first; i < runs[r].first + runs[r].count; ++i, ++next) {
            const qp_ghost *ghost = &ghosts->list[i];
            at[i] = layout->n_samples + next;
            layout->grid_u[first_point + next] = ghost->u;
            layout->grid_v[first_point + next] = ghost->v;
            qp_reach_add(&reach, ghost->u, ghost->v);
        }
        item->samples += (uint32_t)runs[r].count;
        qp_item_reach(item, &reach);
    }
}

/* Puts the ghosts behind the stream and names their places in the copies. */
static qp_status place_ghosts(const qp_ghosts *ghosts, uint64_t first_point, qp_frame_layout *layout,
                              qp_error *err) {
    ghost_run *runs = qp_alloc(ghosts->count, sizeof *runs, false);
    uint64_t *at = qp_alloc(ghosts->count, sizeof *at, false);
    const size_t n_runs = runs == NULL ? 0 : find_runs(ghosts, runs);
    qp_frame_item *items = realloc(layout->items, (layout->n_items + n_runs + 1) * sizeof *items);
    if (items != NULL) layout->items = items;
    if (runs == NULL || at == NULL || items == NULL) {
        free(runs);
        free(at);
        return qp_fail_memory(err, ghosts->count * sizeof *runs, "shared samples");
    }
    place_runs(ghosts, runs, n_runs, first_point, layout, at);
    for (size_t i = 0; i < layout->copies.count; ++i) {
        qp_copy *copy = &layout->copies.list[i];
        if (copy->from >= QP_SHARE_GHOST) copy->from = at[copy->from - QP_SHARE_GHOST];
    }
    free(runs);
    free(at);
    return QP_OK;
}

/* ---- Layouts ---- */

static qp_status make_run(qp_layout_maker *m, uint32_t first, uint64_t most, bool without_stream,
                          qp_frame_layout *layout, uint32_t *end, qp_error *err) {
    qp_ghosts ghosts = {0};
    /* Grids that are left over are worth keeping while they are few. */
    if (m->grids.points > most) qp_grids_clear(&m->grids);
    qp_status status = take_patches(m, first, most, end, err);
    const size_t n_parts = m->n_parts;
    if (status == QP_OK && m->share != NULL) status = take_others(m, first, *end, err);
    if (status == QP_OK) status = make_items(m, n_parts, layout, err);
    if (status == QP_OK && m->share != NULL) status = share_samples(m, first, *end, layout, &ghosts, err);
    if (status == QP_OK) status = fill_grids(m, n_parts, ghosts.count, layout, err);
    const uint64_t first_ghost_point = layout->grid_points;
    layout->grid_points += ghosts.count;
    layout->n_evaluated = layout->n_samples + ghosts.count;
    if (status == QP_OK && !without_stream) status = fill_stream(m, n_parts, layout, err);
    if (status == QP_OK && ghosts.count != 0) status = place_ghosts(&ghosts, first_ghost_point, layout, err);
    free(ghosts.list);
    return status;
}

qp_status qp_layout_run(qp_layout_maker *m, uint32_t first, uint64_t most, bool without_stream,
                        qp_frame_layout *layout, uint32_t *end, qp_error *err) {
    *layout = (qp_frame_layout){0};
    qp_status status = make_run(m, first, most, without_stream, layout, end, err);
    if (status != QP_OK) qp_layout_free(layout);
    return status;
}

qp_status qp_layout_tessellate(const qp_surface *surface, const qp_tessellation *tess, const qp_share *share,
                               bool want_triangles, qp_frame_layout *layout, qp_error *err) {
    *layout = (qp_frame_layout){0};
    qp_layout_maker *m;
    uint32_t end;
    qp_status status = qp_layout_open(surface, tess, share, want_triangles, &m, err);
    if (status == QP_OK) status = qp_layout_run(m, 0, UINT64_MAX, false, layout, &end, err);
    qp_layout_close(m);
    return status;
}

qp_status qp_layout_items(const qp_surface *surface, const qp_tessellation *tess, qp_frame_layout *layout,
                          qp_error *err) {
    *layout = (qp_frame_layout){0};
    qp_layout_maker *m;
    uint32_t end;
    qp_status status = qp_layout_open(surface, tess, NULL, false, &m, err);
    if (status == QP_OK) status = take_patches(m, 0, UINT64_MAX, &end, err);
    if (status == QP_OK) status = make_items(m, m->n_parts, layout, err);
    if (status == QP_OK) layout->n_evaluated = layout->n_samples;
    qp_layout_close(m);
    if (status != QP_OK) qp_layout_free(layout);
    return status;
}
