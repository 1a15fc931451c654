/* A stream's trace in the trace event format that chrome://tracing and Perfetto read: a lane a warp slot, on it a slice a patch
 * and in that its stages, and the ring's bytes over time (the picture of the paper's figure 16). */
#include "host/base/output.h"
#include "host/cli/supports.h"

#include <inttypes.h>
#include <stdlib.h>

/* Lanes: those of the warp slots, and in the streamed schedule, whose domain stages have no slots, as many as they need. */
enum { SLOTS = 1, DOMAIN = 2, RING = 3 };

typedef struct writer {
    qp_json json;
    const qp_trace *trace;
    uint64_t begin;     /* the earliest tick */
    double us_per_tick; /* the format's microseconds; ticks that only count are drawn as one each */
    uint64_t point_bytes;
    bool streamed, out_of_order;
} writer;

static double time_of(const writer *w, uint64_t tick) {
    return (double)(tick - w->begin) * w->us_per_tick;
}

static void open_event(writer *w, const char *phase, const char *name, unsigned process, uint64_t tick) {
    qp_json_open_object(&w->json, NULL);
    qp_json_text(&w->json, "ph", phase);
    qp_json_text(&w->json, "name", name);
    qp_json_integer(&w->json, "pid", process);
    qp_json_real(&w->json, "ts", time_of(w, tick));
}

static void name_lanes(writer *w, unsigned process, const char *name) {
    open_event(w, "M", "process_name", process, w->begin);
    qp_json_open_object(&w->json, "args");
    qp_json_text(&w->json, "name", name);
    qp_json_close(&w->json);
    qp_json_close(&w->json);
}

/* Open until the caller has added what it likes. */
static void open_slice(writer *w, const char *name, const char *colour, unsigned process, uint64_t lane,
                       uint64_t from, uint64_t to) {
    open_event(w, "X", name, process, from);
    qp_json_integer(&w->json, "tid", lane);
    qp_json_real(&w->json, "dur", time_of(w, to) - time_of(w, from));
    if (colour != NULL) qp_json_text(&w->json, "cname", colour);
}

static void stage(writer *w, const char *name, const char *colour, uint64_t lane, uint64_t from,
                  uint64_t to) {
    if (to <= from) return;
    open_slice(w, name, colour, SLOTS, lane, from, to);
    qp_json_close(&w->json);
}

static void whole_patch(writer *w, const qp_trace_patch *p, const char *what, unsigned process, uint64_t lane,
                        uint64_t from, uint64_t to) {
    char name[64];
    snprintf(name, sizeof name, "%s %" PRIu32, what, p->patch);
    open_slice(w, name, NULL, process, lane, from, to);
    qp_json_open_object(&w->json, "args");
    qp_json_integer(&w->json, "patch", p->patch);
    qp_json_integer(&w->json, "points", p->points);
    qp_json_integer(&w->json, "bytes", p->points * w->point_bytes);
    qp_json_integer(&w->json, "samples", p->samples);
    qp_json_real(&w->json, "allocated", time_of(w, p->allocated));
    qp_json_real(&w->json, "done", time_of(w, p->done));
    qp_json_real(&w->json, "retired", time_of(w, p->retired));
    qp_json_close(&w->json);
    qp_json_close(&w->json);
}

/* A patch on its slot, for as long as it holds it: in order until it is retired; out of order until it is done; streamed until the
 * hull is. */
static void slot_slices(writer *w, const qp_trace_patch *p) {
    whole_patch(w, p, "patch", SLOTS, p->slot, p->start,
                w->streamed       ? p->hulled
                : w->out_of_order ? p->done
                                  : p->retired);
    stage(w, "stall", "terrible", p->slot, p->start, p->allocated);
    stage(w, "hull", "thread_state_running", p->slot, p->allocated, p->hulled);
    if (w->streamed) return;
    stage(w, "domain", "thread_state_runnable", p->slot, p->hulled, p->done);
    if (!w->out_of_order) stage(w, "wait to retire", "grey", p->slot, p->done, p->retired);
}

/* Sorted by time; at one time what frees comes first. */
typedef struct change {
    uint64_t tick;
    int64_t held, waiting, patches; /* points of patches at work, of done ones, and patches */
} change;

static int by_time(const void *a, const void *b) {
    const change *x = a, *y = b;
    if (x->tick != y->tick) return x->tick < y->tick ? -1 : 1;
    return x->held < y->held ? -1 : x->held > y->held;
}

static void counter(writer *w, const char *name, uint64_t tick, const char *key, int64_t value,
                    const char *other, int64_t other_value) {
    open_event(w, "C", name, RING, tick);
    qp_json_open_object(&w->json, "args");
    qp_json_integer(&w->json, key, (uint64_t)value);
    if (other != NULL) qp_json_integer(&w->json, other, (uint64_t)other_value);
    qp_json_close(&w->json);
    qp_json_close(&w->json);
}

