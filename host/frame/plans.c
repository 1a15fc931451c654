/* Which plan evaluates a patch, and the plans on the device.
 *
 * The surface's plans end at some level. Samples below it (close to a corner; anywhere along an edge when plans are very shallow)
 * are evaluated by deeper plans, made for just the patches that have such samples, in a few steps of depth, so that a patch that
 * needs a little more than the surface has does not pay for another that needs all. A plan of a level's rings is the same numbers
 * whatever its depth, and which plan a patch takes depends on its samples alone, so a frame's history shows in no bit. */
#include "host/frame/classify.h"
#include "host/frame/frame.h"
#include "kernels/frame_layout.h"

#include <stdlib.h>
#include <string.h>

/* Deeper: below all semi-sharp creases at the least, so that they end in extraordinary corners only. Then shallower ones. */
static const uint32_t step_levels[QP_PLAN_STEPS] = {16, 24, 40, QP_DEPTH_LIMIT, 2, 3, 4, 6, 8};

uint32_t qp_step_level(uint8_t step) {
    return step_levels[step - 1];
}

static uint8_t step_for(int level) {
    uint8_t step = 0;
    while (step + 1 < QP_DEEP_STEPS && (int)step_levels[step] < level) ++step;
    return step + 1;
}

static const qp_surface *surface_at(const qp_frame *frame, uint8_t step) {
    return step == 0 ? frame->surface : frame->deep[step - 1];
}

qp_frame_plan qp_frame_plan_of(const qp_frame *frame, uint32_t patch) {
    const uint8_t step = frame->patch_step == NULL ? 0 : frame->patch_step[patch];
    const qp_surface *surface = surface_at(frame, step);
    const uint32_t plan = surface->patch_plan[patch];
    return (qp_frame_plan){.plan = surface->plans[plan],
                           .index = frame->first_plan[step] + plan,
                           .rotation = surface->patch_rotation[patch],
                           .ring = frame->first_ring[step] + qp_frame_ring_word(surface, patch),
                           .surface = surface};
}

/* ---- what the samples need ---- */

typedef struct depth_job {
    const qp_frame *frame;
    const uint8_t *light; /* NULL: without a tolerance */
    uint8_t *steps;       /* [n_items] */
} depth_job;

/* The deepest level at which a sample of the item lies, of those that its plan does not evaluate exactly; 0: none. */
static int missing_level(const qp_frame *frame, const qp_frame_item *item) {
    const qp_surface *surface = frame->surface;
    const qp_plan *plan = surface->plans[surface->patch_plan[item->patch]];
    if ((plan->flags & QP_PLAN_CORNERS) == 0) return 0;
    const bool irregular = (plan->flags & QP_PLAN_IRREGULAR) != 0;
    const double covered = ldexp(1.0, -(int)plan->depth);
    int level = 0;
    if (item->nearest >= covered && !irregular) return 0;
    for (uint32_t i = 0; i < item->samples; ++i) {
        double u = qp_frame_coordinate(frame, frame->layout.grid_u[item->grid + i]);
        double v = qp_frame_coordinate(frame, frame->layout.grid_v[item->grid + i]);
        const double distance = fmax(fabs(u), fabs(v)); /* from the nearest corner */
        if (distance == 0.0 || (distance >= covered && !irregular)) continue;
        qp_rotate_uv(surface->patch_rotation[item->patch], &u, &v);
        const qp_leaf leaf = qp_classify(plan, u, v);
        if (leaf.corner) continue;
        if (leaf.kind != QP_NODE_IRREGULAR &&
            (leaf.kind != QP_NODE_EXTRAORDINARY || plan->depth == QP_DEPTH_LIMIT))
            continue;
        /* Rings of level L reach 2^-L close to a corner. */
        const int needed = distance > 0x1p-1000 ? -ilogb(distance) : 1000;
        if (needed > level) level = needed;
        if (level == 0) level = 1;
    }
    return level;
}

static void find_steps(void *context, size_t begin, size_t end, unsigned worker) {
    const depth_job *job = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        if (job->light != NULL && job->light[job->frame->layout.items[i].patch] != QP_LIGHT_NONE) {
            job->steps[i] = job->light[job->frame->layout.items[i].patch];
            continue;
        }
        const int level = missing_level(job->frame, &job->frame->layout.items[i]);
        job->steps[i] = level == 0 ? 0 : step_for(level);
    }
}

/* ---- deeper plans ---- */

