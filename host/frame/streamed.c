/* Host and device agree on a plan of launches. Launch k has a run of patches, as many as fit a part of the ring, and a piece of the
 * ring for all of them; pieces follow each other around the ring, each whole. Within a launch the kernel hands out places by atomics.
 *
 * Credits. The hull launch k may start when the domain launches of those that hold room of its piece are done: an event for each, given
 * along with the launch, so that the host never waits. What "those" are is what retirement means here:
 *   in order      a launch gives its room back when it and all launches before it are drained, as hardware does that keeps the order of
 *                 rasterization: domain launches run one after the other, in order, in one queue;
 *   out of order  a launch gives its room back as soon as its own domain launch is done: domain launches go to two queues in turn and may
 *                 overtake each other, and a hull launch waits for none but those whose room it takes.
 *
 * No deadlock. Everything is given to the device in one sequence, in which a launch comes after all that it waits for: a hull launch
 * after the domain launches that are its credits, a domain launch after its hull launch, and each after those before it in its queue.
 * So the first launch of the sequence that has not ended can always run; no kernel waits for anything (kernels/stream_hull.cl); hence
 * all end, on any device, also on one that runs one work-group at a time, and with a ring of one patch.
 *
 * No race. Two launches have points in common only if the hull launch of the later one waits for the domain launch of the earlier one: by
 * event, or because a hull launch in between, of the same queue, did. Each patch has its own entry, record and samples; what is shared
 * are words that kernels change by atomics. */
#include "host/frame/streamed.h"
#include "host/frame/frame.h"
#include "kernels/ring_layout.h"

#include <stdlib.h>

/* A launch takes no more than this part of the ring, so that others can be on their way meanwhile, and no more points than a cache holds;
 * but always a patch. */
enum { PARTS = 4, MOST_POINTS = 1 << 15 };

/* ---- Which launches there are ---- */

static bool overlap(const qp_streamed_launch *a, const qp_streamed_launch *b) {
    return a->begin < b->begin + b->points && b->begin < a->begin + a->points;
}

/* Takes the launches whose room the last one needs off the list of those that hold some, [oldest, *n_holding), and makes them its
 * credits. */
static qp_status find_credits(qp_streamed *s, bool in_order, uint32_t *holding, size_t *n_holding,
                              qp_error *err) {
    qp_streamed_launch *launch = &s->launches[s->n_launches - 1];
    size_t end = 0, kept = 0;
    for (size_t i = 0; i < *n_holding; ++i) {
        if (overlap(&s->launches[holding[i]], launch)) end = i + 1;
    }
    launch->first_credit = (uint32_t)s->n_credits;
    if (!qp_grow((void **)&s->credits, &s->credit_capacity, s->n_credits + *n_holding, sizeof *s->credits))
        return qp_fail_memory(err, *n_holding * sizeof *s->credits, "launches");
    for (size_t i = 0; i < *n_holding; ++i) {
        const bool taken = in_order ? i < end : overlap(&s->launches[holding[i]], launch);
        if (!taken)
            holding[kept++] = holding[i];
        else
            s->credits[s->n_credits++] = holding[i];
    }
    launch->credits = (uint32_t)s->n_credits - launch->first_credit;
    holding[kept++] = (uint32_t)s->n_launches - 1;
    *n_holding = kept;
    return QP_OK;
}

/* Piece of the ring for a launch, behind that of the one before it or at the start. */
static void place(qp_streamed *s, uint32_t capacity, uint32_t *head, uint32_t *claimed,
                  qp_streamed_launch *launch) {
    if (launch->points > capacity - *head) {
        ++s->wraps;
        s->wasted += capacity - *head;
        *head = 0;
    }
    launch->begin = *head;
    launch->offset = *head - *claimed;
    *head += launch->points;
    *claimed += launch->points;
}

/* Points that entry `entry` takes from the ring. */
static uint32_t points_of(const qp_frame *frame, uint32_t entry) {
    const qp_frame_item *item = &frame->layout.items[frame->ring.items[entry]];
    const uint32_t guards = frame->options.supports.canaries ? 2 * QP_RB_GUARD : 0;
    return qp_frame_rows(frame, item) + guards;
}