/* Bytes that are allocated, apart those of patches that are done and wait for older ones. */
static qp_status counters(writer *w, qp_error *err) {
    const size_t n = (size_t)w->trace->n_patches;
    change *changes = qp_alloc(n, 3 * sizeof *changes, false);
    if (changes == NULL) return qp_fail_memory(err, n * 3 * sizeof *changes, "a trace");
    for (size_t i = 0; i < n; ++i) {
        const qp_trace_patch *p = &w->trace->patches[i];
        const int64_t points = p->points;
        changes[3 * i] = (change){p->allocated, points, 0, 1};
        changes[3 * i + 1] = (change){p->done, -points, points, 0};
        changes[3 * i + 2] = (change){p->retired, 0, -points, -1};
    }
    qsort(changes, 3 * n, sizeof *changes, by_time);
    change now = {0};
    const int64_t bytes = (int64_t)w->point_bytes;
    for (size_t i = 0; i < 3 * n; ++i) {
        now.held += changes[i].held;
        now.waiting += changes[i].waiting;
        now.patches += changes[i].patches;
        if (i + 1 < 3 * n && changes[i + 1].tick == changes[i].tick) continue;
        counter(w, "live bytes", changes[i].tick, "in use", now.held * bytes, "done, not retired",
                now.waiting * bytes);
        counter(w, "patches in flight", changes[i].tick, "patches", now.patches, NULL, 0);
    }
    free(changes);
    return QP_OK;
}

static int by_hull(const void *a, const void *b) {
    const qp_trace_patch *x = *(const qp_trace_patch *const *)a, *y = *(const qp_trace_patch *const *)b;
    if (x->hulled != y->hulled) return x->hulled < y->hulled ? -1 : 1;
    return x < y ? -1 : x > y;
}

/* From hull's end to the domain stage's end, each on the first lane that is free. */
static qp_status domain_slices(writer *w, qp_error *err) {
    const size_t n = (size_t)w->trace->n_patches;
    const qp_trace_patch **order = qp_alloc(n, sizeof *order, false);
    uint64_t *free_from = qp_alloc(n, sizeof *free_from, false);
    size_t lanes = 0;
    if (order != NULL && free_from != NULL) {
        for (size_t i = 0; i < n; ++i) order[i] = &w->trace->patches[i];
        qsort(order, n, sizeof *order, by_hull);
        for (size_t i = 0; i < n; ++i) {
            size_t lane = 0;
            while (lane < lanes && free_from[lane] > order[i]->hulled) ++lane;
            if (lane == lanes) ++lanes;
            free_from[lane] = order[i]->done;
            whole_patch(w, order[i], "domain of patch", DOMAIN, lane, order[i]->hulled, order[i]->done);
        }
    }
    const bool good = order != NULL && free_from != NULL;
    free(order);
    free(free_from);
    return good ? QP_OK : qp_fail_memory(err, n * 2 * sizeof *free_from, "a trace");
}

static qp_status write_events(writer *w, qp_error *err) {
    const qp_trace *trace = w->trace;
    for (uint64_t i = 0; i < trace->n_patches; ++i) {
        if (i == 0 || trace->patches[i].start < w->begin) w->begin = trace->patches[i].start;
    }
    qp_json_text(&w->json, "displayTimeUnit", "ms");
    qp_json_open_object(&w->json, "otherData");
    qp_json_text(&w->json, "clock", trace->ticks_per_ms > 0 ? "time" : "events, in their order");
    qp_json_integer(&w->json, "patches", trace->n_patches);
    qp_json_close(&w->json);
    qp_json_open_array(&w->json, "traceEvents");
    name_lanes(w, SLOTS, w->streamed ? "slots of the hull stage" : "warp slots");
    if (w->streamed) name_lanes(w, DOMAIN, "domain stage, from the hull's end on");
    name_lanes(w, RING, "ring");
    for (uint64_t i = 0; i < trace->n_patches; ++i) slot_slices(w, &trace->patches[i]);
    qp_status status = w->streamed ? domain_slices(w, err) : QP_OK;
    return status == QP_OK ? counters(w, err) : status;
}

qp_status cli_trace_write(const cli_supports_options *options, const qp_stream *stream, const char *path,
                          qp_error *err) {
    if (stream->trace == NULL) return qp_fail(err, QP_SYSTEM, "%s: the evaluation left no trace", path);
    const double rate = stream->trace->ticks_per_ms;
    writer w = {.trace = stream->trace,
                .us_per_tick = rate > 0 ? 1e3 / rate : 1,
                .point_bytes = 4 * (stream->precision == QP_DOUBLE ? sizeof(double) : sizeof(float)),
                .streamed = options->schedule == QP_SCHEDULE_STREAMED,
                .out_of_order = options->retirement == QP_RETIRE_OUT_OF_ORDER};
    qp_output output;
    qp_status status = qp_output_open(&output, path, err);
    if (status != QP_OK) return status;
    qp_json_begin(&w.json, output.file);
    status = write_events(&w, err);
    if (status != QP_OK) {
        qp_output_abandon(&output);
        return status;
    }
    qp_json_finish(&w.json);
    return qp_output_commit(&output, err);
}