qp_status qp_frame_grow_step(qp_frame *frame, uint8_t step, bool *changed, qp_error *err) {
    const uint32_t n_patches = frame->surface->mesh->n_patches;
    qp_surface **deep = &frame->deep[step - 1];
    uint8_t *mask = qp_alloc(n_patches, 1, true);
    if (mask == NULL) return qp_fail_memory(err, n_patches, "deeper plans");
    bool missing = false;
    for (uint32_t p = 0; p < n_patches; ++p) {
        const bool has = *deep != NULL && (*deep)->patch_plan[p] != QP_NONE;
        mask[p] = has || frame->patch_step[p] == step;
        missing = missing || (mask[p] && !has);
    }
    qp_status status = QP_OK;
    if (missing) {
        const qp_surface_options options = {.depth = step_levels[step - 1]};
        qp_surface *grown;
        status = qp_surface_create_for(frame->surface->mesh, &options, mask, &grown, err);
        if (status == QP_OK) {
            qp_surface_free(*deep);
            *deep = grown;
            *changed = true;
        }
    }
    free(mask);
    return status;
}

/* Raises patch_step to what the layout's samples need. */
static qp_status add_steps(qp_frame *frame, const uint8_t *light, qp_error *err) {
    const qp_frame_layout *layout = &frame->layout;
    depth_job job = {frame, light, qp_alloc(layout->n_items, 1, false)};
    if (job.steps == NULL) return qp_fail_memory(err, layout->n_items, "deeper plans");
    qp_parallel(layout->n_items, 16, find_steps, &job);
    for (size_t i = 0; i < layout->n_items; ++i) {
        uint8_t *step = &frame->patch_step[layout->items[i].patch];
        if (job.steps[i] > *step) *step = job.steps[i];
    }
    free(job.steps);
    return QP_OK;
}

/* Makes the plans that patch_step asks for. */
static qp_status grow_steps(qp_frame *frame, bool changed, qp_error *err) {
    qp_status status = QP_OK;
    for (uint8_t step = 1; step <= QP_DEEP_STEPS && status == QP_OK; ++step)
        status = qp_frame_grow_step(frame, step, &changed, err);
    if (status == QP_OK && (changed || !frame->plans_uploaded)) status = qp_frame_upload_plans(frame, err);
    return status;
}

static qp_status clear_steps(qp_frame *frame, qp_error *err) {
    const uint32_t n_patches = frame->surface->mesh->n_patches;
    if (frame->patch_step == NULL) frame->patch_step = qp_alloc(n_patches, 1, false);
    if (frame->patch_step == NULL) return qp_fail_memory(err, n_patches, "deeper plans");
    memset(frame->patch_step, 0, n_patches);
    return QP_OK;
}

qp_status qp_frame_deepen(qp_frame *frame, bool points, qp_error *err) {
    const bool light = points && frame->options.tolerance != 0;
    bool changed = false;
    if (frame->options.no_exact_tail) return QP_OK;
    qp_status status = clear_steps(frame, err);
    if (status == QP_OK && light) {
        status = qp_frame_choose_light(frame, &changed, err);
        if (status == QP_OK) status = clear_steps(frame, err);
    }
    if (status == QP_OK) status = add_steps(frame, light ? frame->light : NULL, err);
    if (status == QP_OK) status = grow_steps(frame, changed, err);
    if (status != QP_OK) qp_frame_drop_deep(frame);
    return status;
}

qp_status qp_frame_begin_steps(qp_frame *frame, qp_error *err) {
    return frame->options.no_exact_tail ? QP_OK : clear_steps(frame, err);
}

qp_status qp_frame_add_steps(qp_frame *frame, qp_error *err) {
    return frame->options.no_exact_tail ? QP_OK : add_steps(frame, NULL, err);
}

qp_status qp_frame_end_steps(qp_frame *frame, qp_error *err) {
    if (frame->options.no_exact_tail) return QP_OK;
    qp_status status = grow_steps(frame, false, err);
    if (status != QP_OK) qp_frame_drop_deep(frame);
    return status;
}

void qp_frame_drop_deep(qp_frame *frame) {
    for (uint32_t d = 0; d < QP_PLAN_STEPS; ++d) {
        qp_surface_free(frame->deep[d]);
        frame->deep[d] = NULL;
    }
    free(frame->patch_step);
    free(frame->light);
    frame->patch_step = frame->light = NULL;
}

