/* What a frame evaluates: the tessellator's points of every patch, or any points; and, behind or between them, samples that are
 * evaluated only for others to copy (share.h). */
#include "host/frame/factors.h"
#include "host/frame/frame.h"
#include "host/frame/tessellator.h"
#include "kernels/frame_layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What a grid depends on: outer factors 0..3, inner factors u, v, and WHOLE or which quarter of its patch it covers. */
enum { FACTORS = 7, WHOLE = 4 };
static const uint32_t no_grid = QP_NONE;

/* Distinct grids, by a hash table of indices. */
typedef struct grid_table {
    float *factors; /* [FACTORS * count] */
    size_t count, factor_capacity;
    uint32_t *slots; /* [n_slots], a power of two, or no_grid */
    size_t n_slots;
} grid_table;

static bool table_resize(grid_table *table, size_t n_slots) {
    uint32_t *slots = qp_alloc(n_slots, sizeof *slots, false);
    if (slots == NULL) return false;
    memset(slots, 0xff, n_slots * sizeof *slots);
    for (size_t i = 0; i < table->count; ++i) {
        size_t s = (size_t)qp_hash(table->factors + FACTORS * i, FACTORS * sizeof(float), 0) & (n_slots - 1);
        while (slots[s] != no_grid) s = (s + 1) & (n_slots - 1);
        slots[s] = (uint32_t)i;
    }
    free(table->slots);
    table->slots = slots;
    table->n_slots = n_slots;
    return true;
}

/* Index of a grid, or no_grid when memory is out. */
static uint32_t table_find(grid_table *table, const float factors[FACTORS]) {
    const size_t bytes = FACTORS * sizeof(float);
    if (2 * (table->count + 1) > table->n_slots &&
        !table_resize(table, table->n_slots == 0 ? 64 : 2 * table->n_slots))
        return no_grid;
    size_t s = (size_t)qp_hash(factors, bytes, 0) & (table->n_slots - 1);
    for (; table->slots[s] != no_grid; s = (s + 1) & (table->n_slots - 1)) {
        if (memcmp(table->factors + FACTORS * (size_t)table->slots[s], factors, bytes) == 0)
            return table->slots[s];
    }
    if (!qp_grow((void **)&table->factors, &table->factor_capacity, FACTORS * (table->count + 1),
                 sizeof(float)))
        return no_grid;
    memcpy(table->factors + FACTORS * table->count, factors, bytes);
    table->slots[s] = (uint32_t)table->count++;
    return table->slots[s];
}

typedef struct grid_job {
    const grid_table *table;
    qp_spacing spacing;
    qp_tess_grid *grids;
    qp_rim *rims;
    qp_error error; /* of one of the failures, if any; written under the lock of `failed` */
    int failed;
} grid_job;

/* The points on the rim, which come first and run around counter-clockwise, whole patches assumed. */
static qp_rim find_rim(const qp_tess_grid *grid) {
    qp_rim rim = {0};
    for (; rim.count < grid->n_points; ++rim.count) {
        const float u = grid->uv[2 * (size_t)rim.count], v = grid->uv[2 * (size_t)rim.count + 1];
        const bool at_u = u == 0 || u == 1, at_v = v == 0 || v == 1;
        if (!at_u && !at_v) break;
        if (at_u && at_v) rim.corner[v == 0 ? (u == 0 ? 0 : 1) : (u == 0 ? 3 : 2)] = rim.count;
    }
    return rim;
}

/* From a quarter's (u,v) to its patch's; exact, for the tessellator's points are multiples of 2^-16. */
static void place_quarter(qp_tess_grid *grid, unsigned quarter) {
    const float add[2] = {(float)(quarter & 1u), (float)(quarter >> 1)};
    for (size_t i = 0; i < 2 * (size_t)grid->n_points; ++i) grid->uv[i] = 0.5f * (grid->uv[i] + add[i & 1u]);
}

static void make_grids(void *context, size_t begin, size_t end, unsigned worker) {
    grid_job *job = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const float *f = job->table->factors + FACTORS * i;
        qp_error error;
        if (qp_tessellate(job->spacing, f, f + 4, &job->grids[i], &error) == QP_OK) {
            job->rims[i] = find_rim(&job->grids[i]);
            if (f[6] < WHOLE) place_quarter(&job->grids[i], (unsigned)f[6]);
            continue;
        }
        if (__atomic_exchange_n(&job->failed, 1, __ATOMIC_RELAXED) == 0) job->error = error;
        return;
    }
}

