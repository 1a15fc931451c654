/* The streamed schedule of the ring buffer (section 8.1 of the paper): launches of the hull stage fill it, launches of the domain
 * stage drain it, overlapped and all given to the device beforehand. */
#ifndef QP_FRAME_STREAMED_H
#define QP_FRAME_STREAMED_H

#include "host/device/device.h"

struct qp_frame;

/* A run of patches that go through each stage in one launch, and its piece of the ring. */
typedef struct qp_streamed_launch {
    uint32_t first_entry, first_ticket, patches;
    uint32_t begin, points; /* of the ring, room for canaries included */
    uint32_t offset;        /* from CLAIMED to begin, modulo 2^32 (kernels/stream_hull.cl) */
    uint32_t batch;
    uint32_t first_credit, credits; /* in qp_streamed.credits */
    bool drained;                   /* its domain launch is given */
    qp_event hull, domain;
} qp_streamed_launch;

/* Of a layout; zero-initialised. */
typedef struct qp_streamed {
    qp_streamed_launch *launches;
    size_t n_launches, launch_capacity;
    size_t next;       /* of an evaluation: first launch whose hull is not given */
    uint32_t *credits; /* launches whose domain stage a hull launch waits for */
    size_t n_credits, credit_capacity;
    uint64_t wraps, wasted; /* points skipped at the end of the ring */
} qp_streamed;

/* Cuts the layout's patches into launches. To be called when qp_ring_reserve knows the capacity. */
qp_status qp_streamed_plan(struct qp_frame *frame, qp_error *err);
/* Starts both stages of the patches of batch number b; times go to *hull_ms and *domain_ms (device.h). */
qp_status qp_streamed_launch_batch(struct qp_frame *frame, size_t b, double *hull_ms, double *domain_ms,
                                   qp_error *err);
/* After qp_device_finish and qp_ring_report: what the kernels do not know of the report, and of the trace, if there is one. */
qp_status qp_streamed_report(struct qp_frame *frame, qp_stream *stream, qp_error *err);
void qp_streamed_free(qp_streamed *streamed);

#endif
