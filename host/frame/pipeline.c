/* The model of pipeline.h.
 *
 * Work of a slot is counted in cycles that it would take alone, `fill` times the cycles of the whole SM. With n patches at work each proceeds
 * at the speed fill / max(n, fill), the same for all, so that one clock an SM, which runs at that speed, is enough: a stage of w cycles that
 * begins when the clock shows c ends when it shows c + w, whoever comes and goes meanwhile. The next stage to end on an SM is the one with
 * the least c + w; its time is known until somebody comes or goes, which makes the event in the heap stale and puts a new one there. Without
 * sharing the clock is time itself, and no time is rounded but where work is added. */
#include "host/frame/pipeline.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* ---- The ring, in points ---- */

typedef struct ring {
    uint64_t capacity; /* UINT64_MAX: no limits */
    uint64_t head, used;
    uint64_t wraps, wasted;
} ring;

/* Takes n points, and *span points with those skipped; false, and nothing is taken, while there is no room. */
static bool take(ring *r, uint64_t n, uint64_t *span) {
    const uint64_t rest = r->capacity - r->head;
    const bool wraps = n > rest;
    uint64_t skip = wraps ? rest : 0;
    *span = 0;
    if (n == 0) return true;
    if (r->used != 0 && skip + n > r->capacity - r->used) return false;
    if (wraps) {
        if (r->used == 0) skip = 0;
        r->head = 0;
        ++r->wraps;
        r->wasted += skip;
    }
    *span = skip + n;
    r->head += n;
    r->used += *span;
    return true;
}

/* ---- Live bytes over time ---- */

/* Notes that `bytes` were live from begin to end. Intervals double until the end is within the last one. */
static void note_live(qp_pipeline_result *result, double begin, double end, uint64_t bytes) {
    while (end > result->live_cycles * QP_LIVE_BINS) {
        for (uint32_t i = 0; i < QP_LIVE_BINS; ++i) {
            uint64_t most = 0;
            if (2 * i + 1 < QP_LIVE_BINS) {
                const uint64_t *pair = result->live_bytes + 2 * i;
                most = pair[0] > pair[1] ? pair[0] : pair[1];
            }
            result->live_bytes[i] = most;
        }
        result->live_cycles *= 2;
    }
    for (uint32_t i = (uint32_t)(begin / result->live_cycles); i < QP_LIVE_BINS; ++i) {
        if ((double)i * result->live_cycles >= end) break;
        if (result->live_bytes[i] < bytes) result->live_bytes[i] = bytes;
    }
}

/* ---- Events ---- */

typedef struct event {
    double time;
    uint32_t patch;
    uint64_t generation; /* of its SM, when the event was made; 0 where it will happen whatever else does */
} event;

typedef struct heap {
    event *events;
    size_t count, capacity;
} heap;

static bool before(event a, event b) {
    return a.time != b.time ? a.time < b.time : a.patch < b.patch;
}

static bool push(heap *h, event e) {
    if (!qp_grow((void **)&h->events, &h->capacity, h->count + 1, sizeof e)) return false;
    size_t i = h->count++;
    for (; i > 0 && before(e, h->events[(i - 1) / 2]); i = (i - 1) / 2) h->events[i] = h->events[(i - 1) / 2];
    h->events[i] = e;
    return true;
}

static event pop(heap *h) {
    const event first = h->events[0], last = h->events[--h->count];
    size_t i = 0;
    for (size_t child; (child = 2 * i + 1) < h->count; i = child) {
        if (child + 1 < h->count && before(h->events[child + 1], h->events[child])) ++child;
        if (!before(h->events[child], last)) break;
        h->events[i] = h->events[child];
    }
    h->events[i] = last;
    return first;
}

/* ---- The pipeline ---- */

typedef enum stage { WAITING, LATENCY, HULL, TESSELLATOR, DOMAIN, DONE, RETIRED } stage;

typedef struct patch {
    uint64_t span;
    double ends; /* when its SM's clock shows this, in HULL and DOMAIN */
    uint32_t sm;
    stage stage;
} patch;

typedef struct processor {
    double clock, updated;   /* what the clock showed at a time */
    double tessellator_free; /* time when its tessellator has no more to do */
    uint32_t held;           /* slots */
    uint32_t at_work;
    uint32_t *patches;   /* [at_work], room for `warps` */
    uint64_t generation; /* how often somebody came or went */
} processor;

