#include "host/frame/ring_buffer.h"
#include "host/frame/frame.h"
#include "kernels/frame_layout.h"
#include "kernels/ring_layout.h"

#include <stdlib.h>
#include <string.h>

bool qp_frame_has_ring(const qp_frame *frame) {
    return frame->options.supports.kind == QP_SUPPORTS_RING;
}

bool qp_frame_is_streamed(const qp_frame *frame) {
    return qp_frame_has_ring(frame) && frame->options.supports.schedule == QP_SCHEDULE_STREAMED;
}

static size_t point_bytes(const qp_frame *frame) {
    return 4 * frame->real_size;
}

/* ---- Room ---- */

qp_status qp_ring_start_notes(qp_frame *frame, qp_error *err) {
    if (!frame->options.supports.trace && !qp_frame_is_streamed(frame)) return QP_OK;
    const size_t n = frame->layout.n_items;
    frame->ring.items = qp_alloc(n, sizeof *frame->ring.items, false);
    return frame->ring.items == NULL ? qp_fail_memory(err, n * sizeof(uint32_t), "a trace") : QP_OK;
}

void qp_ring_note(qp_frame *frame, uint32_t entry, size_t item) {
    if (frame->ring.items != NULL) frame->ring.items[entry] = (uint32_t)item;
}

/* The patch that needs most points, of those that need any, and how many it needs. */
static uint32_t largest_patch(const qp_frame *frame, uint32_t *patch) {
    uint32_t most = 0;
    *patch = 0;
    for (size_t i = 0; i < frame->layout.n_items; ++i) {
        const qp_frame_item *item = &frame->layout.items[i];
        if (qp_frame_is_fast(frame, item->patch)) continue;
        const uint32_t points = qp_frame_rows(frame, item);
        if (points <= most) continue;
        most = points;
        *patch = item->patch;
    }
    return most;
}

static size_t record_words(const qp_frame *frame) {
    return frame->options.supports.trace ? QP_RECORD_TRACE_WORDS : QP_RECORD_WORDS;
}

static size_t word_bytes(const qp_frame *frame) {
    return (QP_RB_WORDS + frame->ring.n_tickets * record_words(frame)) * sizeof(uint32_t);
}

/* Mesa's llvmpipe (22.3) makes wrong streams, and different ones, when several of its threads run the fused kernel; with one it is right. */
static bool is_unsafe(const qp_frame *frame) {
    const qp_device_info *info = qp_device_get_info(frame->device);
    const char *threads = getenv("LP_NUM_THREADS");
    const bool one = threads != NULL && (strcmp(threads, "0") == 0 || strcmp(threads, "1") == 0);
    return !qp_frame_is_streamed(frame) && strstr(info->name, "llvmpipe") != NULL && !one;
}

qp_status qp_ring_reserve(qp_frame *frame, qp_error *err) {
    if (is_unsafe(frame))
        return qp_fail(err, QP_SYSTEM,
                       "%s runs the fused ring buffer wrongly on several threads (set LP_NUM_THREADS=1)",
                       qp_device_name(frame->device));
    const qp_supports_options *supports = &frame->options.supports;
    qp_ring_buffer *ring = &frame->ring;
    uint32_t patch;
    const uint32_t most = largest_patch(frame, &patch);
    /* Canaries are no part of what was asked for. */
    const uint64_t guards = supports->canaries ? 2 * QP_RB_GUARD : 0;
    uint64_t points = supports->ring_bytes / point_bytes(frame);
    if (points > QP_RB_MOST - guards)
        return qp_fail(err, QP_BAD_INPUT, "a ring buffer of %llu bytes is too large, %llu are the most",
                       (unsigned long long)supports->ring_bytes,
                       (unsigned long long)((QP_RB_MOST - guards) * point_bytes(frame)));
    if (points < most)
        return qp_fail(
            err, QP_BAD_INPUT, "a ring buffer of %llu bytes is too small: patch %u needs %llu bytes",
            (unsigned long long)supports->ring_bytes, patch, (unsigned long long)most * point_bytes(frame));
    ring->capacity = (uint32_t)(points + guards);
    ring->n_tickets = 0;
    for (size_t b = 0; b < frame->n_batches; ++b) ring->n_tickets += frame->batches[b].n_general;
    if (ring->since_ms == 0) {
        ring->since_ms = qp_now_ms();
        ring->since_ticks = qp_device_ticks(frame->device);
    }
    const size_t bytes = word_bytes(frame);
    qp_status status =
        qp_buffer_reserve(frame->device, &ring->words, bytes, "the ring buffer's records", err);
    if (status != QP_OK) return status;
    status = qp_buffer_reserve(frame->device, &ring->points,
                               ((size_t)ring->capacity + 2 * QP_RB_MARGIN) * point_bytes(frame),
                               "the ring buffer", err);
    return status == QP_OK && qp_frame_is_streamed(frame) ? qp_streamed_plan(frame, err) : status;
}