qp_status qp_streamed_plan(qp_frame *frame, qp_error *err) {
    const uint32_t capacity = frame->ring.capacity;
    const uint32_t most = capacity / PARTS < MOST_POINTS ? capacity / PARTS : MOST_POINTS;
    const bool in_order = frame->options.supports.retirement == QP_RETIRE_IN_ORDER;
    qp_streamed *s = &frame->ring.streamed;
    uint32_t head = 0, claimed = 0, ticket = 0, *holding = NULL;
    size_t n_holding = 0, holding_capacity = 0;
    qp_status status = QP_OK;
    qp_streamed_free(s);
    for (size_t b = 0; b < frame->n_batches && status == QP_OK; ++b) {
        const qp_frame_batch *batch = &frame->batches[b];
        const uint32_t end = batch->first_general + batch->n_general;
        for (uint32_t entry = batch->first_general; entry < end && status == QP_OK;) {
            qp_streamed_launch launch = {.first_entry = entry, .first_ticket = ticket, .batch = (uint32_t)b};
            uint32_t points = points_of(frame, entry);
            do {
                launch.points += points;
                ++launch.patches;
                points = ++entry < end ? points_of(frame, entry) : 0;
            } while (entry < end && launch.points + points <= most);
            ticket += launch.patches;
            if (!qp_grow((void **)&s->launches, &s->launch_capacity, s->n_launches + 1, sizeof launch) ||
                !qp_grow((void **)&holding, &holding_capacity, n_holding + 1, sizeof *holding)) {
                status = qp_fail_memory(err, (s->n_launches + 1) * sizeof launch, "launches");
                break;
            }
            place(s, capacity, &head, &claimed, &launch);
            s->launches[s->n_launches++] = launch;
            status = find_credits(s, in_order, holding, &n_holding, err);
        }
    }
    free(holding);
    return status;
}

void qp_streamed_free(qp_streamed *streamed) {
    free(streamed->launches);
    free(streamed->credits);
    *streamed = (qp_streamed){0};
}

/* ---- An evaluation ---- */

static qp_status fill(qp_frame *frame, qp_streamed_launch *launch, double *ms, qp_error *err) {
    const qp_streamed *s = &frame->ring.streamed;
    const qp_event **after = qp_alloc(launch->credits, sizeof *after, false);
    if (after == NULL) return qp_fail_memory(err, launch->credits * sizeof *after, "a launch");
    for (uint32_t i = 0; i < launch->credits; ++i)
        after[i] = &s->launches[s->credits[launch->first_credit + i]].domain;
    const qp_arg args[] = {QP_ARGS_PLANS(frame),   {NULL, launch->first_entry}, {NULL, launch->first_ticket},
                           {NULL, launch->offset}, {&frame->ring.words, 0},     {&frame->ring.points, 0}};
    const qp_turn turn = {.queue = 0, .after = after, .n_after = launch->credits, .event = &launch->hull};
    qp_status status = qp_launch_in_turn(frame->device, &frame->program, QP_KERNEL_STREAM_HULL, args,
                                         sizeof args / sizeof args[0], launch->patches, &turn, ms, err);
    free(after);
    return status;
}

/* Starts launch number k's domain stage, unless that is done already. */
static qp_status drain(qp_frame *frame, size_t k, double *ms, qp_error *err) {
    qp_streamed_launch *launch = &frame->ring.streamed.launches[k];
    if (launch->drained) return QP_OK;
    launch->drained = true;
    const qp_frame_batch *batch = &frame->batches[launch->batch];
    const qp_arg args[] = {QP_ARGS_PLANS(frame),         {NULL, launch->first_entry},
                           {NULL, launch->first_ticket}, {&frame->ring.words, 0},
                           {&frame->ring.points, 0},     QP_ARGS_SAMPLES(frame, batch)};
    const bool in_order = frame->options.supports.retirement == QP_RETIRE_IN_ORDER;
    const qp_event *after = &launch->hull;
    const qp_turn turn = {.queue = in_order ? 1 : 1 + (unsigned)(k % 2),
                          .after = &after,
                          .n_after = 1,
                          .event = &launch->domain};
    return qp_launch_in_turn(frame->device, &frame->program, QP_KERNEL_STREAM_DOMAIN, args,
                             sizeof args / sizeof args[0], launch->patches, &turn, ms, err);
}

/* Domain launches are given when a hull launch is next that waits for them, and at the end: on a device that runs launches in the order in
 * which they are given, the ring is filled before it is drained. */