typedef struct pipeline {
    const qp_patch_work *work;
    uint32_t count;
    const qp_machine *machine;
    double fill;
    double now;
    uint32_t next, oldest; /* to be issued; not retired */
    uint32_t busy;         /* slots with a patch that is not done */
    uint64_t held, live;   /* slots; points */
    bool stalled;          /* the next patch waits for room alone */
    uint32_t last_stalled; /* patch, or QP_NONE */
    ring ring;
    patch *patches;
    processor *processors;
    uint32_t *lists; /* of all processors' patches */
    heap heap;
    double busy_cycles;
    qp_pipeline_result *result;
    qp_patch_times *times;
    bool failed; /* memory is out */
} pipeline;

static double speed(const pipeline *p, const processor *s) {
    return s->at_work > p->fill ? p->fill / s->at_work : 1.0;
}

static void set_clock(const pipeline *p, processor *s) {
    s->clock += (p->now - s->updated) * speed(p, s);
    s->updated = p->now;
}

/* The next stage that ends on an SM, after somebody came or went. */
static void schedule(pipeline *p, processor *s) {
    ++s->generation;
    if (s->at_work == 0) return;
    uint32_t first = s->patches[0];
    for (uint32_t i = 1; i < s->at_work; ++i) {
        const uint32_t other = s->patches[i];
        const double a = p->patches[other].ends, b = p->patches[first].ends;
        if (a < b || (a == b && other < first)) first = other;
    }
    const double left = p->patches[first].ends - s->clock;
    const double time = left > 0 ? p->now + left / speed(p, s) : p->now;
    if (!push(&p->heap, (event){time, first, s->generation})) p->failed = true;
}

static void start_work(pipeline *p, uint32_t i, stage stage, double cycles) {
    patch *patch = &p->patches[i];
    processor *s = &p->processors[patch->sm];
    set_clock(p, s);
    patch->stage = stage;
    patch->ends = s->clock + cycles * p->fill;
    s->patches[s->at_work++] = i;
    schedule(p, s);
}

static void end_work(pipeline *p, uint32_t i) {
    processor *s = &p->processors[p->patches[i].sm];
    set_clock(p, s);
    s->clock = p->patches[i].ends; /* but for rounding it is */
    for (uint32_t k = 0; k < s->at_work; ++k)
        if (s->patches[k] == i) s->patches[k--] = s->patches[--s->at_work];
    if (s->at_work == 0) s->clock = 0;
    schedule(p, s);
}

static void start_domain(pipeline *p, uint32_t i) {
    if (p->times != NULL) p->times[i].tessellated = p->now;
    start_work(p, i, DOMAIN, p->work[i].samples / p->machine->domain_rate);
}

static void start_tessellator(pipeline *p, uint32_t i) {
    const qp_machine *m = p->machine;
    if (p->times != NULL) p->times[i].hulled = p->now;
    if (m->tessellator_rate == 0) {
        start_domain(p, i);
        return;
    }
    processor *unit = &p->processors[m->tessellator_shared ? 0 : p->patches[i].sm];
    const double start = unit->tessellator_free > p->now ? unit->tessellator_free : p->now;
    unit->tessellator_free = start + p->work[i].samples / m->tessellator_rate;
    p->patches[i].stage = TESSELLATOR;
    if (!push(&p->heap, (event){unit->tessellator_free, i, 0})) p->failed = true;
}

static void start_hull(pipeline *p, uint32_t i) {
    const double weights = (double)p->work[i].points * p->work[i].ring;
    start_work(p, i, HULL, weights / p->machine->hull_rate);
}

/* What a patch does after the stage it is in has ended. */
static void go_on(pipeline *p, uint32_t i) {
    switch (p->patches[i].stage) {
    case LATENCY:
        start_hull(p, i);
        break;
    case HULL:
        end_work(p, i);
        start_tessellator(p, i);
        break;
    case TESSELLATOR:
        start_domain(p, i);
        break;
    default: /* DOMAIN */
        end_work(p, i);
        p->patches[i].stage = DONE;
        if (p->times != NULL) p->times[i].done = p->now;
        --p->busy;
        if (p->machine->out_of_order) {
            --p->processors[p->patches[i].sm].held;
            --p->held;
        }
    }
}

