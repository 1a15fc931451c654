/* One frame: hull, then domain, for every patch of a surface (sections 5 to 7 of the paper). */
#include "host/frame/frame.h"
#include "host/base/measure.h"
#include "kernels/frame_layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put_real(const qp_frame *frame, void *reals, size_t i, double x) {
    if (frame->options.precision == QP_FLOAT)
        ((float *)reals)[i] = (float)x;
    else
        ((double *)reals)[i] = x;
}

static bool has_tolerance(const qp_tessellation *t) {
    return t->patch_factors == NULL && t->edge_factors == NULL && t->tolerance != 0;
}

qp_status qp_frame_update_positions(qp_frame *frame, qp_error *err) {
    const qp_mesh *mesh = frame->surface->mesh;
    const size_t count = 3 * (size_t)mesh->n_vertices, reals = QP_POSITION_FIRST + count;
    for (size_t i = 0; i < count; ++i) {
        if (!(fabs(mesh->positions[i]) <= QP_COORDINATE_LIMIT))
            return qp_fail(err, QP_BAD_INPUT, "position %g of vertex %zu is not within %g of the origin",
                           mesh->positions[i], i / 3, QP_COORDINATE_LIMIT);
    }
    void *local = qp_alloc(reals, frame->real_size, true);
    if (local == NULL) return qp_fail_memory(err, reals * frame->real_size, "positions");
    const qp_local_frame f = qp_mesh_local_frame(mesh);
    for (size_t axis = 0; axis < 3; ++axis) {
        const double most = frame->options.precision == QP_FLOAT ? (double)(float)f.centre[axis] : f.centre[axis];
        put_real(frame, local, QP_POSITION_CENTRE + axis, most);
        put_real(frame, local, QP_POSITION_REST + axis, f.centre[axis] - most);
    }
    put_real(frame, local, QP_POSITION_SCALE, ldexp(1.0, f.exponent));
    for (size_t i = 0; i < count; ++i)
        put_real(frame, local, QP_POSITION_FIRST + i,
                 ldexp(mesh->positions[i] - f.centre[i % 3], -f.exponent));
    qp_status status = QP_OK;
    if (qp_frame_is_cached(frame)) status = qp_cache_move(frame, local, reals * frame->real_size, err);
    if (status == QP_OK)
        status = qp_frame_upload(frame, &frame->positions, local, reals * frame->real_size, "positions", err);
    free(local);
    if (has_tolerance(&frame->tessellation)) frame->tessellated = false;
    free(frame->light);
    frame->light = NULL;
    return status;
}

qp_status qp_frame_create(qp_device *device, const qp_surface *surface, const qp_frame_options *options,
                          qp_frame **frame, qp_error *err) {
    *frame = NULL;
    if (options != NULL && !(options->tolerance >= 0 && options->tolerance <= DBL_MAX))
        return qp_fail(err, QP_BAD_INPUT, "tolerance %g is not a number from 0 on", options->tolerance);
    qp_frame *f = qp_alloc(1, sizeof *f, true);
    if (f == NULL) return qp_fail_memory(err, sizeof *f, "a frame");
    f->device = device;
    f->surface = surface;
    if (options != NULL) f->options = *options;
    f->real_size = f->options.precision == QP_DOUBLE ? sizeof(double) : sizeof(float);
    qp_status status = qp_frame_upload_plans(f, err);
    if (status == QP_OK) status = qp_frame_update_positions(f, err);
    if (status == QP_OK && !f->options.no_sharing) status = qp_share_create(surface, &f->share, err);
    if (status != QP_OK) {
        qp_frame_free(f);
        return status;
    }
    *frame = f;
    return QP_OK;
}

void qp_frame_drop_stream(qp_frame *frame) {
    free(frame->vertices);
    free(frame->flags);
    free(frame->derivatives);
    free(frame->ordered);
    frame->vertices = frame->derivatives = frame->ordered = NULL;
    frame->flags = NULL;
    frame->vertex_bytes = frame->flag_bytes = frame->derivative_bytes = frame->ordered_bytes = 0;
}

