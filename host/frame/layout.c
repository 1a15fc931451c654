/* What a frame evaluates: the tessellator's points of every patch.
 *
 * Uniform factor f and n-gons. The children of an n-gon each span half of a base edge, so that one of its edges
 * has a vertex in the middle and the quad beyond it must have one too (the 2k / 4k rule). With m segments along
 * every edge of a child, the quad takes 2m along an edge that it shares with an n-gon, and f along the others.
 *
 * - equal, fractional_even: m = f / 2 rounded up to a power of two (at least 2 for fractional_even). No cracks.
 *   Other numbers would leave some, for the tessellator rounds i / m and i / 2m to 16 bits after the point, each
 *   on its own.
 * - fractional_odd: m = f / 2. No odd number of segments is twice another, so edges between quads and n-gons do
 *   not match; all others do.
 *
 * An f that is a power of two, 4 or more, thus gives quads f along every edge and children f / 2. */
#include "host/frame/frame.h"
#include "host/frame/tessellator.h"
#include "kernels/frame_layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FACTORS = 6 };
static const uint32_t no_grid = QP_NONE;

/* Distinct factor sextuples, by a hash table of indices. */
typedef struct grid_table {
    float *factors; /* [FACTORS * count]: outer 0..3, inner u, v */
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

/* Index of a sextuple, or no_grid when memory is out. */
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

/* Segments of a child of an n-gon, see above. */
static float child_factor(qp_spacing spacing, float f) {
    if (spacing == QP_FRACTIONAL_ODD) return f / 2;
    float m = spacing == QP_FRACTIONAL_EVEN ? 2 : 1;
    while (m < f / 2) m *= 2;
    return m;
}

/* Marks the edges of faces that are not quads. NULL when memory is out. */
static uint8_t *mark_edges_of_ngons(const qp_mesh *mesh) {
    uint8_t *marks = qp_alloc(mesh->n_edges, 1, true);
    if (marks == NULL) return NULL;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        if (qp_face_size(mesh, mesh->corner_face[h]) != 4) marks[mesh->corner_edge[h]] = 1;
    }
    return marks;
}

typedef struct grid_job {
    const grid_table *table;
    qp_spacing spacing;
    qp_tess_grid *grids;
    qp_error error; /* of one of the failures, if any; written under the lock of `failed` */
    int failed;
} grid_job;

static void make_grids(void *context, size_t begin, size_t end, unsigned worker) {
    grid_job *job = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const float *f = job->table->factors + FACTORS * i;
        qp_error error;
        if (qp_tessellate(job->spacing, f, f + 4, &job->grids[i], &error) == QP_OK) continue;
        if (__atomic_exchange_n(&job->failed, 1, __ATOMIC_RELAXED) == 0) job->error = error;
        return;
    }
}

/* The grid of every patch of the mesh in *patch_grid (malloced), no_grid where it has no samples. */
static qp_status assign_grids(const qp_surface *surface, const qp_tessellation *tess, grid_table *table,
                              uint32_t **patch_grid, qp_error *err) {
    const qp_mesh *mesh = surface->mesh;
    uint8_t *marks = NULL;
    *patch_grid = qp_alloc(mesh->n_patches, sizeof **patch_grid, false);
    if (*patch_grid == NULL)
        return qp_fail_memory(err, mesh->n_patches * sizeof **patch_grid, "grids of patches");
    if (tess->patch_factors == NULL && (marks = mark_edges_of_ngons(mesh)) == NULL)
        return qp_fail_memory(err, mesh->n_edges, "edges of n-gons");
    qp_status status = QP_OK;
    const float m = child_factor(tess->spacing, tess->factor);
    for (uint32_t face = 0; face < mesh->n_faces && status == QP_OK; ++face) {
        for (uint32_t p = mesh->patch_offsets[face]; p < mesh->patch_offsets[face + 1]; ++p) {
            float f[FACTORS];
            (*patch_grid)[p] = no_grid;
            if (surface->patch_plan[p] == QP_NONE) continue;
            if (tess->patch_factors != NULL) {
                memcpy(f, tess->patch_factors + FACTORS * (size_t)p, sizeof f);
            } else {
                const bool quad = qp_face_size(mesh, face) == 4;
                for (int i = 0; i < FACTORS; ++i) f[i] = quad ? tess->factor : m;
                /* Outer 0..3 lie on u=0, v=0, u=1, v=1: the face's edges 3, 0, 1, 2. */
                for (uint32_t i = 0; i < 4 && quad; ++i) {
                    uint32_t corner = mesh->face_offsets[face] + (i + 3) % 4;
                    if (marks[mesh->corner_edge[corner]]) f[i] = 2 * m;
                }
            }
            /* Written so that NaN is discarded. */
            if (!(f[0] > 0 && f[1] > 0 && f[2] > 0 && f[3] > 0)) continue;
            for (int i = 4; i < FACTORS; ++i) {
                if (!(f[i] >= 1)) f[i] = 1; /* as the tessellator clamps; a NaN would never be found again */
            }
            (*patch_grid)[p] = table_find(table, f);
            if ((*patch_grid)[p] == no_grid) {
                status = qp_fail_memory(err, FACTORS * sizeof(float) * table->count, "tessellation factors");
                break;
            }
        }
    }
    free(marks);
    return status;
}

