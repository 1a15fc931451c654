#define _POSIX_C_SOURCE 200112L
/* The streamed schedule of the ring buffer: the same bits as scratch with rings from one patch to all of them, both retirements, both orders
 * of issue, 1 and 2 threads; launches that never share room; what is reported and traced holds together. QUADPLAN_FULL=1 runs all
 * models, many times. */
#include "host/device/opencl.h"
#include "host/frame/frame.h"
#include "host/mesh/generate.h"
#include "kernels/ring_layout.h"
#include "tests/check.h"

#include <string.h>

static unsigned repeats = 1;

/* ---- The plan of launches ---- */

/* Before a hull launch starts, the domain launches of all earlier ones that have points in common with it are done. */
static void check_plan(const qp_frame *frame) {
    const qp_streamed *s = &frame->ring.streamed;
    const bool in_order = frame->options.supports.retirement == QP_RETIRE_IN_ORDER;
    bool *done = calloc(s->n_launches + 1, sizeof *done);
    uint32_t ticket = 0, claimed = 0, faults = 0;
    if (!CHECK(done != NULL)) return;
    for (size_t k = 0; k < s->n_launches; ++k) {
        const qp_streamed_launch *launch = &s->launches[k];
        faults += launch->first_ticket != ticket || launch->patches == 0 || launch->points == 0;
        faults += (uint64_t)launch->begin + launch->points > frame->ring.capacity;
        faults += claimed + launch->offset != launch->begin;
        ticket += launch->patches;
        claimed += launch->points;
        for (uint32_t i = 0; i < launch->credits; ++i) {
            const uint32_t credit = s->credits[launch->first_credit + i];
            faults += credit >= k || done[credit]; /* none is waited for twice */
            done[credit] = true;
            /* Out of order nothing else is waited for. */
            const qp_streamed_launch *other = &s->launches[credit];
            faults += !in_order && (other->begin >= launch->begin + launch->points ||
                                    launch->begin >= other->begin + other->points);
        }
        for (size_t i = 0; i < k; ++i) {
            const qp_streamed_launch *other = &s->launches[i];
            const bool shares =
                other->begin < launch->begin + launch->points && launch->begin < other->begin + other->points;
            faults += shares && !done[i];
        }
        for (size_t i = 1; in_order && i < k; ++i) faults += done[i] && !done[i - 1];
    }
    CHECK(faults == 0);
    CHECK(ticket == frame->ring.n_tickets);
    free(done);
}

/* ---- The trace ---- */

typedef struct change {
    uint64_t tick;
    int64_t points;
} change;

static int by_time(const void *a, const void *b) {
    const change *x = a, *y = b;
    if (x->tick != y->tick) return x->tick < y->tick ? -1 : 1;
    return x->points < y->points ? -1 : x->points > y->points;
}

/* Stages follow each other, and no more points are held at one time than the ring has. */
static void check_trace(const qp_stream *stream, uint64_t point_bytes) {
    const qp_trace *trace = stream->trace;
    if (!CHECK(trace != NULL && trace->n_patches == stream->supports.allocations)) return;
    change *changes = calloc(2 * (size_t)trace->n_patches + 1, sizeof *changes);
    uint64_t points = 0, faults = 0;
    int64_t held = 0, most = 0;
    for (size_t i = 0; i < trace->n_patches; ++i) {
        const qp_trace_patch *p = &trace->patches[i];
        faults += !(p->start <= p->allocated && p->allocated <= p->hulled && p->hulled <= p->done &&
                    p->done <= p->retired && p->points > 0 && p->samples > 0);
        changes[2 * i] = (change){p->allocated, p->points};
        changes[2 * i + 1] = (change){p->retired, -(int64_t)p->points};
        points += p->points;
    }
    qsort(changes, 2 * (size_t)trace->n_patches, sizeof *changes, by_time);
    for (size_t i = 0; i < 2 * trace->n_patches; ++i) {
        held += changes[i].points;
        if (held > most) most = held;
    }
    CHECK(faults == 0 && held == 0);
    CHECK(points * point_bytes == stream->supports.allocated_bytes);
    CHECK((uint64_t)most * point_bytes <= stream->supports.capacity_bytes);
    free(changes);
}

/* ---- Frames ---- */

typedef struct expected {
    uint64_t hash;
    qp_supports_report scratch;
} expected;

static expected with_scratch(qp_device *device, const qp_surface *surface, qp_precision precision,
                             const qp_tessellation *tessellation) {
    const qp_frame_options options = {.precision = precision, .want_hash = 1};
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream = {0};
    if (CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err))
        CHECK_OK(qp_frame_eval(frame, tessellation, &stream, &err), err);
    qp_frame_free(frame);
    const qp_supports_report *r = &stream.supports;
    CHECK(r->kind == QP_SUPPORTS_SCRATCH && r->points_needed == r->points_computed);
    CHECK(r->allocated_bytes == r->points_needed * (precision == QP_DOUBLE ? 32 : 16));
    CHECK(r->peak_bytes <= r->capacity_bytes && r->capacity_bytes <= r->worst_case_bytes);
    return (expected){stream.hash, stream.supports};
}