void qp_frame_free(qp_frame *frame) {
    if (frame == NULL) return;
    qp_frame_drop_layout(frame);
    qp_buffer *const buffers[] = {&frame->heads,  &frame->trees,     &frame->reals,
                                  &frame->rings,  &frame->positions, &frame->entries,
                                  &frame->grid_u, &frame->grid_v,    &frame->support};
    for (size_t i = 0; i < sizeof buffers / sizeof buffers[0]; ++i) qp_buffer_free(frame->device, buffers[i]);
    qp_ring_free(frame);
    qp_cache_free(frame);
    qp_program_free(&frame->program);
    qp_frame_drop_deep(frame);
    free(frame->patch_factors);
    free(frame->edge_factors);
    qp_share_free(frame->share);
    qp_frame_drop_stream(frame);
    free(frame);
}

/* Starts the kernels of every batch. */
static qp_status launch_batches(qp_frame *frame, double *hull_ms, double *domain_ms, qp_error *err) {
    const bool has_ring = qp_frame_has_ring(frame), cached = qp_frame_is_cached(frame);
    qp_status status = has_ring ? qp_ring_reset(frame, err) : cached ? qp_cache_begin(frame, err) : QP_OK;
    for (size_t b = 0; b < frame->n_batches && status == QP_OK; ++b) {
        qp_frame_batch *batch = &frame->batches[b];
        status = qp_buffer_unmap(frame->device, &batch->vertices, err);
        if (status == QP_OK) status = qp_buffer_unmap(frame->device, &batch->flags, err);
        if (status == QP_OK) status = qp_buffer_unmap(frame->device, &batch->derivatives, err);
        const qp_arg hull[] = {QP_ARGS_PLANS(frame), {NULL, batch->first_general}, {&frame->support, 0}};
        const qp_arg domain[] = {QP_ARGS_PLANS(frame), {NULL, batch->first_general}, {&frame->support, 0},
                                 QP_ARGS_SAMPLES(frame, batch)};
        const qp_arg regular[] = {{&frame->rings, 0}, {&frame->positions, 0}, {&frame->entries, 0},
                                  {NULL, batch->first_regular}, QP_ARGS_SAMPLES(frame, batch)};
        if (status == QP_OK && has_ring) status = qp_ring_launch(frame, b, hull_ms, domain_ms, err);
        if (status == QP_OK && cached) status = qp_cache_launch(frame, batch, hull_ms, err);
        if (status == QP_OK && !has_ring && !cached)
            status = qp_launch(frame->device, &frame->program, QP_KERNEL_HULL, hull,
                               sizeof hull / sizeof hull[0], batch->n_general, hull_ms, err);
        if (status == QP_OK && !has_ring)
            status = qp_launch(frame->device, &frame->program, QP_KERNEL_DOMAIN, domain,
                               sizeof domain / sizeof domain[0], batch->n_general, domain_ms, err);
        if (status == QP_OK)
            status = qp_launch(frame->device, &frame->program, QP_KERNEL_REGULAR, regular,
                               sizeof regular / sizeof regular[0], batch->n_regular, domain_ms, err);
    }
    return status;
}

typedef struct order_job {
    const qp_frame *frame;
    size_t sample_bytes;
} order_job;

static void order_samples(void *context, size_t begin, size_t end, unsigned worker) {
    const order_job *job = context;
    const qp_frame *frame = job->frame;
    char *vertices = frame->ordered, *derivatives = vertices + frame->layout.n_samples * job->sample_bytes;
    const bool want = frame->options.want_derivatives != 0;
    char *flags = derivatives + (want ? frame->layout.n_samples * job->sample_bytes : 0);
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const size_t at = (size_t)frame->layout.order[i];
        memcpy(vertices + i * job->sample_bytes, (const char *)frame->vertices + at * job->sample_bytes,
               job->sample_bytes);
        if (want)
            memcpy(derivatives + i * job->sample_bytes,
                   (const char *)frame->derivatives + at * job->sample_bytes, job->sample_bytes);
        flags[i] = (char)frame->flags[at];
    }
}

/* Its hash (stream_hash.c). */
static qp_status hash_stream(const void *bytes, size_t length, uint64_t *hash, qp_error *err) {
    qp_stream_hasher *hasher;
    qp_status status = qp_stream_hasher_create(&hasher, err);
    if (status == QP_OK) status = qp_stream_hasher_add(hasher, bytes, length, err);
    if (status == QP_OK) *hash = qp_stream_hasher_value(hasher);
    qp_stream_hasher_free(hasher);
    return status;
}