/* The grid of every part in *part_grid (malloced). */
static qp_status assign_grids(uint32_t n_patches, const qp_part_factors *factors, grid_table *table,
                              uint32_t **part_grid, qp_error *err) {
    const uint64_t n_parts = factors->first[n_patches];
    *part_grid = qp_alloc((size_t)n_parts, sizeof **part_grid, false);
    if (*part_grid == NULL)
        return qp_fail_memory(err, (size_t)n_parts * sizeof **part_grid, "grids of patches");
    for (uint32_t p = 0; p < n_patches; ++p) {
        const uint64_t first = factors->first[p], end = factors->first[p + 1];
        for (uint64_t i = first; i < end; ++i) {
            float f[FACTORS];
            memcpy(f, factors->values + 6 * (size_t)i, 6 * sizeof *f);
            f[6] = end - first == 1 ? WHOLE : (float)(i - first);
            (*part_grid)[i] = table_find(table, f);
            if ((*part_grid)[i] == no_grid)
                return qp_fail_memory(err, FACTORS * sizeof(float) * table->count, "tessellation factors");
        }
    }
    return QP_OK;
}

/* The grids of a tessellation, while it is laid out. */
typedef struct tessellation {
    const qp_surface *surface;
    const qp_share *share; /* or NULL */
    qp_part_factors factors;
    grid_table table;
    uint32_t *part_grid;
    qp_tess_grid *grids; /* [table.count], as the next ones */
    qp_rim *rims;
    uint64_t *grid_first; /* in the layout's grids */
    uint32_t *levels;
    uint64_t *part_triangle; /* first triangle of each part */
} tessellation;

typedef struct fill_job {
    const qp_frame_layout *layout;
    const tessellation *tess;
} fill_job;

/* Expands the grids of some items into the stream's arrays. */
static void fill_items(void *context, size_t begin, size_t end, unsigned worker) {
    const fill_job *job = context;
    const qp_frame_layout *layout = job->layout;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const qp_frame_item *item = &layout->items[i];
        const qp_tess_grid *grid = &job->tess->grids[job->tess->part_grid[i]];
        memcpy(layout->uv + 2 * item->out, grid->uv, 2 * sizeof(float) * item->samples);
        for (uint32_t s = 0; s < item->samples; ++s) layout->sample_patch[item->out + s] = item->patch;
        if (layout->triangles == NULL) continue;
        uint32_t *out = layout->triangles + 3 * job->tess->part_triangle[i];
        for (size_t t = 0; t < 3 * (size_t)grid->n_triangles; ++t)
            out[t] = (uint32_t)item->out + grid->triangles[t];
    }
}

/* Arrays for n_samples samples and grid_points grid points. */
static qp_status alloc_layout(qp_frame_layout *layout, bool want_triangles, qp_error *err) {
    if (layout->n_samples > SIZE_MAX / 64 || layout->n_triangles > SIZE_MAX / 64)
        return qp_fail_memory(err, SIZE_MAX, "the vertex stream");
    const size_t samples = (size_t)layout->n_samples, points = layout->grid_points;
    layout->uv = qp_alloc(samples, 2 * sizeof(float), false);
    layout->sample_patch = qp_alloc(samples, sizeof(uint32_t), false);
    layout->grid_u = qp_alloc(points, sizeof(double), false);
    layout->grid_v = qp_alloc(points, sizeof(double), false);
    if (want_triangles)
        layout->triangles = qp_alloc((size_t)layout->n_triangles, 3 * sizeof(uint32_t), false);
    if (layout->uv == NULL || layout->sample_patch == NULL || layout->grid_u == NULL ||
        layout->grid_v == NULL || (want_triangles && layout->triangles == NULL))
        return qp_fail_memory(err, samples * 12 + points * 16 + (size_t)layout->n_triangles * 12,
                              "the vertex stream");
    return QP_OK;
}

/* An item a part. */
static void make_items(tessellation *t, qp_frame_layout *layout) {
    const uint32_t n_patches = t->surface->mesh->n_patches;
    for (size_t g = 0; g < t->table.count; ++g) {
        uint32_t level = qp_tess_grid_level(&t->grids[g]);
        t->levels[g] = level < QP_LEVELS ? level : QP_LEVELS - 1;
        t->grid_first[g] = layout->grid_points;
        layout->grid_points += t->grids[g].n_points;
    }
    for (uint32_t p = 0; p < n_patches; ++p) {
        /* Quarters take the level of the finest, so that a sample on two of them is evaluated in just the same way. */
        uint32_t level = 0;
        for (uint64_t i = t->factors.first[p]; i < t->factors.first[p + 1]; ++i)
            if (t->levels[t->part_grid[i]] > level) level = t->levels[t->part_grid[i]];
        for (uint64_t i = t->factors.first[p]; i < t->factors.first[p + 1]; ++i) {
            const uint32_t g = t->part_grid[i];
            t->part_triangle[i] = layout->n_triangles;
            layout->items[layout->n_items++] =
                (qp_frame_item){p, t->grids[g].n_points, level, t->grid_first[g], layout->n_samples};
            layout->n_samples += t->grids[g].n_points;
            layout->n_triangles += t->grids[g].n_triangles;
        }
    }
}