qp_status qp_streamed_launch_batch(qp_frame *frame, size_t b, double *hull_ms, double *domain_ms,
                                   qp_error *err) {
    qp_streamed *s = &frame->ring.streamed;
    qp_status status = QP_OK;
    size_t first = s->next;
    if (b == 0) {
        for (size_t k = 0; k < s->n_launches; ++k) s->launches[k].drained = false;
        first = 0;
    }
    size_t k = first;
    for (; k < s->n_launches && s->launches[k].batch == b && status == QP_OK; ++k) {
        qp_streamed_launch *launch = &s->launches[k];
        for (uint32_t i = 0; i < launch->credits && status == QP_OK; ++i)
            status = drain(frame, s->credits[launch->first_credit + i], domain_ms, err);
        if (status == QP_OK) status = fill(frame, launch, hull_ms, err);
    }
    s->next = k;
    for (k = first; k < s->next && status == QP_OK; ++k) status = drain(frame, k, domain_ms, err);
    return status;
}

/* ---- What happened ---- */

/* When the queue of the hull stage came to launch k, and when its credits were there, by events. */
static void measure_stalls(const qp_streamed *s, qp_supports_report *report) {
    for (size_t k = 1; k < s->n_launches; ++k) {
        const qp_streamed_launch *launch = &s->launches[k];
        const double reached = s->launches[k - 1].hull.end_ms;
        double there = 0;
        for (uint32_t i = 0; i < launch->credits; ++i) {
            const double end = s->launches[s->credits[launch->first_credit + i]].domain.end_ms;
            if (end > there) there = end;
        }
        if (there <= reached) continue;
        ++report->stalls;
        report->stall_ms += there - reached;
    }
}

typedef struct launch_ticks {
    uint64_t hulled, done, retired; /* the last patch of the launch */
} launch_ticks;

static uint64_t later(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

/* For the trace, the first patch of a launch on each slot begins when the queue came to the launch, which then had to wait for
 * credits: the time in between is the stall. */
static void begin_at(qp_trace_patch *patches, const qp_streamed_launch *launch, uint64_t reached) {
    bool seen[32 * QP_RB_SLOT_WORDS] = {false};
    for (uint32_t i = 0; i < launch->patches; ++i) {
        qp_trace_patch *p = &patches[launch->first_ticket + i];
        if (p->slot >= sizeof seen / sizeof seen[0] || seen[p->slot]) continue;
        qp_trace_patch *first = p;
        for (uint32_t j = i + 1; j < launch->patches; ++j) {
            qp_trace_patch *other = &patches[launch->first_ticket + j];
            if (other->slot == p->slot && other->start < first->start) first = other;
        }
        seen[p->slot] = true;
        first->start = reached;
    }
}

/* Room is given back a launch at a time. */
static qp_status finish_trace(const qp_frame *frame, qp_trace_patch *patches, qp_error *err) {
    const qp_streamed *s = &frame->ring.streamed;
    const bool in_order = frame->options.supports.retirement == QP_RETIRE_IN_ORDER;
    launch_ticks *ticks = qp_alloc(s->n_launches, sizeof *ticks, true);
    if (ticks == NULL) return qp_fail_memory(err, s->n_launches * sizeof *ticks, "a trace");
    for (size_t k = 0; k < s->n_launches; ++k) {
        const qp_streamed_launch *launch = &s->launches[k];
        for (uint32_t i = 0; i < launch->patches; ++i) {
            const qp_trace_patch *p = &patches[launch->first_ticket + i];
            ticks[k].hulled = later(ticks[k].hulled, p->hulled);
            ticks[k].done = later(ticks[k].done, p->done);
        }
        ticks[k].retired = in_order && k > 0 ? later(ticks[k].done, ticks[k - 1].retired) : ticks[k].done;
        for (uint32_t i = 0; i < launch->patches; ++i)
            patches[launch->first_ticket + i].retired = ticks[k].retired;
    }
    for (size_t k = 1; k < s->n_launches; ++k) {
        const qp_streamed_launch *launch = &s->launches[k];
        uint64_t there = 0;
        for (uint32_t i = 0; i < launch->credits; ++i)
            there = later(there, ticks[s->credits[launch->first_credit + i]].retired);
        if (there > ticks[k - 1].hulled) begin_at(patches, launch, ticks[k - 1].hulled);
    }
    free(ticks);
    return QP_OK;
}

qp_status qp_streamed_report(qp_frame *frame, qp_stream *stream, qp_error *err) {
    const qp_streamed *s = &frame->ring.streamed;
    stream->supports.stalls = 0;
    stream->supports.stall_ms = 0;
    measure_stalls(s, &stream->supports);
    stream->supports.wraps = s->wraps;
    stream->supports.wasted_bytes = s->wasted * 4 * frame->real_size;
    return stream->trace != NULL ? finish_trace(frame, frame->ring.patches, err) : QP_OK;
}
