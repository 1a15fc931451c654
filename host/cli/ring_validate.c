/* quadplan ring --validate: the model beside the real thing, where both can run: the fused kernel on the host, with as many slots as patches
 * were in flight, which is what threads there are.
 *
 * What the model is told: the patches in the order in which they were issued, and how long a weight, a vertex and the rest of a patch take, from
 * the trace of a run with room for all. What it is not told, and has to find out: how often, how long and with how many bytes in use smaller
 * rings hold things up. Every run is repeated, and the fastest one taken, which other programs have disturbed least. */
#include "host/cli/ring.h"

#include <stdlib.h>
#include <unistd.h>

enum { REPEATS = 5 };

/* Multiples of the largest patch, in quarters; then, at last, room for all. */
static const uint64_t quarters[] = {4, 5, 6, 8, 12, 16, 24};
enum { N_RINGS = (int)(sizeof quarters / sizeof quarters[0]) + 1 };
_Static_assert((int)N_RINGS <= (int)RING_VALIDATION_MOST, "room for all rings");

typedef struct bench {
    const cli_views *views;
    qp_device *device;
    qp_frame *frames[N_RINGS];
    uint64_t bytes[N_RINGS];
    size_t count;
    double best_ms[N_RINGS];
    qp_supports_report reports[N_RINGS];
    qp_patch_work *work; /* of the last ring, as its patches were issued */
    size_t n_work;
    qp_machine machine; /* a cycle is a nanosecond */
} bench;

static double length_ms(const qp_trace *trace) {
    uint64_t first = UINT64_MAX, last = 0;
    for (uint64_t i = 0; i < trace->n_patches; ++i) {
        if (trace->patches[i].start < first) first = trace->patches[i].start;
        if (trace->patches[i].retired > last) last = trace->patches[i].retired;
    }
    return trace->n_patches == 0 ? 0 : (double)(last - first) / trace->ticks_per_ms;
}

/* What the patches were, and what their parts took. */
static qp_status calibrate(bench *b, const qp_trace *trace, qp_error *err) {
    const qp_surface *surface = b->views->surface;
    double weights = 0, samples = 0, hull = 0, domain = 0, rest = 0;
    free(b->work);
    b->n_work = (size_t)trace->n_patches;
    b->work = qp_alloc(b->n_work, sizeof *b->work, false);
    if (b->work == NULL) return qp_fail_memory(err, b->n_work * sizeof *b->work, "the work of patches");
    for (size_t i = 0; i < b->n_work; ++i) {
        const qp_trace_patch *p = &trace->patches[i];
        const uint32_t ring = surface->plans[surface->patch_plan[p->patch]]->ring_size;
        b->work[i] = (qp_patch_work){p->patch, p->points, ring, p->samples};
        weights += (double)p->points * ring;
        samples += p->samples;
        hull += (double)(p->hulled - p->allocated);
        domain += (double)(p->done - p->hulled);
        rest += (double)(p->allocated - p->start);
    }
    /* Few patches do not keep all threads busy. */
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const uint32_t slots = (uint32_t)b->reports[b->count - 1].in_flight;
    b->machine.warps = slots;
    b->machine.fill = processors >= 1 && (uint32_t)processors < slots ? (uint32_t)processors : slots;
    const double ns = 1e6 / trace->ticks_per_ms, fill = b->machine.fill;
    b->machine.hull_rate = fill * weights / (hull * ns);
    b->machine.domain_rate = fill * samples / (domain * ns);
    b->machine.latency = rest * ns / (double)b->n_work;
    return QP_OK;
}

/* All rings in turn, so that they meet the same disturbances. */
static qp_status run_all(bench *b, const qp_tessellation *tessellation, qp_error *err) {
    for (int round = 0; round < REPEATS; ++round) {
        for (size_t i = 0; i < b->count; ++i) {
            qp_stream stream;
            qp_status status = qp_frame_eval(b->frames[i], tessellation, &stream, err);
            if (status != QP_OK) return status;
            if (stream.trace == NULL || stream.trace->n_patches == 0 || !(stream.trace->ticks_per_ms > 0))
                return qp_fail(err, QP_SYSTEM, "the ring on the host left no trace with times");
            const double ms = length_ms(stream.trace);
            if (round != 0 && ms >= b->best_ms[i]) continue;
            b->best_ms[i] = ms;
            b->reports[i] = stream.supports;
            if (i + 1 == b->count) status = calibrate(b, stream.trace, err);
            if (status != QP_OK) return status;
        }
    }
    return QP_OK;
}

