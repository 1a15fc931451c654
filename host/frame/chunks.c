/* A vertex stream in pieces: runs of patches are laid out, evaluated and handed on one after the other, so that neither the stream nor
 * what it is made from is ever held for all patches.
 *
 * Same bits. A patch's samples depend on its plan, which is chosen by all samples of the mesh that lie in it; so a first pass over all
 * runs, without evaluating any, chooses plans as for the whole mesh. Samples that a patch of another run owns are evaluated once more,
 * as ghosts, by the owner's plan and with its level, which is the same operations on the same numbers as in the owner's own run. */
#include "host/frame/frame.h"

#include <stdlib.h>

typedef struct chunk_work {
    qp_frame *frame;
    qp_layout_maker *maker;
    uint64_t most_samples; /* of one run */
    qp_chunk_consumer consumer;
    void *context;
    qp_stream_hasher *hasher; /* or NULL */
    qp_chunks *sum;
} chunk_work;

static void larger(uint64_t *a, uint64_t b) {
    if (b > *a) *a = b;
}

static void add_supports(qp_supports_report *sum, const qp_supports_report *more) {
    sum->kind = more->kind;
    larger(&sum->capacity_bytes, more->capacity_bytes);
    larger(&sum->largest_bytes, more->largest_bytes);
    larger(&sum->peak_bytes, more->peak_bytes);
    larger(&sum->in_flight, more->in_flight);
    larger(&sum->index_bytes, more->index_bytes);
    sum->worst_case_bytes += more->worst_case_bytes;
    sum->allocations += more->allocations;
    sum->allocated_bytes += more->allocated_bytes;
    sum->stalls += more->stalls;
    sum->stall_ms += more->stall_ms;
    sum->wraps += more->wraps;
    sum->wasted_bytes += more->wasted_bytes;
    sum->points_needed += more->points_needed;
    sum->points_computed += more->points_computed;
    sum->hits += more->hits;
    sum->misses_cold += more->misses_cold;
    sum->misses_capacity += more->misses_capacity;
    sum->misses_conflict += more->misses_conflict;
    sum->duplicates += more->duplicates;
    sum->invalidated += more->invalidated;
}

/* What one chunk adds to the whole. */
static void add_chunk(chunk_work *w, const qp_stream *stream) {
    qp_chunks *sum = w->sum;
    const qp_frame_layout *layout = &w->frame->layout;
    ++sum->n_chunks;
    sum->n_ghosts += layout->n_evaluated - layout->n_samples;
    sum->stream.precision = stream->precision;
    sum->stream.n_samples += stream->n_samples;
    sum->stream.n_triangles += stream->n_triangles;
    sum->stream.hull_ms += stream->hull_ms;
    sum->stream.domain_ms += stream->domain_ms;
    sum->stream.frame_ms += stream->frame_ms;
    larger(&sum->stream.support_bytes, stream->support_bytes);
    larger(&sum->peak_vertex_bytes, layout->n_evaluated * 6 * w->frame->real_size);
    add_supports(&sum->stream.supports, &stream->supports);
}

/* The message is the consumer's own, if it gave one. */
static qp_status hand_over(chunk_work *w, const qp_chunk *chunk, qp_error *err) {
    qp_error own = {0};
    const double start = qp_now_ms();
    qp_status status = w->consumer == NULL ? QP_OK : w->consumer(w->context, chunk, &own);
    if (status != QP_OK)
        status = qp_fail(err, status, "%s",
                         own.message[0] != '\0' ? own.message : "the consumer of the stream ended it");
    if (status == QP_OK && w->hasher != NULL)
        status = qp_stream_hasher_add(w->hasher, chunk->stream.vertices,
                                      (size_t)chunk->stream.n_samples * 6 * w->frame->real_size, err);
    w->sum->consumer_ms += qp_now_ms() - start;
    return status;
}