/* ---- An evaluation ---- */

/* The canary of what is nobody's: no ticket's, at least of those that there are as yet. */
#define MARGIN_CANARY QP_RB_CANARY(0xfffffffeu)

static qp_status fill_with_canaries(qp_frame *frame, qp_error *err) {
    const size_t bytes = ((size_t)frame->ring.capacity + 2 * QP_RB_MARGIN) * point_bytes(frame);
    uint32_t *words = qp_alloc(bytes, 1, false);
    if (words == NULL) return qp_fail_memory(err, bytes, "canaries");
    for (size_t i = 0; i < bytes / sizeof *words; ++i) words[i] = MARGIN_CANARY;
    qp_status status = qp_buffer_write(frame->device, &frame->ring.points, words, bytes, err);
    free(words);
    return status;
}

qp_status qp_ring_reset(qp_frame *frame, qp_error *err) {
    const qp_supports_options *supports = &frame->options.supports;
    const size_t bytes = word_bytes(frame);
    uint32_t *words = qp_alloc(bytes, 1, true);
    if (words == NULL) return qp_fail_memory(err, bytes, "the ring buffer's records");
    words[QP_RB_CAPACITY] = frame->ring.capacity;
    words[QP_RB_OPTIONS] = (supports->retirement == QP_RETIRE_IN_ORDER ? QP_RB_IN_ORDER : 0) |
                           (supports->canaries ? QP_RB_CANARIES : 0) | (supports->trace ? QP_RB_TRACE : 0);
    qp_status status = qp_buffer_write(frame->device, &frame->ring.words, words, bytes, err);
    free(words);
    return status == QP_OK && supports->canaries ? fill_with_canaries(frame, err) : status;
}

qp_status qp_ring_launch(qp_frame *frame, size_t b, double *hull_ms, double *domain_ms, qp_error *err) {
    if (qp_frame_is_streamed(frame)) return qp_streamed_launch_batch(frame, b, hull_ms, domain_ms, err);
    const qp_frame_batch *batch = &frame->batches[b];
    uint32_t first_ticket = 0;
    for (size_t i = 0; i < b; ++i) first_ticket += frame->batches[i].n_general;
    const qp_arg args[] = {QP_ARGS_PLANS(frame),
                           {NULL, batch->first_general - first_ticket},
                           {&frame->ring.words, 0},
                           {&frame->ring.points, 0},
                           QP_ARGS_SAMPLES(frame, batch)};
    return qp_launch(frame->device, &frame->program, QP_KERNEL_FUSED, args, sizeof args / sizeof args[0],
                     batch->n_general, domain_ms, err);
}

/* ---- What happened ---- */

static uint64_t wide(const uint32_t *word) {
    return word[0] | (uint64_t)word[1] << 32;
}

/* Ticks a millisecond of the device's clock, measured since the ring was made; 0 without one. */
static double tick_rate(const qp_frame *frame) {
    const qp_ring_buffer *ring = &frame->ring;
    if (!qp_device_get_info(frame->device)->has_clock) return 0;
    double passed;
    do {
        passed = qp_now_ms() - ring->since_ms;
    } while (passed < 5);
    return (double)(qp_device_ticks(frame->device) - ring->since_ticks) / passed;
}

/* Item of the layout that a ticket stood for. */
static const qp_frame_item *item_of(const qp_frame *frame, uint32_t ticket) {
    size_t b = 0;
    while (ticket >= frame->batches[b].n_general) ticket -= frame->batches[b++].n_general;
    return &frame->layout.items[frame->ring.items[frame->batches[b].first_general + ticket]];
}

static qp_status read_trace(qp_frame *frame, double ticks_per_ms, qp_error *err) {
    qp_ring_buffer *ring = &frame->ring;
    const size_t bytes = ring->n_tickets * (size_t)QP_RECORD_TRACE_WORDS * sizeof(uint32_t);
    uint32_t *records = qp_alloc(bytes, 1, false);
    free(ring->patches);
    ring->patches = qp_alloc(ring->n_tickets, sizeof *ring->patches, false);
    if (records == NULL || ring->patches == NULL) {
        free(records);
        return qp_fail_memory(err, bytes, "a trace");
    }
    qp_status status =
        qp_buffer_read(frame->device, &ring->words, QP_RB_WORDS * sizeof(uint32_t), records, bytes, err);
    for (uint32_t t = 0; t < ring->n_tickets && status == QP_OK; ++t) {
        const uint32_t *record = records + (size_t)t * QP_RECORD_TRACE_WORDS,
                       *ticks = record + QP_RECORD_TICKS;
        const qp_frame_item *item = item_of(frame, t);
        ring->patches[t] = (qp_trace_patch){.patch = item->patch,
                                            .slot = record[QP_RECORD_SLOT],
                                            .points = record[QP_RECORD_POINTS],
                                            .samples = item->samples,
                                            .start = wide(ticks + 2 * QP_TICK_START),
                                            .allocated = wide(ticks + 2 * QP_TICK_ALLOCATED),
                                            .hulled = wide(ticks + 2 * QP_TICK_HULLED),
                                            .done = wide(ticks + 2 * QP_TICK_DONE),
                                            .retired = wide(ticks + 2 * QP_TICK_RETIRED)};
    }
    free(records);
    ring->trace = (qp_trace){ring->n_tickets, ring->patches, ticks_per_ms};
    return status;
}