/* The copies of the layout, and the ghosts they need. */
static qp_status share_samples(const tessellation *t, qp_frame_layout *layout, qp_ghosts *ghosts,
                               qp_error *err) {
    *ghosts = (qp_ghosts){0};
    if (t->share == NULL) return QP_OK;
    qp_share_part *parts = qp_alloc(layout->n_items, sizeof *parts, false);
    if (parts == NULL) return qp_fail_memory(err, layout->n_items * sizeof *parts, "shared samples");
    for (size_t i = 0; i < layout->n_items; ++i) {
        const uint32_t g = t->part_grid[i];
        parts[i] = (qp_share_part){layout->items[i].out, t->grids[g].uv, &t->rims[g]};
    }
    qp_status status = qp_share_tessellation(t->share, t->factors.first, parts, &layout->copies, ghosts, err);
    free(parts);
    return status;
}

typedef struct ghost_place {
    uint32_t patch;
    size_t ghost;
} ghost_place;

static int by_patch(const void *a, const void *b) {
    const ghost_place *x = a, *y = b;
    if (x->patch != y->patch) return x->patch < y->patch ? -1 : 1;
    return x->ghost < y->ghost ? -1 : x->ghost > y->ghost;
}

/* Puts the ghosts behind the stream, an item a patch, and names their places in the copies. */
static qp_status place_ghosts(const qp_ghosts *ghosts, uint64_t first_point, qp_frame_layout *layout,
                              qp_error *err) {
    ghost_place *places = qp_alloc(ghosts->count, sizeof *places, false);
    uint64_t *at = qp_alloc(ghosts->count, sizeof *at, false);
    qp_frame_item *items = realloc(layout->items, (layout->n_items + ghosts->count + 1) * sizeof *items);
    if (items != NULL) layout->items = items;
    if (places == NULL || at == NULL || items == NULL) {
        free(places);
        free(at);
        return qp_fail_memory(err, ghosts->count * sizeof *items, "shared samples");
    }
    for (size_t i = 0; i < ghosts->count; ++i) places[i] = (ghost_place){ghosts->list[i].patch, i};
    qsort(places, ghosts->count, sizeof *places, by_patch);
    for (size_t i = 0; i < ghosts->count; ++i) {
        const qp_ghost *ghost = &ghosts->list[places[i].ghost];
        at[places[i].ghost] = layout->n_samples + i;
        layout->grid_u[first_point + i] = ghost->u;
        layout->grid_v[first_point + i] = ghost->v;
        if (i == 0 || places[i].patch != places[i - 1].patch)
            items[layout->n_items++] =
                (qp_frame_item){ghost->patch, 0, QP_LEVELS - 1, first_point + i, layout->n_samples + i};
        ++items[layout->n_items - 1].samples;
    }
    for (size_t i = 0; i < layout->copies.count; ++i) {
        qp_copy *copy = &layout->copies.list[i];
        if (copy->from >= QP_SHARE_GHOST) copy->from = at[copy->from - QP_SHARE_GHOST];
    }
    free(places);
    free(at);
    return QP_OK;
}

/* Items from the grids of the parts. */
static qp_status list_items(tessellation *t, qp_frame_layout *layout, qp_error *err) {
    const size_t n_grids = t->table.count, n_parts = (size_t)t->factors.first[t->surface->mesh->n_patches];
    t->grid_first = qp_alloc(n_grids, sizeof *t->grid_first, false);
    t->levels = qp_alloc(n_grids, sizeof *t->levels, false);
    t->part_triangle = qp_alloc(n_parts, sizeof *t->part_triangle, false);
    layout->items = qp_alloc(n_parts, sizeof *layout->items, false);
    if (t->grid_first == NULL || t->levels == NULL || t->part_triangle == NULL || layout->items == NULL)
        return qp_fail_memory(err, n_parts * sizeof *layout->items, "the patches of a frame");
    make_items(t, layout);
    return QP_OK;
}