qp_status qp_frame_evaluate(qp_frame *frame, bool want_hash, qp_stream *stream, qp_error *err) {
    const qp_frame_layout *layout = &frame->layout;
    const size_t sample_bytes = 6 * frame->real_size;
    *stream = (qp_stream){.precision = frame->options.precision,
                          .n_samples = layout->n_samples,
                          .vertices = frame->vertices,
                          .derivatives = frame->options.want_derivatives ? frame->derivatives : NULL,
                          .flags = frame->flags,
                          .uv = layout->uv,
                          .sample_patch = layout->sample_patch,
                          .n_triangles = layout->n_triangles,
                          .triangles = layout->triangles,
                          .support_bytes = frame->peak_points * 4 * frame->real_size,
                          .supports = qp_frame_scratch_report(frame)};
    const double start = qp_now_ms(), processor_start = qp_processor_ms();
    qp_status status = launch_batches(frame, &stream->hull_ms, &stream->domain_ms, err);
    /* Also after a failure: what was started writes its times into *stream. */
    qp_error finish_error;
    qp_status finished = qp_device_finish(frame->device, &finish_error);
    if (status == QP_OK && finished != QP_OK) status = qp_fail(err, finished, "%s", finish_error.message);
    for (size_t b = 0; b < frame->n_batches && status == QP_OK; ++b) {
        status = qp_buffer_map(frame->device, &frame->batches[b].vertices, err);
        if (status == QP_OK) status = qp_buffer_map(frame->device, &frame->batches[b].flags, err);
        if (status == QP_OK && frame->options.want_derivatives)
            status = qp_buffer_map(frame->device, &frame->batches[b].derivatives, err);
    }
    if (status == QP_OK && qp_frame_has_ring(frame)) status = qp_ring_report(frame, stream, err);
    if (status == QP_OK && qp_frame_is_cached(frame)) status = qp_cache_report(frame, &stream->supports, err);
    if (status != QP_OK) qp_cache_distrust(frame);
    if (status == QP_OK) qp_copies_apply(&layout->copies, frame->real_size, frame->vertices, frame->flags);
    if (status == QP_OK && layout->order != NULL) {
        order_job job = {frame, sample_bytes};
        qp_parallel((size_t)layout->n_samples, 4096, order_samples, &job);
        stream->vertices = frame->ordered;
        const char *after = (const char *)frame->ordered + layout->n_samples * sample_bytes;
        if (frame->options.want_derivatives) {
            stream->derivatives = after;
            after += layout->n_samples * sample_bytes;
        }
        stream->flags = (const uint8_t *)after;
    }
    stream->frame_ms = qp_now_ms() - start;
    frame->processor_ms = qp_processor_ms() - processor_start;
    if (status == QP_OK && want_hash)
        status = hash_stream(stream->vertices, (size_t)layout->n_samples * sample_bytes, &stream->hash, err);
    if (status != QP_OK) *stream = (qp_stream){0};
    return status;
}

/* Is this the tessellation that the frame is set up for? */
static bool same_tessellation(const qp_frame *frame, const qp_tessellation *t) {
    if (!frame->tessellated || t->spacing != frame->tessellation.spacing) return false;
    if ((t->patch_factors == NULL) != (frame->patch_factors == NULL)) return false;
    if (t->patch_factors != NULL)
        return memcmp(t->patch_factors, frame->patch_factors,
                      6 * sizeof(float) * frame->surface->mesh->n_patches) == 0;
    if ((t->edge_factors == NULL) != (frame->edge_factors == NULL)) return false;
    if (t->edge_factors != NULL)
        return memcmp(t->edge_factors, frame->edge_factors, sizeof(float) * frame->surface->mesh->n_edges) ==
               0;
    return t->factor == frame->tessellation.factor && t->tolerance == frame->tessellation.tolerance;
}

