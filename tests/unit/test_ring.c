/* The ring buffer (kernels/ring.h, section 8.1 of the paper): its allocator alone, starved and overrun, and frames that use it, which
 * have the same bits as those with scratch. QUADPLAN_FULL=1 runs all models, many times.
 *
 *   test_ring --threads   only what the device "host" runs, on many threads: also built with ThreadSanitizer (tests/CMakeLists.txt) */
#define _GNU_SOURCE
#include "host/device/opencl.h"
#include "host/frame/frame.h"
#include "host/mesh/generate.h"
#include "kernels/frame_layout.h"
#include "kernels/plan_layout.h"
#include "kernels/portable.h"
#include "kernels/ring_layout.h"

#include "kernels/ring.h"

#include "host/base/random.h"
#include "tests/check.h"

#include <string.h>

#if defined(__SANITIZE_THREAD__)
enum { SLOW = 1 };
#else
enum { SLOW = CHECK_SANITIZED };
#endif

static bool full;

static void set_threads(unsigned n) {
    char text[20];
    snprintf(text, sizeof text, "%u", n);
    setenv("QUADPLAN_THREADS", text, 1);
}

/* ---- The allocator alone ---- */

enum { MOST_POINTS = 40, POINT_WORDS = 4 };

typedef struct storm {
    uint32_t *words, *memory; /* memory: capacity points */
    uint32_t capacity;
    const uint32_t *points; /* of each ticket */
    uint32_t failures;
} storm;

static storm storm_make(uint32_t capacity, uint32_t options, uint32_t n, uint32_t *points) {
    const uint32_t record = (options & QP_RB_TRACE) != 0 ? QP_RECORD_TRACE_WORDS : QP_RECORD_WORDS;
    storm s = {.words = qp_alloc(QP_RB_WORDS + (size_t)n * record, sizeof(uint32_t), true),
               .memory = qp_alloc((size_t)capacity * POINT_WORDS, sizeof(uint32_t), true),
               .capacity = capacity,
               .points = points};
    if (!CHECK(s.words != NULL && s.memory != NULL)) exit(1);
    s.words[QP_RB_CAPACITY] = capacity;
    s.words[QP_RB_OPTIONS] = options;
    /* Counters of all that ever was wrap around on the way. */
    s.words[QP_RB_CLAIMED] = s.words[QP_RB_RELEASED] = 0xffffff00u;
    return s;
}

static void storm_free(storm *s) {
    free(s->words);
    free(s->memory);
}

/* A patch's way: nobody else writes where it has its points. */
static void run_patches(void *context, size_t begin, size_t end, unsigned worker) {
    storm *s = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        ring_patch p;
        ring_begin(s->words, &p);
        ring_allocate(s->words, s->memory, POINT_WORDS, s->points[p.ticket], &p);
        uint32_t *own = s->memory + (size_t)p.first * POINT_WORDS, bad = p.first + p.points > s->capacity;
        for (uint32_t k = 0; k < p.points * POINT_WORDS && bad == 0; ++k) own[k] = p.ticket + 1;
        if (p.ticket % 7 == 0)
            qp_host_wait(QP_WAIT_ROUNDS); /* some take longer, so that others overtake them */
        for (uint32_t k = 0; k < p.points * POINT_WORDS && bad == 0; ++k) bad |= own[k] != p.ticket + 1;
        if (bad != 0) __atomic_fetch_add(&s->failures, 1, __ATOMIC_RELAXED);
        ring_retire(s->words, s->memory, POINT_WORDS, &p);
    }
}

static void check_storm(const storm *s, uint32_t n, uint64_t sum, uint32_t guards) {
    const uint32_t *w = s->words;
    CHECK(s->failures == 0 && w[QP_RB_BROKEN] == 0);
    CHECK(w[QP_RB_TICKET] == n && w[QP_RB_TURN] == n && w[QP_RB_RETIRED] == n && w[QP_RB_ENDED] == n);
    CHECK(w[QP_RB_PENDING] == 0 && w[QP_RB_CLAIMED] == w[QP_RB_RELEASED]);
    CHECK((w[QP_RB_ALLOCATED] | (uint64_t)w[QP_RB_ALLOCATED + 1] << 32) == sum);
    CHECK(w[QP_RB_RETURNED] == (uint32_t)sum);
    CHECK(w[QP_RB_PEAK] <= s->capacity && w[QP_RB_MOST_IN_FLIGHT] >= 1);
    const uint64_t wasted = w[QP_RB_WASTED] | (uint64_t)w[QP_RB_WASTED + 1] << 32;
    CHECK(w[QP_RB_CLAIMED] - 0xffffff00u == (uint32_t)(sum + wasted + (uint64_t)guards * n));
    for (uint32_t k = 0; k < QP_RB_SLOT_WORDS; ++k) CHECK(w[QP_RB_SLOTS + k] == 0);
}