/* Items, and the arrays filled. */
static qp_status expand(tessellation *t, bool want_triangles, qp_frame_layout *layout, qp_error *err) {
    const size_t n_grids = t->table.count;
    qp_status status = list_items(t, layout, err);
    if (status != QP_OK) return status;
    if (want_triangles && layout->n_samples > UINT32_MAX)
        return qp_fail(err, QP_BAD_INPUT, "%llu samples are too many for triangles of 32-bit indices",
                       (unsigned long long)layout->n_samples);
    const uint64_t first_ghost_point = layout->grid_points;
    const size_t n_items = layout->n_items;
    qp_ghosts ghosts;
    status = share_samples(t, layout, &ghosts, err);
    layout->grid_points += ghosts.count;
    layout->n_evaluated = layout->n_samples + ghosts.count;
    if (status == QP_OK) status = alloc_layout(layout, want_triangles, err);
    for (size_t g = 0; g < n_grids && status == QP_OK; ++g) {
        for (size_t i = 0; i < t->grids[g].n_points; ++i) {
            layout->grid_u[t->grid_first[g] + i] = (double)t->grids[g].uv[2 * i];
            layout->grid_v[t->grid_first[g] + i] = (double)t->grids[g].uv[2 * i + 1];
        }
    }
    if (status == QP_OK && ghosts.count != 0) status = place_ghosts(&ghosts, first_ghost_point, layout, err);
    free(ghosts.list);
    if (status != QP_OK) return status;
    fill_job job = {layout, t};
    qp_parallel(n_items, 64, fill_items, &job);
    return QP_OK;
}

/* The grids of the parts, distinct ones once; what it made is freed by free_tessellation(). */
static qp_status make_tessellation(tessellation *t, const qp_tessellation *tess, qp_error *err) {
    qp_status status = qp_factors_make(t->surface, tess, &t->factors, err);
    if (status == QP_OK)
        status = assign_grids(t->surface->mesh->n_patches, &t->factors, &t->table, &t->part_grid, err);
    if (status != QP_OK) return status;
    t->grids = qp_alloc(t->table.count, sizeof *t->grids, true);
    t->rims = qp_alloc(t->table.count, sizeof *t->rims, false);
    if (t->grids == NULL || t->rims == NULL)
        return qp_fail_memory(err, t->table.count * sizeof *t->grids, "tessellation grids");
    grid_job job = {.table = &t->table, .spacing = tess->spacing, .grids = t->grids, .rims = t->rims};
    qp_parallel(t->table.count, 16, make_grids, &job);
    return job.failed ? qp_fail(err, job.error.status, "%s", job.error.message) : QP_OK;
}

static void free_tessellation(tessellation *t) {
    for (size_t i = 0; t->grids != NULL && i < t->table.count; ++i) qp_tess_grid_free(&t->grids[i]);
    qp_factors_free(&t->factors);
    free(t->grids);
    free(t->rims);
    free(t->part_grid);
    free(t->grid_first);
    free(t->levels);
    free(t->part_triangle);
    free(t->table.factors);
    free(t->table.slots);
}

qp_status qp_layout_tessellate(const qp_surface *surface, const qp_tessellation *tess, const qp_share *share,
                               bool want_triangles, qp_frame_layout *layout, qp_error *err) {
    *layout = (qp_frame_layout){0};
    tessellation t = {.surface = surface, .share = share};
    qp_status status = make_tessellation(&t, tess, err);
    if (status == QP_OK) status = expand(&t, want_triangles, layout, err);
    free_tessellation(&t);
    if (status != QP_OK) qp_layout_free(layout);
    return status;
}

qp_status qp_layout_items(const qp_surface *surface, const qp_tessellation *tess, qp_frame_layout *layout,
                          qp_error *err) {
    *layout = (qp_frame_layout){0};
    tessellation t = {.surface = surface};
    qp_status status = make_tessellation(&t, tess, err);
    if (status == QP_OK) status = list_items(&t, layout, err);
    free_tessellation(&t);
    if (status != QP_OK) qp_layout_free(layout);
    return status;
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

/* ---- Points of the caller ---- */

/* Samples an item may have; a patch with more takes several. */
enum { ITEM_SAMPLES = 1 << 16 };

static qp_status check_points(const qp_surface *surface, uint64_t count, const uint32_t *patch,
                              const double *uv, qp_error *err) {
    for (uint64_t i = 0; i < count; ++i) {
        const unsigned long long at = i;
        if (patch[i] >= surface->mesh->n_patches)
            return qp_fail(err, QP_BAD_INPUT, "point %llu: there is no patch %u", at, patch[i]);
        if (surface->patch_plan[patch[i]] == QP_NONE)
            return qp_fail(err, QP_BAD_INPUT, "point %llu: patch %u is a hole", at, patch[i]);
        const double u = uv[2 * i], v = uv[2 * i + 1];
        if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1))
            return qp_fail(err, QP_BAD_INPUT, "point %llu: (%.9g, %.9g) is not in [0, 1] x [0, 1]", at, u, v);
    }
    return QP_OK;
}