/* Evaluates the layout that the frame holds, of patches first .. end - 1. */
static qp_status eval_run(chunk_work *w, uint32_t first, uint32_t end, qp_error *err) {
    qp_chunk chunk = {.first_sample = w->sum->stream.n_samples,
                      .first_triangle = w->sum->stream.n_triangles,
                      .first_patch = first,
                      .n_patches = end - first};
    const double start = qp_now_ms();
    qp_status status = qp_frame_upload_layout(w->frame, err);
    w->sum->set_up_ms += qp_now_ms() - start;
    if (status == QP_OK) status = qp_frame_evaluate(w->frame, false, &chunk.stream, err);
    if (status != QP_OK) return status;
    add_chunk(w, &chunk.stream);
    return hand_over(w, &chunk, err);
}

/* All runs, one after the other: in the first pass for the plans they need, then for the stream. */
static qp_status go_through(chunk_work *w, bool choose_plans, qp_error *err) {
    const uint32_t n_patches = w->frame->surface->mesh->n_patches;
    qp_status status = QP_OK;
    for (uint32_t first = 0, end; first < n_patches && status == QP_OK; first = end) {
        const double start = qp_now_ms();
        status = qp_layout_run(w->maker, first, w->most_samples, choose_plans, &w->frame->layout, &end, err);
        if (status == QP_OK && choose_plans) status = qp_frame_add_steps(w->frame, err);
        w->sum->set_up_ms += qp_now_ms() - start;
        if (status == QP_OK && !choose_plans && w->frame->layout.n_samples != 0)
            status = eval_run(w, first, end, err);
        qp_frame_drop_layout(w->frame);
    }
    return status;
}

static qp_status eval_all(chunk_work *w, qp_error *err) {
    qp_status status = qp_frame_begin_steps(w->frame, err);
    if (status == QP_OK) status = go_through(w, true, err);
    if (status == QP_OK) {
        const double start = qp_now_ms();
        status = qp_frame_end_steps(w->frame, err);
        w->sum->set_up_ms += qp_now_ms() - start;
    }
    return status == QP_OK ? go_through(w, false, err) : status;
}

qp_status qp_frame_eval_chunks(qp_frame *frame, const qp_tessellation *tessellation, uint64_t chunk_bytes,
                               qp_chunk_consumer consumer, void *context, qp_chunks *sum, qp_error *err) {
    qp_chunks none;
    if (sum == NULL) sum = &none;
    *sum = (qp_chunks){0};
    chunk_work w = {.frame = frame, .consumer = consumer, .context = context, .sum = sum};
    w.most_samples = chunk_bytes / (6 * frame->real_size);
    /* Indices of triangles have 32 bits. */
    if (w.most_samples > UINT32_MAX) w.most_samples = UINT32_MAX;
    qp_frame_drop_layout(frame);
    qp_frame_drop_stream(frame);
    qp_buffer_free(frame->device, &frame->support); /* of a whole frame, maybe */
    qp_tessellation chosen = *tessellation;
    float *edges = NULL;
    const double start = qp_now_ms();
    qp_status status = qp_frame_factors_within(frame, tessellation, &edges, err);
    if (edges != NULL) chosen.edge_factors = edges;
    if (status == QP_OK)
        status = qp_layout_open(frame->surface, &chosen, frame->share, frame->options.want_triangles != 0,
                                &w.maker, err);
    sum->set_up_ms = qp_now_ms() - start;
    if (status == QP_OK && frame->options.want_hash) status = qp_stream_hasher_create(&w.hasher, err);
    if (status == QP_OK) status = eval_all(&w, err);
    if (status == QP_OK && w.hasher != NULL) sum->stream.hash = qp_stream_hasher_value(w.hasher);
    if (status == QP_OK) qp_frame_report_tolerance(frame, &sum->stream);
    qp_stream_hasher_free(w.hasher);
    qp_layout_close(w.maker);
    free(edges);
    return status;
}