/* Random sizes through rings from the largest patch up, of any size. */
static void test_storm(unsigned threads, uint32_t options, uint32_t n) {
    static const uint32_t more[] = {0, 1, MOST_POINTS - 1, 3 * MOST_POINTS + 5, 4096};
    const uint32_t guards = (options & QP_RB_CANARIES) != 0 ? 2 * QP_RB_GUARD : 0;
    uint32_t *points = malloc(n * sizeof *points);
    if (!CHECK(points != NULL)) return;
    set_threads(threads);
    for (size_t m = 0; m < sizeof more / sizeof more[0]; ++m) {
        qp_random random = {m + 1};
        uint64_t sum = 0;
        for (uint32_t i = 0; i < n; ++i) {
            points[i] = i % 5 == 0 ? MOST_POINTS : qp_random_below(&random, MOST_POINTS + 1);
            sum += points[i];
        }
        storm s = storm_make(MOST_POINTS + guards + more[m], options, n, points);
        qp_parallel(n, 1, run_patches, &s);
        check_storm(&s, n, sum, guards);
        storm_free(&s);
    }
    free(points);
}

/* One patch after the other: where each lies, what is skipped, and the new start of an empty ring. */
static void test_places(void) {
    uint32_t points[] = {4, 4, 6, 10, 3, 0, 7};
    storm s = storm_make(10, QP_RB_IN_ORDER, 7, points);
    const uint32_t first[] = {0, 4, 0, 0, 0, 3, 3};
    const uint32_t wraps[] = {0, 0, 1, 2, 3, 3, 3};
    for (uint32_t i = 0; i < 7; ++i) {
        ring_patch p;
        ring_begin(s.words, &p);
        ring_allocate(s.words, s.memory, POINT_WORDS, points[i], &p);
        CHECK(p.ticket == i && p.first == first[i] && p.points == points[i] &&
              s.words[QP_RB_WRAPS] == wraps[i]);
        ring_retire(s.words, s.memory, POINT_WORDS, &p);
    }
    check_storm(&s, 7, 34, 0);
    CHECK(s.words[QP_RB_PEAK] == 10 && s.words[QP_RB_STALLS] == 0 && s.words[QP_RB_WASTED] == 0);
    storm_free(&s);

    /* Two at a time: the second of three begins anew while the first still lives, which costs what is left at the end. */
    uint32_t two[] = {5, 4, 4};
    storm t = storm_make(10, 0, 3, two);
    ring_patch p[3];
    for (uint32_t i = 0; i < 2; ++i) {
        ring_begin(t.words, &p[i]);
        ring_allocate(t.words, t.memory, POINT_WORDS, two[i], &p[i]);
    }
    ring_retire(t.words, t.memory, POINT_WORDS, &p[0]);
    ring_begin(t.words, &p[2]);
    ring_allocate(t.words, t.memory, POINT_WORDS, two[2], &p[2]);
    CHECK(p[1].first == 5 && p[2].first == 0 && t.words[QP_RB_WASTED] == 1 && t.words[QP_RB_WRAPS] == 1);
    CHECK(t.words[QP_RB_PEAK] == 9 && t.words[QP_RB_MOST_IN_FLIGHT] == 2);
    /* Out of order: the last one's place is free once the one before is. */
    ring_retire(t.words, t.memory, POINT_WORDS, &p[2]);
    CHECK(t.words[QP_RB_RETIRED] == 1);
    ring_retire(t.words, t.memory, POINT_WORDS, &p[1]);
    check_storm(&t, 3, 13, 0);
    storm_free(&t);
}

/* A word too far on either side is found, and one within is none. */
static void test_canaries(void) {
    static const int writes[] = {0,           3 * POINT_WORDS - 1, -1, 3 * POINT_WORDS, 4 * POINT_WORDS - 1,
                                 -POINT_WORDS};
    for (size_t i = 0; i < sizeof writes / sizeof writes[0]; ++i) {
        uint32_t points[] = {2, 3};
        storm s = storm_make(16, QP_RB_CANARIES, 2, points);
        ring_patch p[2];
        for (uint32_t k = 0; k < 2; ++k) {
            ring_begin(s.words, &p[k]);
            ring_allocate(s.words, s.memory, POINT_WORDS, points[k], &p[k]);
        }
        s.memory[(ptrdiff_t)(p[1].first * POINT_WORDS) + writes[i]] = 17;
        for (uint32_t k = 0; k < 2; ++k) ring_retire(s.words, s.memory, POINT_WORDS, &p[k]);
        CHECK(s.words[QP_RB_BROKEN] == (i >= 2) && s.words[QP_RB_FIRST_BROKEN] == (i >= 2 ? 2 : 0));
        storm_free(&s);
    }
}