/* One item for each run of at most ITEM_SAMPLES points of a patch. */
static void cut_into_items(uint32_t n_patches, const uint64_t *first, qp_frame_layout *layout) {
    for (uint32_t p = 0; p < n_patches; ++p) {
        for (uint64_t at = first[p]; at < first[p + 1]; at += ITEM_SAMPLES) {
            uint64_t left = first[p + 1] - at;
            uint32_t samples = left < ITEM_SAMPLES ? (uint32_t)left : ITEM_SAMPLES;
            layout->items[layout->n_items++] = (qp_frame_item){p, samples, QP_LEVELS - 1, at, at};
        }
    }
}

/* The copies of points that lie on perimeters, with .to the number of the point. */
static qp_status share_points(const qp_share *share, uint64_t count, const uint32_t *patch, const double *uv,
                              qp_copies *copies, qp_ghosts *ghosts, qp_error *err) {
    qp_status status = QP_OK;
    for (uint64_t i = 0; share != NULL && i < count && status == QP_OK; ++i)
        status = qp_share_point(share, patch[i], uv[2 * i], uv[2 * i + 1], i, copies, ghosts, err);
    return status;
}

/* Points and ghosts go into the same items, so that all samples of a patch see the same plan. */
qp_status qp_layout_points(const qp_surface *surface, uint64_t count, const uint32_t *patch, const double *uv,
                           const qp_share *share, qp_frame_layout *layout, qp_error *err) {
    const uint32_t n_patches = surface->mesh->n_patches;
    qp_ghosts ghosts = {0};
    *layout = (qp_frame_layout){0};
    if (count > SIZE_MAX / 64) return qp_fail_memory(err, SIZE_MAX, "points");
    qp_status status = check_points(surface, count, patch, uv, err);
    if (status == QP_OK) status = share_points(share, count, patch, uv, &layout->copies, &ghosts, err);
    const uint64_t total = count + ghosts.count;
    layout->n_samples = count;
    layout->n_evaluated = total;
    layout->grid_points = (size_t)total;
    if (status == QP_OK) status = alloc_layout(layout, false, err);
    /* first[p]: where patch p's points begin, then, while they are dealt out, where its next one goes. */
    uint64_t *first = qp_alloc((size_t)n_patches + 2, sizeof *first, true);
    size_t most = n_patches + (size_t)(total / ITEM_SAMPLES);
    layout->items = qp_alloc(most, sizeof *layout->items, false);
    layout->order = qp_alloc((size_t)total, sizeof *layout->order, false);
    if (status == QP_OK && (first == NULL || layout->items == NULL || layout->order == NULL))
        status = qp_fail_memory(err, most * sizeof *layout->items + (size_t)total * 8, "points");
    if (status != QP_OK) {
        free(first);
        free(ghosts.list);
        qp_layout_free(layout);
        return status;
    }
    if (count != 0) { /* the caller's arrays may be NULL */
        for (size_t i = 0; i < 2 * (size_t)count; ++i) layout->uv[i] = (float)uv[i];
        memcpy(layout->sample_patch, patch, (size_t)count * sizeof(uint32_t));
    }
    for (uint64_t i = 0; i < total; ++i) ++first[(i < count ? patch[i] : ghosts.list[i - count].patch) + 2];
    for (uint32_t p = 0; p < n_patches; ++p) first[p + 1] += first[p];
    bool sorted = ghosts.count == 0;
    for (uint64_t i = 0; i < total; ++i) {
        const qp_ghost *ghost = i < count ? NULL : &ghosts.list[i - count];
        uint64_t at = first[(ghost == NULL ? patch[i] : ghost->patch) + 1]++;
        layout->order[i] = at;
        /* + 0 makes +0 of -0, which would be signed. */
        layout->grid_u[at] = ghost == NULL ? uv[2 * i] + 0.0 : ghost->u;
        layout->grid_v[at] = ghost == NULL ? uv[2 * i + 1] + 0.0 : ghost->v;
        sorted = sorted && at == i;
    }
    for (size_t i = 0; i < layout->copies.count; ++i) {
        qp_copy *copy = &layout->copies.list[i];
        copy->to = layout->order[copy->to];
        copy->from = layout->order[count + (copy->from - QP_SHARE_GHOST)];
    }
    cut_into_items(n_patches, first, layout);
    free(first);
    free(ghosts.list);
    if (sorted) {
        free(layout->order);
        layout->order = NULL;
    }
    return QP_OK;
}