static void retire(pipeline *p) {
    for (; p->oldest < p->next && p->patches[p->oldest].stage == DONE; ++p->oldest) {
        patch *patch = &p->patches[p->oldest];
        patch->stage = RETIRED;
        p->ring.used -= patch->span;
        p->live -= p->work[p->oldest].points;
        if (p->times != NULL) p->times[p->oldest].retired = p->now;
        if (p->machine->out_of_order) continue;
        --p->processors[patch->sm].held;
        --p->held;
    }
}

/* The SM with most free slots, the first one of several. */
static uint32_t emptiest(const pipeline *p) {
    uint32_t best = 0;
    for (uint32_t s = 1; s < p->machine->sms; ++s)
        if (p->processors[s].held < p->processors[best].held) best = s;
    return best;
}

/* Issues patches while there is a slot and room for the next one. */
static void issue(pipeline *p) {
    const uint64_t slots = (uint64_t)p->machine->sms * p->machine->warps;
    p->stalled = false;
    for (; p->next < p->count && p->held < slots; ++p->next) {
        const qp_patch_work *work = &p->work[p->next];
        patch *patch = &p->patches[p->next];
        if (!take(&p->ring, work->points, &patch->span)) {
            p->stalled = true;
            if (p->last_stalled != p->next) ++p->result->stalls;
            p->last_stalled = p->next;
            return;
        }
        patch->sm = emptiest(p);
        ++p->processors[patch->sm].held;
        ++p->held;
        ++p->busy;
        p->live += work->points;
        qp_pipeline_result *r = p->result;
        if (work->points != 0) ++r->allocations;
        r->allocated_bytes += (uint64_t)work->points * p->machine->point_bytes;
        if (p->live * p->machine->point_bytes > r->peak_bytes)
            r->peak_bytes = p->live * p->machine->point_bytes;
        if (p->held > r->in_flight) r->in_flight = (uint32_t)p->held;
        if (p->times != NULL)
            p->times[p->next] = (qp_patch_times){.sm = patch->sm, .allocated = p->now, .hulled = p->now};
        if (work->points == 0) {
            start_tessellator(p, p->next);
        } else {
            patch->stage = LATENCY;
            if (!push(&p->heap, (event){p->now + p->machine->latency, p->next, 0})) p->failed = true;
        }
    }
}

/* Time goes on to that of the next event. */
static void advance(pipeline *p, double time) {
    const double passed = time - p->now;
    if (!(passed > 0)) return;
    p->busy_cycles += passed * p->busy;
    if (p->stalled) p->result->stall_cycles += passed;
    note_live(p->result, p->now, time, p->live * p->machine->point_bytes);
    p->now = time;
}

/* The next event that still holds; false: there is none. */
static bool find_event(pipeline *p, event *e) {
    for (; p->heap.count != 0; pop(&p->heap)) {
        *e = p->heap.events[0];
        if (e->generation == 0 || p->processors[p->patches[e->patch].sm].generation == e->generation)
            return true;
    }
    return false;
}

/* At each time: first everything that ends, then retirement, then issue, until nothing more happens. Some patch is always at work or waited
 * for by nobody: when none is, all have retired, the ring is empty, and the next one is issued. */
static void simulate(pipeline *p) {
    event e;
    while (!p->failed) {
        if (!find_event(p, &e) || e.time > p->now) {
            retire(p);
            issue(p);
            if (!find_event(p, &e)) return;
            advance(p, e.time);
        }
        pop(&p->heap);
        go_on(p, e.patch);
    }
}

/* ---- Entry ---- */

static bool is_rate(double x) {
    return x > 0 && x <= DBL_MAX;
}

static qp_status check_machine(const qp_machine *m, qp_error *err) {
    enum { MOST = 1 << 16 };
    if (m->sms < 1 || m->sms > MOST || m->warps < 1 || m->warps > MOST)
        return qp_fail(err, QP_BAD_INPUT, "%u SMs with %u warps each: both are from 1 to %d", m->sms,
                       m->warps, (int)MOST);
    if (m->point_bytes < 1) return qp_fail(err, QP_BAD_INPUT, "a control point has at least one byte");
    if (!is_rate(m->hull_rate) || !is_rate(m->domain_rate) ||
        (m->tessellator_rate != 0 && !is_rate(m->tessellator_rate)) ||
        !(m->latency >= 0 && m->latency <= DBL_MAX))
        return qp_fail(err, QP_BAD_INPUT,
                       "hull, tessellator and domain stage need rates above 0, and a latency of at least 0");
    return QP_OK;
}

