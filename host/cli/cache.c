/* quadplan cache: what a cache of control points saves, within a pass and from pass to pass; every number is of a real run, counted by
 * the kernels. */
#include "host/cli/cache.h"
#include "host/base/measure.h"
#include "host/cli/report.h"

#include <stdlib.h>
#include <string.h>

#define EVERY_POLICY "every|" CLI_CACHE_POLICIES

typedef struct cache_options {
    cli_views_options views;
    const char *sizes, *device;
    uint64_t passes, repeats;
    bool passes_given, json;
    int policy, precision, issue; /* 0: every policy */
    cli_report report;
} cache_options;

typedef struct bench {
    const cache_options *options;
    cli_views views;
    qp_device *device;
    qp_frame *scratch;
    double *positions; /* of the mesh, as they were */
    qp_tessellation passes[CACHE_MOST_PASSES];
    /* Of one cache: milliseconds of each pass and repetition. */
    double hull[CACHE_MOST_PASSES][CACHE_MOST_REPEATS], scratch_hull[CACHE_MOST_PASSES][CACHE_MOST_REPEATS];
    double frame[CACHE_MOST_PASSES][CACHE_MOST_REPEATS], scratch_frame[CACHE_MOST_PASSES][CACHE_MOST_REPEATS];
    qp_supports_report reports[CACHE_MOST_PASSES]; /* of the last repetition */
} bench;

/* A scene's views in turn; of a mesh, the camera's at the factor asked for, and then, as for shadow maps ever farther away, half of it, a
 * quarter and so on, down to 1. */
static void list_passes(bench *b, cache_run *run) {
    const cli_views *v = &b->views;
    run->n_passes = v->scene != NULL && !b->options->passes_given ? v->count : b->options->passes;
    for (uint64_t p = 0; p < run->n_passes; ++p) {
        const cli_view *view = &v->list[p % v->count];
        qp_tessellation *t = &b->passes[p];
        *t = view->tessellation;
        if (v->scene == NULL && t->tolerance == 0 && p > 0)
            t->factor = b->passes[p - 1].factor > 2 ? b->passes[p - 1].factor / 2 : 1;
        run->factors[p] = v->scene == NULL && view->factor != 0 ? t->factor : (float)view->factor;
        run->names[p] = view->name;
    }
}

/* Empties a cache: every vertex moves, and comes back. */
static qp_status empty(const bench *b, qp_frame *frame, qp_error *err) {
    const qp_mesh *mesh = b->views.mesh;
    const size_t count = 3 * (size_t)mesh->n_vertices;
    static const double away[3] = {1.37, 1.61, 1.83};
    for (size_t i = 0; i < count; ++i) mesh->positions[i] = b->positions[i] + away[i % 3] * mesh->diagonal;
    qp_status status = qp_frame_update_positions(frame, err);
    memcpy(mesh->positions, b->positions, count * sizeof *mesh->positions);
    return status == QP_OK ? qp_frame_update_positions(frame, err) : status;
}

/* The passes from an empty cache, each beside the same pass with scratch, which goes first every other time. */
static qp_status run_passes(bench *b, qp_frame *cached, uint64_t n_passes, uint64_t repeat, qp_error *err) {
    for (uint64_t p = 0; p < n_passes; ++p) {
        for (uint64_t k = 0; k < 2; ++k) {
            const bool is_cached = (k ^ (repeat & 1)) != 0;
            qp_stream stream;
            qp_status status = qp_frame_eval(is_cached ? cached : b->scratch, &b->passes[p], &stream, err);
            if (status != QP_OK) return status;
            (is_cached ? b->hull : b->scratch_hull)[p][repeat] = stream.hull_ms;
            (is_cached ? b->frame : b->scratch_frame)[p][repeat] = stream.frame_ms;
            if (is_cached) b->reports[p] = stream.supports;
        }
    }
    return QP_OK;
}

