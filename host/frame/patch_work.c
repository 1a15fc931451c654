/* What each patch of a tessellation asks of hull, tessellator and domain stage: what the model of pipeline.h is fed with. */
#include "host/frame/frame.h"
#include "host/frame/pipeline.h"

#include <stdlib.h>

static qp_patch_work work_of(const qp_surface *surface, const qp_frame_item *item, uint32_t regular_points) {
    const uint32_t index = surface->patch_plan[item->patch];
    const qp_plan *plan = surface->plans[index];
    qp_patch_work work = {.patch = item->patch, .samples = item->samples};
    const bool regular = index == surface->regular_plan;
    work.points = regular ? regular_points : qp_item_rows(plan, item);
    work.ring = regular ? 1 : plan->ring_size;
    return work;
}

/* Stable, by a count of each plan's patches. Patches that the regular pass evaluates come last, as in a frame's entries. */
static qp_status sort_by_plan(const qp_surface *surface, qp_patch_work **work, size_t count, qp_error *err) {
    const uint32_t n_plans = surface->n_plans;
    size_t *first = qp_alloc((size_t)n_plans + 2, sizeof *first, true);
    qp_patch_work *sorted = qp_alloc(count, sizeof *sorted, false);
    if (first == NULL || sorted == NULL) {
        free(first);
        free(sorted);
        return qp_fail_memory(err, count * sizeof *sorted, "the work of patches");
    }
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t i = 0; i < count; ++i) {
            uint32_t plan = surface->patch_plan[(*work)[i].patch];
            if (plan == surface->regular_plan) plan = n_plans;
            if (pass == 0)
                ++first[plan + 1];
            else
                sorted[first[plan]++] = (*work)[i];
        }
        for (uint32_t p = 0; pass == 0 && p <= n_plans; ++p) first[p + 1] += first[p];
    }
    free(first);
    free(*work);
    *work = sorted;
    return QP_OK;
}

qp_status qp_patch_work_list(const qp_surface *surface, const qp_tessellation *tessellation,
                             uint32_t regular_points, bool by_plan, qp_patch_work **work, size_t *count,
                             qp_error *err) {
    qp_tessellation chosen = *tessellation;
    float *edges = NULL;
    qp_frame_layout layout = {0};
    qp_status status = QP_OK;
    *work = NULL;
    *count = 0;
    if (chosen.patch_factors == NULL && chosen.edge_factors == NULL && chosen.tolerance != 0) {
        qp_tolerance_report report;
        edges = qp_alloc(surface->mesh->n_edges, sizeof *edges, false);
        if (edges == NULL)
            return qp_fail_memory(err, surface->mesh->n_edges * sizeof *edges, "tessellation factors");
        status = qp_tolerance_factors(surface, tessellation, QP_FLOAT, edges, &report, err);
        chosen.edge_factors = edges;
    }
    if (status == QP_OK) status = qp_layout_items(surface, &chosen, &layout, err);
    free(edges);
    if (status == QP_OK) {
        *work = qp_alloc(layout.n_items, sizeof **work, false);
        if (*work == NULL)
            status = qp_fail_memory(err, layout.n_items * sizeof **work, "the work of patches");
    }
    for (size_t i = 0; i < layout.n_items && status == QP_OK; ++i)
        (*work)[i] = work_of(surface, &layout.items[i], regular_points);
    if (status == QP_OK) *count = layout.n_items;
    qp_layout_free(&layout);
    if (status == QP_OK && by_plan) status = sort_by_plan(surface, work, *count, err);
    if (status != QP_OK) {
        free(*work);
        *work = NULL;
        *count = 0;
    }
    return status;
}