/* A copy of n factors in *copy, in place of what it was; NULL of NULL. */
static qp_status keep_factors(float **copy, const float *factors, size_t n, qp_error *err) {
    free(*copy);
    *copy = NULL;
    if (factors == NULL) return QP_OK;
    *copy = qp_alloc(n, sizeof(float), false);
    if (*copy == NULL) return qp_fail_memory(err, n * sizeof(float), "tessellation factors");
    memcpy(*copy, factors, n * sizeof(float));
    return QP_OK;
}

qp_status qp_frame_factors_within(qp_frame *frame, const qp_tessellation *tessellation, float **edges, qp_error *err) {
    const size_t n_edges = frame->surface->mesh->n_edges;
    frame->tolerance = (qp_tolerance_report){0};
    *edges = NULL;
    if (!has_tolerance(tessellation)) return QP_OK;
    *edges = qp_alloc(n_edges, sizeof **edges, false);
    if (*edges == NULL) return qp_fail_memory(err, n_edges * sizeof **edges, "tessellation factors");
    return qp_tolerance_factors(frame->surface, tessellation, frame->options.precision, *edges, &frame->tolerance,
                                err);
}

static qp_status set_up(qp_frame *frame, const qp_tessellation *tessellation, qp_error *err) {
    const qp_mesh *mesh = frame->surface->mesh;
    qp_frame_drop_layout(frame);
    qp_status kept =
        keep_factors(&frame->patch_factors, tessellation->patch_factors, 6 * (size_t)mesh->n_patches, err);
    if (kept == QP_OK) kept = keep_factors(&frame->edge_factors, tessellation->edge_factors, mesh->n_edges, err);
    if (kept != QP_OK) return kept;
    frame->tessellation = *tessellation;
    frame->tessellation.patch_factors = frame->patch_factors;
    frame->tessellation.edge_factors = frame->edge_factors;
    qp_tessellation chosen = *tessellation;
    float *edges = NULL;
    qp_status status = qp_frame_factors_within(frame, tessellation, &edges, err);
    if (edges != NULL) chosen.edge_factors = edges;
    if (status == QP_OK)
        status = qp_layout_tessellate(frame->surface, &chosen, frame->share, frame->options.want_triangles,
                                      &frame->layout, err);
    free(edges);
    if (status == QP_OK) status = qp_frame_deepen(frame, false, err);
    if (status == QP_OK) status = qp_frame_upload_layout(frame, err);
    if (status == QP_OK)
        frame->tessellated = true;
    else
        qp_frame_drop_layout(frame);
    return status;
}

void qp_frame_report_tolerance(const qp_frame *frame, qp_stream *stream) {
    stream->bound = frame->tolerance.bound;
    stream->over_tolerance = frame->tolerance.over;
    stream->factor_min = frame->tolerance.factor_min;
    stream->factor_mean = frame->tolerance.factor_mean;
    stream->factor_max = frame->tolerance.factor_max;
}

qp_status qp_frame_eval(qp_frame *frame, const qp_tessellation *tessellation, qp_stream *stream,
                        qp_error *err) {
    *stream = (qp_stream){0};
    if (!same_tessellation(frame, tessellation)) {
        qp_status status = set_up(frame, tessellation, err);
        if (status != QP_OK) return status;
    }
    qp_status status = qp_frame_evaluate(frame, frame->options.want_hash != 0, stream, err);
    if (status == QP_OK) qp_frame_report_tolerance(frame, stream);
    return status;
}

qp_status qp_frame_eval_points(qp_frame *frame, uint64_t count, const uint32_t *patch, const double *uv,
                               qp_stream *stream, qp_error *err) {
    *stream = (qp_stream){0};
    qp_frame_drop_layout(frame);
    qp_status status = qp_layout_points(frame->surface, count, patch, uv, frame->share, &frame->layout, err);
    if (status == QP_OK) status = qp_frame_deepen(frame, true, err);
    if (status == QP_OK) status = qp_frame_upload_layout(frame, err);
    if (status == QP_OK) {
        status = qp_frame_evaluate(frame, frame->options.want_hash != 0, stream, err);
        if (status == QP_OK && frame->options.tolerance != 0 && !frame->options.no_exact_tail)
            stream->bound = frame->light_bound;
        return status;
    }
    qp_frame_drop_layout(frame);
    return status;
}