static void check_counters(const expected *e, const qp_stream *stream, uint64_t ring_bytes) {
    const qp_supports_report *r = &stream->supports;
    CHECK(stream->hash == e->hash);
    CHECK(r->kind == QP_SUPPORTS_RING && r->capacity_bytes <= ring_bytes);
    CHECK(r->allocations == e->scratch.allocations && r->allocated_bytes == e->scratch.allocated_bytes);
    CHECK(r->largest_bytes == e->scratch.largest_bytes);
    CHECK(r->largest_bytes <= r->peak_bytes && r->peak_bytes <= r->capacity_bytes);
    CHECK(r->in_flight >= 1 && r->in_flight <= r->allocations);
    CHECK(r->stall_ms >= 0 && (r->stalls != 0 || r->stall_ms == 0));
    if (r->capacity_bytes < r->worst_case_bytes) CHECK(r->wraps > 0);
}

static void run(qp_device *device, const qp_surface *surface, qp_precision precision,
                const qp_tessellation *tessellation, const expected *e, uint64_t ring_bytes,
                unsigned variant) {
    const qp_frame_options options = {
        .precision = precision,
        .want_hash = 1,
        .supports = {.kind = QP_SUPPORTS_RING,
                     .ring_bytes = ring_bytes,
                     .schedule = QP_SCHEDULE_STREAMED,
                     .retirement = (variant & 1) != 0 ? QP_RETIRE_OUT_OF_ORDER : QP_RETIRE_IN_ORDER,
                     .issue_order = (variant & 2) != 0 ? QP_ISSUE_BY_PATCH : QP_ISSUE_BY_PLAN,
                     .canaries = (variant & 4) != 0,
                     .trace = (variant & 8) != 0}};
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream = {0};
    if (!CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) return;
    for (unsigned i = 0; i < 1 + repeats; ++i) {
        if (!CHECK_OK(qp_frame_eval(frame, tessellation, &stream, &err), err)) break;
        check_counters(e, &stream, ring_bytes);
        if (i == 0) check_plan(frame);
        if ((variant & 8) != 0) check_trace(&stream, precision == QP_DOUBLE ? 32 : 16);
    }
    qp_frame_free(frame);
}

/* Rings from the largest patch, which starves all others, to all patches at once. */
static void test_sizes(qp_device *device, const qp_surface *surface, qp_precision precision,
                       const qp_tessellation *tessellation, unsigned variants) {
    const expected e = with_scratch(device, surface, precision, tessellation);
    const uint64_t least = e.scratch.largest_bytes, most = e.scratch.worst_case_bytes;
    if (!CHECK(least > 0)) return;
    const uint64_t sizes[] = {least, least + least / 2, 5 * least, most / 2 > least ? most / 2 : least,
                              most,  3 * most};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        for (unsigned variant = 0; variant < 16; ++variant) {
            if ((variants >> variant & 1u) != 0)
                run(device, surface, precision, tessellation, &e, sizes[i], variant);
        }
    }
}

/* Too small by a point; and none at all, which is enough where no patch needs one. */
static void test_refusals(qp_device *device, const qp_surface *surface, const qp_surface *regular) {
    const qp_tessellation tessellation = {.factor = 8};
    const expected e = with_scratch(device, surface, QP_FLOAT, &tessellation);
    qp_frame_options options = {.want_hash = 1,
                                .supports = {.kind = QP_SUPPORTS_RING,
                                             .ring_bytes = e.scratch.largest_bytes - 1,
                                             .schedule = QP_SCHEDULE_STREAMED}};
    char needed[60];
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream = {0};
    snprintf(needed, sizeof needed, "needs %llu bytes", (unsigned long long)e.scratch.largest_bytes);
    if (CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) {
        CHECK(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_BAD_INPUT);
        CHECK(strstr(err.message, needed) != NULL);
        /* The frame is as good as before. */
        CHECK(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_BAD_INPUT);
        CHECK_OK(qp_frame_eval(frame, &(qp_tessellation){.factor = 1}, &stream, &err), err);
    }
    qp_frame_free(frame);
    options.supports.ring_bytes = 0;
    frame = NULL;
    if (CHECK_OK(qp_frame_create(device, regular, &options, &frame, &err), err)) {
        CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err);
        CHECK(stream.n_samples > 0 && stream.supports.allocations == 0);
    }
    qp_frame_free(frame);
}