static qp_status compare(const bench *b, ring_run *run, qp_error *err) {
    run->validation_slots = b->machine.warps;
    run->validation_hull_ns = b->machine.fill / b->machine.hull_rate;
    run->validation_domain_ns = b->machine.fill / b->machine.domain_rate;
    run->validation_patch_ns = b->machine.latency;
    run->n_validation = b->count;
    for (size_t i = b->count; i-- > 0;) {
        qp_pipeline_result r;
        qp_status status = qp_pipeline_run(b->work, b->n_work, &b->machine, b->bytes[i], &r, NULL, err);
        if (status != QP_OK) return status;
        const qp_supports_report *report = &b->reports[i];
        run->validation[i] = (ring_validation){.ring_bytes = b->bytes[i],
                                               .model_ms = r.cycles * 1e-6,
                                               .measured_ms = b->best_ms[i],
                                               .model_stall_ms = r.stall_cycles * 1e-6,
                                               .measured_stall_ms = report->stall_ms,
                                               .model_stalls = r.stalls,
                                               .measured_stalls = report->stalls,
                                               .model_peak_bytes = r.peak_bytes,
                                               .measured_peak_bytes = report->peak_bytes,
                                               .model_wraps = r.wraps,
                                               .measured_wraps = report->wraps,
                                               .model_in_flight = r.in_flight,
                                               .measured_in_flight = (uint32_t)report->in_flight};
        ring_validation *v = &run->validation[i], *all = &run->validation[b->count - 1];
        v->model_relative = all->model_ms / v->model_ms;
        v->measured_relative = all->measured_ms / v->measured_ms;
    }
    return QP_OK;
}

/* A frame a ring, on the host. */
static qp_status open_rings(bench *b, const ring_run *run, qp_error *err) {
    enum { BYTES = 16 };
    qp_status status = qp_device_open("host", &b->device, err);
    const uint64_t largest = run->largest_bytes / run->machine.point_bytes * BYTES, all = run->points * BYTES;
    for (size_t i = 0; i < N_RINGS && status == QP_OK; ++i) {
        uint64_t bytes = i + 1 == N_RINGS ? all : (largest * quarters[i] / 4 + BYTES - 1) / BYTES * BYTES;
        if (i + 1 < N_RINGS && bytes >= all) continue;
        qp_frame_options options = {.supports = {.kind = QP_SUPPORTS_RING,
                                                 .ring_bytes = bytes,
                                                 .retirement = run->machine.out_of_order
                                                                   ? QP_RETIRE_OUT_OF_ORDER
                                                                   : QP_RETIRE_IN_ORDER,
                                                 .issue_order = (qp_issue_order)run->issue,
                                                 .trace = 1}};
        b->bytes[b->count] = bytes;
        status = qp_frame_create(b->device, b->views->surface, &options, &b->frames[b->count], err);
        ++b->count;
    }
    return status;
}

qp_status ring_validate(ring_run *run, const cli_views *views, qp_error *err) {
    if (run->points == 0)
        return qp_fail(err, QP_BAD_INPUT, "--validate: no patch of %s needs control points", run->name);
    bench b = {.views = views,
               .machine = {.sms = 1, .point_bytes = 16, .out_of_order = run->machine.out_of_order}};
    qp_status status = open_rings(&b, run, err);
    if (status == QP_OK) status = run_all(&b, run->tessellation, err);
    if (status == QP_OK) status = compare(&b, run, err);
    for (size_t i = 0; i < b.count; ++i) qp_frame_free(b.frames[i]);
    qp_device_free(b.device);
    free(b.work);
    return status;
}