/* ---- Frames ---- */

typedef struct setting {
    uint64_t ring_bytes;
    qp_retirement retirement;
    qp_issue_order issue;
    int canaries, trace;
} setting;

static qp_frame_options options_of(qp_precision precision, const setting *s) {
    return (qp_frame_options){.precision = precision,
                              .want_hash = 1,
                              .supports = {.kind = s == NULL ? QP_SUPPORTS_SCRATCH : QP_SUPPORTS_RING,
                                           .ring_bytes = s == NULL ? 0 : s->ring_bytes,
                                           .retirement = s == NULL ? QP_RETIRE_IN_ORDER : s->retirement,
                                           .issue_order = s == NULL ? QP_ISSUE_BY_PLAN : s->issue,
                                           .canaries = s == NULL ? 0 : s->canaries,
                                           .trace = s == NULL ? 0 : s->trace}};
}

static void check_trace(const qp_stream *stream, bool has_clock) {
    const qp_trace *trace = stream->trace;
    if (!CHECK(trace != NULL) || !CHECK(trace->n_patches == stream->supports.allocations)) return;
    CHECK(has_clock == (trace->ticks_per_ms > 0));
    uint64_t points = 0;
    for (uint64_t i = 0; i < trace->n_patches; ++i) {
        const qp_trace_patch *p = &trace->patches[i];
        points += p->points;
        CHECK(p->start <= p->allocated && p->allocated <= p->hulled && p->hulled <= p->done &&
              p->done <= p->retired);
        CHECK(p->slot < 64 && p->samples > 0 && p->points > 0);
        if (i > 0) CHECK(p[-1].retired <= p->retired);
    }
    CHECK(points == stream->supports.points_computed);
}

/* The stream with scratch, for its hash, and its report, for the sizes. */
static bool eval_scratch(qp_device *device, const qp_surface *surface, qp_precision precision,
                         const qp_tessellation *tessellation, qp_stream *stream) {
    qp_error err;
    qp_frame *frame = NULL;
    const qp_frame_options options = options_of(precision, NULL);
    const bool good = CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err) &&
                      CHECK_OK(qp_frame_eval(frame, tessellation, stream, &err), err);
    qp_frame_free(frame);
    return good;
}

static void check_ring(qp_device *device, const qp_surface *surface, qp_precision precision,
                       const qp_tessellation *tessellation, const setting *s, const qp_stream *scratch,
                       int runs) {
    qp_error err;
    qp_frame *frame = NULL;
    qp_stream stream;
    const qp_frame_options options = options_of(precision, s);
    if (!CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) return;
    for (int i = 0; i < runs; ++i) {
        if (!CHECK_OK(qp_frame_eval(frame, tessellation, &stream, &err), err)) break;
        const qp_supports_report *r = &stream.supports, *all = &scratch->supports;
        CHECK(stream.hash == scratch->hash);
        CHECK(r->kind == QP_SUPPORTS_RING && r->allocations == all->allocations);
        CHECK(r->allocated_bytes == all->worst_case_bytes && r->points_computed == all->points_computed);
        CHECK(r->capacity_bytes <= s->ring_bytes && r->peak_bytes <= r->capacity_bytes);
        CHECK(r->peak_bytes >= all->largest_bytes && r->largest_bytes == all->largest_bytes);
        CHECK(r->in_flight >= 1 || r->allocations == 0);
        /* A ring that all fit in is none. */
        if (s->ring_bytes >= all->worst_case_bytes && !s->canaries) CHECK(r->stalls == 0 && r->wraps == 0);
        if (s->trace)
            check_trace(&stream, qp_device_get_info(device)->has_clock);
        else
            CHECK(stream.trace == NULL);
    }
    qp_frame_free(frame);
}

