/* What a frame evaluates of a caller's points; and, between them, samples that are evaluated only for others to copy (share.h). */
#include "host/frame/layout.h"

#include <stdlib.h>
#include <string.h>

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
            layout->items[layout->n_items++] = (qp_frame_item){
                .patch = p, .samples = samples, .level = QP_LEVELS - 1, .grid = at, .out = at};
        }
    }
}

static void find_needs(void *context, size_t begin, size_t end, unsigned worker) {
    const qp_frame_layout *layout = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        qp_frame_item *item = &layout->items[i];
        qp_reach reach = QP_REACH_NONE;
        for (size_t k = (size_t)item->grid; k < (size_t)item->grid + item->samples; ++k)
            qp_reach_add(&reach, layout->grid_u[k], layout->grid_v[k]);
        qp_item_reach(item, &reach);
    }
}

static qp_status alloc_arrays(qp_frame_layout *layout, qp_error *err) {
    const size_t samples = (size_t)layout->n_samples, points = layout->grid_points;
    layout->uv = qp_alloc(samples, 2 * sizeof(float), false);
    layout->sample_patch = qp_alloc(samples, sizeof(uint32_t), false);
    layout->grid_u = qp_alloc(points, sizeof(double), false);
    layout->grid_v = qp_alloc(points, sizeof(double), false);
    if (layout->uv == NULL || layout->sample_patch == NULL || layout->grid_u == NULL ||
        layout->grid_v == NULL)
        return qp_fail_memory(err, samples * 12 + points * 16, "the vertex stream");
    return QP_OK;
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
    if (status == QP_OK) status = alloc_arrays(layout, err);
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
    qp_parallel(layout->n_items, 64, find_needs, layout);
    free(first);
    free(ghosts.list);
    if (sorted) {
        free(layout->order);
        layout->order = NULL;
    }
    return QP_OK;
}