/* The margins before and after the ring. */
static qp_status check_margins(qp_frame *frame, qp_error *err) {
    uint32_t words[QP_RB_MARGIN * 8];
    const size_t bytes = QP_RB_MARGIN * point_bytes(frame);
    for (int after = 0; after < 2; ++after) {
        const size_t at = after ? bytes + frame->ring.capacity * point_bytes(frame) : 0;
        qp_status status = qp_buffer_read(frame->device, &frame->ring.points, at, words, bytes, err);
        if (status != QP_OK) return status;
        for (size_t i = 0; i < bytes / sizeof words[0]; ++i) {
            if (words[i] != MARGIN_CANARY)
                return qp_fail(err, QP_CHECK_FAILED, "ring buffer: something was written %s its %s",
                               after ? "after" : "before", after ? "end" : "start");
        }
    }
    return QP_OK;
}

static qp_status check_canaries(qp_frame *frame, const uint32_t *words, qp_error *err) {
    if (words[QP_RB_BROKEN] != 0)
        return qp_fail(err, QP_CHECK_FAILED,
                       "ring buffer: the canaries of %u of %u patches were overwritten, among them those of "
                       "the %u. issued",
                       words[QP_RB_BROKEN], frame->ring.n_tickets, words[QP_RB_FIRST_BROKEN]);
    return check_margins(frame, err);
}

qp_status qp_ring_report(qp_frame *frame, qp_stream *stream, qp_error *err) {
    const qp_supports_options *supports = &frame->options.supports;
    const uint64_t bytes = point_bytes(frame);
    uint32_t words[QP_RB_WORDS];
    qp_status status = qp_buffer_read(frame->device, &frame->ring.words, 0, words, sizeof words, err);
    if (status != QP_OK) return status;
    /* Each patch once: a device whose atomics lose updates gives a ticket to two groups, or loses words of the ring. */
    const uint32_t n = frame->ring.n_tickets;
    const bool fused = !qp_frame_is_streamed(frame);
    if (words[QP_RB_RETIRED] != n ||
        (fused && (words[QP_RB_TICKET] != n || words[QP_RB_TURN] != n || words[QP_RB_ENDED] != n)))
        return qp_fail(err, QP_SYSTEM,
                       "ring buffer: %u of %u patches retired: work-groups of %s that run at one time do not "
                       "share memory",
                       words[QP_RB_RETIRED], n, qp_device_name(frame->device));
    const double ticks_per_ms = words[QP_RB_STALLS] != 0 || supports->trace ? tick_rate(frame) : 0;
    qp_supports_report *report = &stream->supports;
    report->capacity_bytes = supports->ring_bytes / bytes * bytes;
    report->peak_bytes = words[QP_RB_PEAK] * bytes;
    report->allocations = words[qp_frame_is_streamed(frame) ? QP_RB_ALLOCATIONS : QP_RB_TURN];
    report->allocated_bytes = wide(words + QP_RB_ALLOCATED) * bytes;
    report->stalls = words[QP_RB_STALLS];
    report->stall_ms = ticks_per_ms > 0 ? (double)wide(words + QP_RB_STALL_TICKS) / ticks_per_ms : 0;
    report->wraps = words[QP_RB_WRAPS];
    report->wasted_bytes = wide(words + QP_RB_WASTED) * bytes;
    report->in_flight = words[QP_RB_MOST_IN_FLIGHT];
    stream->support_bytes = report->capacity_bytes;
    if (supports->canaries) status = check_canaries(frame, words, err);
    if (status == QP_OK && supports->trace) {
        status = read_trace(frame, ticks_per_ms, err);
        stream->trace = &frame->ring.trace;
    }
    return status == QP_OK && qp_frame_is_streamed(frame) ? qp_streamed_report(frame, stream, err) : status;
}

void qp_ring_free(qp_frame *frame) {
    qp_ring_buffer *ring = &frame->ring;
    qp_buffer_free(frame->device, &ring->words);
    qp_buffer_free(frame->device, &ring->points);
    free(ring->items);
    free(ring->patches);
    qp_streamed_free(&ring->streamed);
    *ring = (qp_ring_buffer){0};
}