/* Rings from the largest patch to the worst case. */
static void check_sizes(qp_device *device, const qp_surface *surface, qp_precision precision,
                        const qp_tessellation *tessellation, unsigned sizes, int runs) {
    qp_stream scratch;
    if (!eval_scratch(device, surface, precision, tessellation, &scratch)) return;
    const double largest = (double)scratch.supports.largest_bytes,
                 all = (double)scratch.supports.worst_case_bytes;
    for (unsigned i = 0; i < sizes; ++i) {
        /* No multiples of a point, but for the smallest. */
        const double bytes = i == 0 ? largest : largest * pow(all / largest, i / (sizes - 1.0)) + 5;
        for (int retirement = 0; retirement < 2; ++retirement) {
            const setting s = {.ring_bytes = (uint64_t)bytes,
                               .retirement = (qp_retirement)retirement,
                               .issue = (qp_issue_order)((i + (unsigned)retirement) % 2),
                               .canaries = i % 3 == 0,
                               .trace = i % 2 == 1};
            check_ring(device, surface, precision, tessellation, &s, &scratch, runs);
        }
    }
}

static qp_surface *surface_of(const char *kind, uint32_t n, uint32_t faces, qp_mesh **mesh) {
    qp_error err;
    qp_surface *surface = NULL;
    const qp_generate_options options = {.n = {n, 0, 0}, .sharpness = -1, .seed = 3, .faces = faces};
    *mesh = NULL;
    if (CHECK_OK(qp_mesh_generate(kind, &options, mesh, &err), err))
        CHECK_OK(qp_surface_create(*mesh, NULL, &surface, &err), err);
    return surface;
}

static void test_frames(qp_device *device, const qp_surface *surface, int runs) {
    static const unsigned threads[] = {1, 2, 8};
    const qp_tessellation tessellation = {.factor = SLOW ? 2 : 4};
    for (size_t t = 0; t < sizeof threads / sizeof threads[0]; ++t) {
        set_threads(threads[t]);
        check_sizes(device, surface, QP_FLOAT, &tessellation, 3, runs);
        if (!SLOW && t == 0) check_sizes(device, surface, QP_DOUBLE, &tessellation, 2, runs);
        if (!qp_device_is_host(device)) break; /* OpenCL has its own threads */
    }
}

/* An evaluation in several launches: the ring is empty between them, and the counters add up. */
static void test_batches(qp_device *host, const qp_surface *surface) {
    const qp_tessellation tessellation = {.factor = 4};
    const uint64_t kept = host->info.max_buffer_bytes;
    qp_error err;
    qp_frame *frame = NULL;
    qp_stream whole, stream;
    if (!eval_scratch(host, surface, QP_FLOAT, &tessellation, &whole)) return;
    const setting s = {.ring_bytes = whole.supports.largest_bytes, .trace = 1, .canaries = 1};
    const qp_frame_options options = options_of(QP_FLOAT, &s);
    if (CHECK_OK(qp_frame_create(host, surface, &options, &frame, &err), err)) {
        /* Less than all patches need, and no less than the rest of what is on the device. */
        host->info.max_buffer_bytes = whole.n_samples * 24 / 3;
        for (int i = 0; i < 3; ++i) {
            if (!CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) break;
            CHECK(frame->n_batches >= 3 && stream.hash == whole.hash);
            CHECK(stream.supports.allocations == whole.supports.allocations);
            CHECK(stream.supports.allocated_bytes == whole.supports.worst_case_bytes);
            check_trace(&stream, true);
        }
        host->info.max_buffer_bytes = kept;
    }
    qp_frame_free(frame);
}

/* Rings that are too small, and patches that need none. */
static void test_refusals(qp_device *host, const qp_surface *surface) {
    qp_error err;
    qp_frame *frame = NULL;
    qp_stream stream;
    const qp_tessellation tessellation = {.factor = 4};
    if (!eval_scratch(host, surface, QP_FLOAT, &tessellation, &stream)) return;
    const uint64_t largest = stream.supports.largest_bytes, sizes[] = {0, 15, largest - 1, UINT64_MAX};
    char says[100];
    snprintf(says, sizeof says, "needs %llu bytes", (unsigned long long)largest);
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        const setting s = {.ring_bytes = sizes[i]};
        const qp_frame_options options = options_of(QP_FLOAT, &s);
        if (!CHECK_OK(qp_frame_create(host, surface, &options, &frame, &err), err)) continue;
        CHECK(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_BAD_INPUT);
        CHECK(strstr(err.message, i < 3 ? says : "too large") != NULL);
        qp_frame_free(frame);
    }
    qp_mesh *mesh;
    qp_surface *torus = surface_of("torus", 5, 0, &mesh);
    const setting none = {.trace = 1};
    if (torus != NULL && eval_scratch(host, torus, QP_FLOAT, &tessellation, &stream))
        check_ring(host, torus, QP_FLOAT, &tessellation, &none, &stream, 2);
    qp_surface_free(torus);
    qp_mesh_free(mesh);
}