uint64_t qp_pipeline_largest_bytes(const qp_patch_work *work, size_t count, const qp_machine *machine) {
    uint32_t most = 0;
    for (size_t i = 0; i < count; ++i)
        if (work[i].points > most) most = work[i].points;
    return (uint64_t)most * machine->point_bytes;
}

static void free_pipeline(pipeline *p) {
    free(p->patches);
    free(p->processors);
    free(p->lists);
    free(p->heap.events);
}

static qp_status set_up(pipeline *p, qp_error *err) {
    const qp_machine *m = p->machine;
    const size_t slots = (size_t)m->sms * m->warps;
    p->fill = m->fill == 0 ? m->warps : m->fill;
    p->last_stalled = QP_NONE;
    p->patches = qp_alloc(p->count, sizeof *p->patches, true);
    p->processors = qp_alloc(m->sms, sizeof *p->processors, true);
    p->lists = qp_alloc(slots, sizeof *p->lists, true);
    if (p->patches == NULL || p->processors == NULL || p->lists == NULL)
        return qp_fail_memory(err, p->count * sizeof *p->patches + slots * sizeof *p->lists,
                              "the pipeline's model");
    for (uint32_t s = 0; s < m->sms; ++s) p->processors[s].patches = p->lists + (size_t)s * m->warps;
    return QP_OK;
}

qp_status qp_pipeline_run(const qp_patch_work *work, size_t count, const qp_machine *machine,
                          uint64_t ring_bytes, qp_pipeline_result *result, qp_patch_times *times,
                          qp_error *err) {
    *result = (qp_pipeline_result){.live_cycles = 1};
    qp_status status = check_machine(machine, err);
    if (status != QP_OK) return status;
    if (count >= QP_NONE) return qp_fail(err, QP_BAD_INPUT, "too many patches for the model (%zu)", count);
    const uint64_t largest = qp_pipeline_largest_bytes(work, count, machine);
    if (ring_bytes != 0 && ring_bytes / machine->point_bytes * machine->point_bytes < largest)
        return qp_fail(err, QP_BAD_INPUT, "a ring of %llu bytes cannot hold the largest patch, of %llu",
                       (unsigned long long)ring_bytes, (unsigned long long)largest);
    pipeline p = {
        .work = work, .count = (uint32_t)count, .machine = machine, .result = result, .times = times};
    p.ring.capacity = ring_bytes == 0 ? UINT64_MAX : ring_bytes / machine->point_bytes;
    status = set_up(&p, err);
    if (status == QP_OK) simulate(&p);
    if (status == QP_OK && p.failed)
        status = qp_fail_memory(err, p.heap.capacity * sizeof(event), "the pipeline's model");
    free_pipeline(&p);
    if (status != QP_OK) return status;
    result->cycles = p.now;
    result->wraps = p.ring.wraps;
    result->wasted_bytes = p.ring.wasted * machine->point_bytes;
    result->live_bins = (uint32_t)ceil(p.now / result->live_cycles);
    if (p.now > 0) result->occupancy = p.busy_cycles / p.now / ((double)machine->sms * machine->warps);
    return QP_OK;
}

qp_status qp_pipeline_smallest_ring(const qp_patch_work *work, size_t count, const qp_machine *machine,
                                    double share, uint64_t step, uint64_t *ring_bytes, qp_error *err) {
    qp_pipeline_result result;
    *ring_bytes = 0;
    qp_status status = qp_pipeline_run(work, count, machine, 0, &result, NULL, err);
    if (status != QP_OK) return status;
    const double scratch = result.cycles;
    const uint64_t all = result.allocated_bytes;
    /* In steps: `low` is too small; `high` holds all patches at once, so that nothing is ever skipped or waited for. */
    const uint64_t largest = qp_pipeline_largest_bytes(work, count, machine);
    if (largest == 0) return QP_OK;
    uint64_t low = (largest - 1) / step, high = all / step + 1;
    while (high - low > 1) {
        const uint64_t middle = low + (high - low) / 2;
        status = qp_pipeline_run(work, count, machine, middle * step, &result, NULL, err);
        if (status != QP_OK) return status;
        if (scratch >= share * result.cycles)
            high = middle;
        else
            low = middle;
    }
    *ring_bytes = high * step < all ? high * step : all;
    return QP_OK;
}