typedef struct fill_job {
    const qp_frame_layout *layout;
    const qp_tess_grid *grids;
    const uint32_t *item_grid;
    const uint64_t *item_triangle;
} fill_job;

/* Expands the grids of some items into the stream's arrays. */
static void fill_items(void *context, size_t begin, size_t end, unsigned worker) {
    const fill_job *job = context;
    const qp_frame_layout *layout = job->layout;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const qp_frame_item *item = &layout->items[i];
        const qp_tess_grid *grid = &job->grids[job->item_grid[i]];
        memcpy(layout->uv + 2 * item->out, grid->uv, 2 * sizeof(float) * item->samples);
        for (uint32_t s = 0; s < item->samples; ++s) layout->sample_patch[item->out + s] = item->patch;
        if (layout->triangles == NULL) continue;
        uint32_t *out = layout->triangles + 3 * job->item_triangle[i];
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

/* Items from the grids of the patches, and the arrays filled. */
static qp_status expand(const qp_mesh *mesh, const uint32_t *patch_grid, const qp_tess_grid *grids,
                        size_t n_grids, bool want_triangles, qp_frame_layout *layout, qp_error *err) {
    uint64_t *grid_first = qp_alloc(n_grids, sizeof *grid_first, false);
    uint32_t *levels = qp_alloc(n_grids, sizeof *levels, false);
    uint32_t *item_grid = qp_alloc(mesh->n_patches, sizeof *item_grid, false);
    uint64_t *item_triangle = qp_alloc(mesh->n_patches, sizeof *item_triangle, false);
    layout->items = qp_alloc(mesh->n_patches, sizeof *layout->items, false);
    qp_status status = QP_OK;
    if (grid_first == NULL || levels == NULL || item_grid == NULL || item_triangle == NULL ||
        layout->items == NULL) {
        status = qp_fail_memory(err, mesh->n_patches * sizeof *layout->items, "the patches of a frame");
        goto done;
    }
    for (size_t g = 0; g < n_grids; ++g) {
        uint32_t level = qp_tess_grid_level(&grids[g]);
        levels[g] = level < QP_LEVELS ? level : QP_LEVELS - 1;
        grid_first[g] = layout->grid_points;
        layout->grid_points += grids[g].n_points;
    }
    for (uint32_t p = 0; p < mesh->n_patches; ++p) {
        uint32_t g = patch_grid[p];
        if (g == no_grid || grids[g].n_points == 0) continue;
        item_grid[layout->n_items] = g;
        item_triangle[layout->n_items] = layout->n_triangles;
        layout->items[layout->n_items++] =
            (qp_frame_item){p, grids[g].n_points, levels[g], grid_first[g], layout->n_samples};
        layout->n_samples += grids[g].n_points;
        layout->n_triangles += grids[g].n_triangles;
    }
    if (want_triangles && layout->n_samples > UINT32_MAX) {
        status = qp_fail(err, QP_BAD_INPUT, "%llu samples are too many for triangles of 32-bit indices",
                         (unsigned long long)layout->n_samples);
        goto done;
    }
    status = alloc_layout(layout, want_triangles, err);
    if (status != QP_OK) goto done;
    for (size_t g = 0; g < n_grids; ++g) {
        for (size_t i = 0; i < grids[g].n_points; ++i) {
            layout->grid_u[grid_first[g] + i] = (double)grids[g].uv[2 * i];
            layout->grid_v[grid_first[g] + i] = (double)grids[g].uv[2 * i + 1];
        }
    }
    fill_job job = {layout, grids, item_grid, item_triangle};
    qp_parallel(layout->n_items, 64, fill_items, &job);
done:
    free(grid_first);
    free(levels);
    free(item_grid);
    free(item_triangle);
    return status;
}

qp_status qp_layout_tessellate(const qp_surface *surface, const qp_tessellation *tess, bool want_triangles,
                               qp_frame_layout *layout, qp_error *err) {
    *layout = (qp_frame_layout){0};
    if (tess->patch_factors == NULL && !(tess->factor >= 1 && tess->factor <= 64))
        return qp_fail(err, QP_BAD_INPUT, "tessellation factor %g is not between 1 and 64",
                       (double)tess->factor);
    if (tess->spacing != QP_EQUAL && tess->spacing != QP_FRACTIONAL_EVEN &&
        tess->spacing != QP_FRACTIONAL_ODD)
        return qp_fail(err, QP_BAD_INPUT, "unknown spacing %d", (int)tess->spacing);
    grid_table table = {0};
    uint32_t *patch_grid = NULL;
    qp_tess_grid *grids = NULL;
    qp_status status = assign_grids(surface, tess, &table, &patch_grid, err);
    if (status == QP_OK && (grids = qp_alloc(table.count, sizeof *grids, true)) == NULL)
        status = qp_fail_memory(err, table.count * sizeof *grids, "tessellation grids");
    if (status == QP_OK) {
        grid_job job = {.table = &table, .spacing = tess->spacing, .grids = grids};
        qp_parallel(table.count, 16, make_grids, &job);
        if (job.failed) status = qp_fail(err, job.error.status, "%s", job.error.message);
    }
    if (status == QP_OK)
        status = expand(surface->mesh, patch_grid, grids, table.count, want_triangles, layout, err);
    for (size_t i = 0; grids != NULL && i < table.count; ++i) qp_tess_grid_free(&grids[i]);
    free(grids);
    free(patch_grid);
    free(table.factors);
    free(table.slots);
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

qp_status qp_layout_points(const qp_surface *surface, uint64_t count, const uint32_t *patch, const double *uv,
                           qp_frame_layout *layout, qp_error *err) {
    const uint32_t n_patches = surface->mesh->n_patches;
    *layout = (qp_frame_layout){0};
    if (count > SIZE_MAX / 64) return qp_fail_memory(err, SIZE_MAX, "points");
    qp_status status = check_points(surface, count, patch, uv, err);
    if (status != QP_OK) return status;
    layout->n_samples = count;
    layout->grid_points = (size_t)count;
    status = alloc_layout(layout, false, err);
    /* first[p]: where patch p's points begin, then, while they are dealt out, where its next one goes. */
    uint64_t *first = qp_alloc((size_t)n_patches + 2, sizeof *first, true);
    size_t most = n_patches + (size_t)(count / ITEM_SAMPLES);
    layout->items = qp_alloc(most, sizeof *layout->items, false);
    layout->order = qp_alloc((size_t)count, sizeof *layout->order, false);
    if (status == QP_OK && (first == NULL || layout->items == NULL || layout->order == NULL))
        status = qp_fail_memory(err, most * sizeof *layout->items + (size_t)count * 8, "points");
    if (status != QP_OK) {
        free(first);
        qp_layout_free(layout);
        return status;
    }
    if (count != 0) { /* the caller's arrays may be NULL */
        for (size_t i = 0; i < 2 * (size_t)count; ++i) layout->uv[i] = (float)uv[i];
        memcpy(layout->sample_patch, patch, (size_t)count * sizeof(uint32_t));
    }
    for (uint64_t i = 0; i < count; ++i) ++first[patch[i] + 2];
    for (uint32_t p = 0; p < n_patches; ++p) first[p + 1] += first[p];
    bool sorted = true;
    for (uint64_t i = 0; i < count; ++i) {
        uint64_t at = first[patch[i] + 1]++;
        layout->order[i] = at;
        layout->grid_u[at] = uv[2 * i];
        layout->grid_v[at] = uv[2 * i + 1];
        sorted = sorted && at == i;
    }
    cut_into_items(n_patches, first, layout);
    free(first);
    if (sorted) {
        free(layout->order);
        layout->order = NULL;
    }
    return QP_OK;
}