/* Rows after 1, 2, ... passes. */
static void add_rows(bench *b, const qp_supports_options *supports, cache_run *run) {
    cache_row row = {.policy = (int)supports->cache_policy};
    for (uint64_t p = 0; p < run->n_passes; ++p) {
        const qp_supports_report *r = &b->reports[p];
        row.passes = p + 1;
        row.capacity_bytes = r->capacity_bytes;
        row.cache_bytes = supports->cache_policy == QP_CACHE_ALL ? r->capacity_bytes : supports->cache_bytes;
        row.held_bytes = r->peak_bytes;
        row.index_bytes = r->index_bytes;
        row.needed += r->points_needed;
        row.computed += r->points_computed;
        row.hits += r->hits;
        row.cold += r->misses_cold;
        row.capacity += r->misses_capacity;
        row.conflict += r->misses_conflict;
        row.duplicates += r->duplicates;
        row.hull_ms += qp_median(b->hull[p], run->repeats);
        row.scratch_ms += qp_median(b->scratch_hull[p], run->repeats);
        row.frame_ms += qp_median(b->frame[p], run->repeats);
        row.scratch_frame_ms += qp_median(b->scratch_frame[p], run->repeats);
        run->rows[run->n_rows++] = row;
    }
}

static qp_status measure_cache(bench *b, const qp_supports_options *supports, cache_run *run, qp_error *err) {
    const qp_frame_options options = {.precision = (qp_precision)b->options->precision,
                                      .supports = *supports};
    qp_frame *cached = NULL;
    qp_status status = qp_frame_create(b->device, b->views.surface, &options, &cached, err);
    for (uint64_t repeat = 0; repeat < run->repeats && status == QP_OK; ++repeat) {
        if (repeat != 0) status = empty(b, cached, err);
        if (status == QP_OK) status = run_passes(b, cached, run->n_passes, repeat, err);
    }
    qp_frame_free(cached);
    if (status == QP_OK) add_rows(b, supports, run);
    return status;
}

static qp_status measure_all(bench *b, const uint64_t *sizes, size_t n_sizes, cache_run *run, qp_error *err) {
    enum { POLICIES = 4 };
    const int only = b->options->policy;
    run->rows = qp_alloc((1 + (POLICIES - 1) * n_sizes) * run->n_passes, sizeof *run->rows, true);
    if (run->rows == NULL) return qp_fail_memory(err, n_sizes * run->n_passes * sizeof *run->rows, "results");
    qp_status status = QP_OK;
    for (int policy = 0; policy < POLICIES && status == QP_OK; ++policy) {
        if (only != 0 && policy + 1 != only) continue;
        qp_supports_options supports = {.kind = QP_SUPPORTS_CACHE,
                                        .issue_order = (qp_issue_order)b->options->issue,
                                        .cache_policy = (qp_cache_policy)policy};
        const size_t n = policy == QP_CACHE_ALL ? 1 : n_sizes;
        for (size_t i = 0; i < n && status == QP_OK; ++i) {
            supports.cache_bytes = sizes[i];
            status = measure_cache(b, &supports, run, err);
        }
    }
    return status;
}

static qp_status open_bench(bench *b, const char *argument, cache_run *run, qp_error *err) {
    const cache_options *o = b->options;
    const qp_frame_options options = {.precision = (qp_precision)o->precision};
    qp_status status = cli_views_open(argument, &o->views, &b->views, err);
    if (status != QP_OK) return status;
    const size_t count = 3 * (size_t)b->views.mesh->n_vertices;
    b->positions = qp_alloc(count, sizeof *b->positions, false);
    if (b->positions == NULL) return qp_fail_memory(err, count * sizeof *b->positions, "positions");
    memcpy(b->positions, b->views.mesh->positions, count * sizeof *b->positions);
    list_passes(b, run);
    status = qp_device_open(o->device, &b->device, err);
    if (status != QP_OK) return status;
    run->device = qp_device_name(b->device);
    status = qp_frame_create(b->device, b->views.surface, &options, &b->scratch, err);
    /* Once for nothing: it takes the runtime's set-up, and makes room. */
    qp_stream stream;
    if (status == QP_OK) status = qp_frame_eval(b->scratch, &b->passes[0], &stream, err);
    return status;
}