/* Copies the kernels to a folder, where the hull of the fused kernel writes a point more than its patch has. */
static bool plant_overrun(const char *source, const char *folder) {
    char command[8192];
    snprintf(command, sizeof command,
             "mkdir -p '%s' && cp '%s'/kernels/* '%s' && sed -i 's/points_of_group, own/points_of_group + "
             "1u, own/' "
             "'%s/fused.cl' && ! cmp -s '%s/kernels/fused.cl' '%s/fused.cl'",
             folder, source, folder, folder, source, folder);
    return system(command) == 0;
}

static void test_overrun(qp_device *opencl, const qp_surface *surface) {
    const char *source = getenv("QUADPLAN_SOURCE_DIR");
    char folder[] = "quadplan-overrun-XXXXXX", command[100];
    if (source == NULL || !CHECK(mkdtemp(folder) != NULL) || !CHECK(plant_overrun(source, folder))) return;
    qp_error err;
    qp_frame *frame = NULL;
    qp_stream stream;
    const setting s = {.ring_bytes = 1 << 16, .canaries = 1};
    const qp_frame_options options = options_of(QP_FLOAT, &s);
    const qp_tessellation tessellation = {.factor = 4};
    setenv("QUADPLAN_KERNELS", folder, 1);
    if (CHECK_OK(qp_frame_create(opencl, surface, &options, &frame, &err), err)) {
        CHECK(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_CHECK_FAILED);
        CHECK(strstr(err.message, "canaries") != NULL);
    }
    unsetenv("QUADPLAN_KERNELS");
    qp_frame_free(frame);
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    CHECK(system(command) == 0);
}

/* ---- All models, as often as the acceptance has it ---- */

static void test_models(qp_device *device, unsigned most_threads) {
    static const char *const names[] = {"bigguy.obj", "monsterfrog.obj", "armorguy.obj", "bishop.obj",
                                        "rook.obj"};
    const qp_tessellation tessellation = {.factor = 8};
    for (size_t m = 0; m < sizeof names / sizeof names[0]; ++m) {
        char path[4096];
        qp_error err;
        qp_mesh *mesh = NULL;
        qp_surface *surface = NULL;
        snprintf(path, sizeof path, "%s/%s", check_models(), names[m]);
        if (CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err) &&
            CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
            for (unsigned threads = 1; threads <= most_threads; ++threads) {
                set_threads(threads);
                check_sizes(device, surface, QP_FLOAT, &tessellation, 5, 100);
            }
        }
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
}

int main(int argc, char **argv) {
    const bool threads_only = argc == 2 && strcmp(argv[1], "--threads") == 0;
    const char *wish = getenv("QUADPLAN_FULL");
    qp_error err;
    qp_device *host = NULL, *opencl = NULL;
    full = wish != NULL && wish[0] != '\0';
    if (argc == 2 && strcmp(argv[1], "--models") == 0) {
        if (CHECK_OK(qp_device_open(NULL, &opencl, &err), err)) test_models(opencl, 1);
        qp_device_free(opencl);
        return check_report();
    }
    test_places();
    test_canaries();
    for (uint32_t options = 0; options < 8; ++options) {
        test_storm(1, options, 100);
        test_storm(2, options, SLOW ? 200 : 500);
        test_storm(8, options, SLOW ? 200 : 500);
    }
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    if (!threads_only && qp_device_open(NULL, &opencl, &err) != QP_OK)
        printf("without OpenCL: %s\n", err.message);
    qp_mesh *mesh;
    qp_surface *surface = surface_of("random-closed", 0, SLOW ? 30 : 60, &mesh);
    if (surface != NULL) {
        test_frames(host, surface, SLOW ? 2 : 3);
        test_batches(host, surface);
        test_refusals(host, surface);
        if (opencl != NULL) test_frames(opencl, surface, SLOW ? 1 : 3);
        if (opencl != NULL && !SLOW) test_overrun(opencl, surface);
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    if (full && !threads_only && check_models() != NULL) {
        test_models(host, 2);
        char command[4096];
        /* PoCL decides on its threads when it starts. */
        for (int n = 1; n <= 2; ++n) {
            snprintf(command, sizeof command, "POCL_MAX_PTHREAD_COUNT=%d '%s' --models", n, argv[0]);
            CHECK(opencl == NULL || system(command) == 0);
        }
    }
    qp_device_free(host);
    qp_device_free(opencl);
    return check_report();
}
