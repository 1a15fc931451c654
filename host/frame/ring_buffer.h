/* The ring buffer of section 8.1 of the paper, executed: hull and domain of a patch in one work-group, whose control points live in
 * a ring of any size (kernels/ring.h). */
#ifndef QP_FRAME_RING_BUFFER_H
#define QP_FRAME_RING_BUFFER_H

#include "host/frame/streamed.h"

struct qp_frame;
struct qp_frame_item;
struct qp_frame_batch;

/* Of a frame; zero-initialised. */
typedef struct qp_ring_buffer {
    qp_buffer words, points; /* kernels/ring_layout.h */
    uint32_t capacity;       /* points, room for canaries included */
    uint32_t n_tickets;      /* patches that need a ring, of all batches */
    uint32_t *items; /* [entries] item of the layout of each; NULL in the fused schedule without a trace */
    qp_streamed streamed; /* in the streamed schedule */
    qp_trace trace;
    qp_trace_patch *patches;
    double since_ms; /* both clocks, when the buffer was made */
    uint64_t since_ticks;
} qp_ring_buffer;

/* Does the frame have a ring buffer? */
bool qp_frame_has_ring(const struct qp_frame *frame);
/* With the streamed schedule? */
bool qp_frame_is_streamed(const struct qp_frame *frame);
/* Before entries are written: room for what qp_ring_note keeps. */
qp_status qp_ring_start_notes(struct qp_frame *frame, qp_error *err);
/* Entry number `entry` is item number `item` of the layout. */
void qp_ring_note(struct qp_frame *frame, uint32_t entry, size_t item);
/* Room for the layout's batches. Errors: QP_BAD_INPUT when a patch needs more than the ring has; QP_SYSTEM. */
qp_status qp_ring_reserve(struct qp_frame *frame, qp_error *err);
/* An empty ring, before the batches of an evaluation. */
qp_status qp_ring_reset(struct qp_frame *frame, qp_error *err);
/* Starts the patches of batch number b that need points; the time goes to *domain_ms (device.h), in the streamed schedule that of the
 * hull stage to *hull_ms. */
qp_status qp_ring_launch(struct qp_frame *frame, size_t b, double *hull_ms, double *domain_ms, qp_error *err);
/* After all batches: what happened, in *stream. Errors: QP_CHECK_FAILED when a canary is dead. */
qp_status qp_ring_report(struct qp_frame *frame, qp_stream *stream, qp_error *err);
void qp_ring_free(struct qp_frame *frame);

#endif