/* ---- on the device ---- */

qp_status qp_frame_upload(qp_frame *frame, qp_buffer *buffer, const void *from, size_t bytes,
                          const char *what, qp_error *err) {
    qp_status status = qp_buffer_reserve(frame->device, buffer, bytes, what, err);
    return status == QP_OK ? qp_buffer_write(frame->device, buffer, from, bytes, err) : status;
}

/* Builds the kernels, with the code in them that the plans need, where those at hand have less. */
static qp_status build_kernels(qp_frame *frame, qp_error *err) {
    unsigned kernels = 0;
    uint32_t flags = 0;
    for (uint8_t step = 0; step <= QP_PLAN_STEPS; ++step) {
        const qp_surface *surface = surface_at(frame, step);
        for (uint32_t p = 0; surface != NULL && p < surface->mesh->n_patches; ++p) {
            if (surface->patch_plan[p] == QP_NONE) continue;
            if (step == 0 && qp_frame_is_fast(frame, p)) {
                kernels |= 1u << QP_KERNEL_REGULAR;
            } else {
                kernels |= qp_frame_is_streamed(frame)
                               ? 1u << QP_KERNEL_STREAM_HULL | 1u << QP_KERNEL_STREAM_DOMAIN
                           : qp_frame_has_ring(frame) ? 1u << QP_KERNEL_FUSED
                           : qp_frame_is_cached(frame)
                               ? 1u << QP_KERNEL_CACHED_HULL | 1u << QP_KERNEL_CACHE_FORGET | 1u << QP_KERNEL_DOMAIN
                               : 1u << QP_KERNEL_HULL | 1u << QP_KERNEL_DOMAIN;
                flags |= surface->plans[surface->patch_plan[p]]->flags;
            }
        }
    }
    if (frame->built && (flags & ~frame->plan_flags) == 0) return QP_OK;
    qp_program_free(&frame->program);
    frame->plan_flags = flags;
    qp_status status =
        qp_program_build(frame->device, frame->options.precision, kernels, flags, &frame->program, err);
    frame->built = status == QP_OK;
    return status;
}

qp_status qp_frame_upload_plans(qp_frame *frame, qp_error *err) {
    const qp_surface *surfaces[1 + QP_PLAN_STEPS];
    uint32_t n_surfaces = 0, n_plans = 0;
    uint64_t entries = 0;
    for (uint8_t step = 0; step <= QP_PLAN_STEPS; ++step) {
        const qp_surface *surface = surface_at(frame, step);
        if (surface == NULL) continue;
        surfaces[n_surfaces++] = surface;
        frame->first_plan[step] = n_plans;
        frame->first_ring[step] = entries;
        n_plans += surface->n_plans;
        entries += qp_frame_ring_words(surface);
    }
    frame->n_plans = n_plans;
    frame->plans_uploaded = false;
    qp_plan_pack pack = {0};
    qp_status status = build_kernels(frame, err);
    if (status == QP_OK) status = qp_surface_pack(surfaces, n_surfaces, frame->options.precision, &pack, err);
    if (status != QP_OK) return status;
    status =
        qp_frame_upload(frame, &frame->heads, pack.heads, pack.head_words * sizeof *pack.heads, "plans", err);
    if (status == QP_OK)
        status = qp_frame_upload(frame, &frame->trees, pack.tree, pack.tree_words * sizeof *pack.tree,
                                 "quadtrees", err);
    if (status == QP_OK) {
        /* The hull reads whole blocks of lanes: pad. */
        const size_t bytes = pack.real_count * frame->real_size, padding = QP_PADDING * frame->real_size;
        char *padded = qp_alloc(bytes + padding, 1, true);
        if (padded == NULL) {
            status = qp_fail_memory(err, bytes + padding, "stencils");
        } else {
            if (bytes != 0) memcpy(padded, pack.reals, bytes);
            status = qp_frame_upload(frame, &frame->reals, padded, bytes + padding, "stencils", err);
            free(padded);
        }
    }
    uint32_t *rings = NULL;
    if (status == QP_OK) status = qp_frame_upload_rings(frame, surfaces, n_surfaces, &rings, err);
    if (status == QP_OK && qp_frame_is_cached(frame)) status = qp_cache_number(frame, &pack, &rings, err);
    frame->plans_uploaded = status == QP_OK;
    free(rings);
    free(pack.heads);
    free(pack.tree);
    free(pack.reals);
    return status;
}