static void close_bench(bench *b) {
    qp_frame_free(b->scratch);
    qp_device_free(b->device);
    cli_views_close(&b->views);
    free(b->positions);
}

static qp_status measure(const char *argument, const cache_options *o, const uint64_t *sizes, size_t n_sizes,
                         qp_error *err) {
    cache_run run = {.name = argument, .precision = o->precision, .issue = o->issue, .repeats = o->repeats};
    bench *b = qp_alloc(1, sizeof *b, true);
    if (b == NULL) return qp_fail_memory(err, sizeof *b, "timings");
    b->options = o;
    qp_status status = open_bench(b, argument, &run, err);
    if (status == QP_OK) status = measure_all(b, sizes, n_sizes, &run, err);
    if (status == QP_OK) status = cli_report_write(&o->report, &run, err);
    close_bench(b);
    free(b);
    free(run.rows);
    return status;
}

static qp_status run_cache(int argc, char **argv, qp_error *err) {
    cache_options o = {.views = CLI_VIEWS_DEFAULTS,
                       .sizes = "64K..4M",
                       .passes = 4,
                       .repeats = 5,
                       .report = {.script = "plot_supports.py",
                                  .write_table = cache_write_table,
                                  .write_json = cache_write_json,
                                  .write_csv = cache_write_csv}};
    const cli_option options[] = {
        {"--sizes", "LIST", "of bounded caches: A..B doubles from A to B, commas add (default 64K..4M)",
         CLI_TEXT, &o.sizes, 0, 0, NULL},
        {"--passes", "N", "over the same geometry (default: a scene's own, else 4)", CLI_COUNT, &o.passes, 1,
         CACHE_MOST_PASSES, &o.passes_given},
        {"--policy", EVERY_POLICY, "a place for every point, or which one goes (default every)", CLI_CHOICE,
         &o.policy, 0, 0, NULL},
        {"--issue", CLI_ISSUE_ORDERS, "patches by their plans, or in the mesh's order (default plan)",
         CLI_CHOICE, &o.issue, 0, 0, NULL},
        {"--repeat", "N", "from an empty cache; times are medians (default 5)", CLI_COUNT, &o.repeats, 1,
         CACHE_MOST_REPEATS, NULL},
        {"--precision", CLI_PRECISIONS, "of stencils and kernels (default float)", CLI_CHOICE, &o.precision,
         0, 0, NULL},
        {"--device", "D", "host, P.D, or part of a name, as `quadplan devices` lists them", CLI_TEXT,
         &o.device, 0, 0, NULL},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &o.json, 0, 0, NULL},
        {"--csv", "FILE", "the rows, a line each", CLI_TEXT, &o.report.csv, 0, 0, NULL},
        {"--chart", "FILE.png|.svg",
         "draw hit rate and hull time against size (needs python3 and matplotlib)", CLI_TEXT, &o.report.chart,
         0, 0, NULL},
        CLI_VIEWS_OPTIONS(o.views),
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_cache, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    uint64_t *sizes = NULL;
    size_t n_sizes = 0;
    if (o.json) o.report.json = "-";
    status = cli_size_list_read("--sizes", o.sizes, &sizes, &n_sizes, err);
    if (status == QP_OK) status = cli_report_check(&o.report, err);
    if (status == QP_OK) status = measure(arguments.values[0], &o, sizes, n_sizes, err);
    free(sizes);
    return status;
}

const cli_command cli_cache = {
    "cache", "MESH|SCENE", "What a cache of control points saves, within a pass and from pass to pass.",
    CLI_VIEWS_HELP
    "\nReal evaluations, from an empty cache: of a scene, its views in turn; of a mesh, the first pass at "
    "--tess, and the\n"
    "others, as for shadow maps ever farther away, at half of it, a quarter and so on, down to 1 (with "
    "--tolerance all\n"
    "alike). A row is what came of one cache after 1, 2, ... passes together. hit_rate is of the points "
    "needed;\n"
    "relative_hull_time is the hull stage's time over that with scratch, in turns in the same run.",
    run_cache};