/* Buffers so small that a frame takes many batches; the ring goes on from one to the next. */
static void test_batches(qp_device *host, const qp_surface *surface) {
    const qp_tessellation tessellation = {.factor = 11};
    const uint64_t most = host->info.max_buffer_bytes;
    const expected e = with_scratch(host, surface, QP_FLOAT, &tessellation);
    for (unsigned variant = 0; variant < 16; variant += 5) {
        const qp_frame_options options = {
            .want_hash = 1,
            .supports = {.kind = QP_SUPPORTS_RING,
                         .ring_bytes = 3 * e.scratch.largest_bytes,
                         .schedule = QP_SCHEDULE_STREAMED,
                         .retirement = (variant & 1) != 0 ? QP_RETIRE_OUT_OF_ORDER : QP_RETIRE_IN_ORDER,
                         .canaries = 1}};
        qp_error err = {0};
        qp_frame *frame = NULL;
        qp_stream stream = {0};
        if (CHECK_OK(qp_frame_create(host, surface, &options, &frame, &err), err)) {
            host->info.max_buffer_bytes = 1 << 16;
            if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) {
                CHECK(frame->n_batches > 1);
                check_counters(&e, &stream, options.supports.ring_bytes);
                check_plan(frame);
            }
        }
        host->info.max_buffer_bytes = most;
        qp_frame_free(frame);
    }
}

typedef struct made {
    qp_mesh *mesh;
    qp_surface *surface;
} made;

static made make(qp_mesh *mesh) {
    made m = {.mesh = mesh};
    qp_error err = {0};
    CHECK_OK(qp_surface_create(mesh, NULL, &m.surface, &err), err);
    return m;
}

static made generate(const char *kind, uint32_t n, uint64_t seed) {
    qp_generate_options options = {.n = {n}, .sharpness = -1, .seed = seed};
    qp_mesh *mesh = NULL;
    qp_error err = {0};
    if (!CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err)) exit(1);
    return make(mesh);
}

static void drop(made m) {
    qp_surface_free(m.surface);
    qp_mesh_free(m.mesh);
}

/* The acceptance: every model, both retirements, 100 runs each. */
static void test_models(qp_device *host, qp_device *opencl, const char *folder) {
    static const char *const names[] = {"bigguy", "monsterfrog", "armorguy", "rook", "bishop"};
    repeats = 99;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        char path[4096];
        qp_mesh *mesh = NULL;
        qp_error err = {0};
        snprintf(path, sizeof path, "%s/%s.obj", folder, names[i]);
        if (!CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err)) continue;
        made m = make(mesh);
        const qp_tessellation tessellation = {.factor = 4};
        if (opencl != NULL) test_sizes(opencl, m.surface, QP_FLOAT, &tessellation, 0x0003);
        for (const char *threads = "12"; *threads != '\0'; ++threads) {
            const char text[2] = {*threads, '\0'};
            setenv("QUADPLAN_THREADS", text, 1);
            test_sizes(host, m.surface, QP_FLOAT, &tessellation, 0x0003);
        }
        drop(m);
    }
}

int main(void) {
    qp_error err = {0};
    qp_device *host = NULL, *opencl = NULL;
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    if (qp_device_open(NULL, &opencl, &err) != QP_OK)
        printf("not there: an OpenCL device (%s)\n", err.message);
    const char *full = getenv("QUADPLAN_FULL");
    if (full != NULL && full[0] != '\0' && check_models() != NULL) test_models(host, opencl, check_models());
    repeats = 1;
    const made prism = generate("prism", 5, 0), torus = generate("torus", 0, 0),
               creased = generate("creased-torus", 0, 0), random = generate("random-open", 0, 2);
    const qp_tessellation nine = {.factor = 9}, odd = {.factor = 5.5f, .spacing = QP_FRACTIONAL_ODD};
    const unsigned most = CHECK_SANITIZED ? 0x8002 : 0xffff;
    for (const char *threads = "12"; *threads != '\0'; ++threads) {
        const char text[2] = {*threads, '\0'};
        setenv("QUADPLAN_THREADS", text, 1);
        test_sizes(host, prism.surface, QP_FLOAT, &nine, most);
        test_sizes(host, creased.surface, QP_FLOAT, &odd, 0xc000);
        test_sizes(host, random.surface, QP_DOUBLE, &odd, 0x4002);
    }
    test_refusals(host, prism.surface, torus.surface);
    test_batches(host, random.surface);
    if (opencl != NULL) {
        test_sizes(opencl, prism.surface, QP_FLOAT, &nine, 0x4003 & most);
        if (!CHECK_SANITIZED) test_sizes(opencl, random.surface, QP_FLOAT, &odd, 0x8002);
    }
    drop(prism);
    drop(torus);
    drop(creased);
    drop(random);
    qp_device_free(opencl);
    qp_device_free(host);
    return check_report();
}
