/* quadplan ring: how large a subdivision ring buffer must be, by the model of host/frame/pipeline.h. */
#include "host/cli/ring.h"
#include "host/cli/report.h"

#include <stdlib.h>

#define MACHINES "paper|mobile|large|hull-bound"
#define UNITS "own|shared"

/* By the words of MACHINES. */
static const qp_machine machines[] = {
    QP_MACHINE_PAPER,
    /* Few small processors with one tessellator, half of whose warps are enough to use them. */
    {.sms = 4,
     .warps = 8,
     .fill = 4,
     .point_bytes = 16,
     .hull_rate = 16,
     .tessellator_rate = 1,
     .tessellator_shared = true,
     .domain_rate = 0.2,
     .latency = 100},
    /* Many of the paper's processors, each with room for more. */
    {.sms = 128,
     .warps = 16,
     .point_bytes = 16,
     .hull_rate = 32,
     .tessellator_rate = 0.5,
     .domain_rate = 0.4,
     .latency = 200},
    /* The paper's, with stencils read by one lane after the other (32 times slower): patches differ by their hulls most. */
    {.sms = 16,
     .warps = 12,
     .point_bytes = 16,
     .hull_rate = 1,
     .tessellator_rate = 0.5,
     .domain_rate = 0.4,
     .latency = 100},
};
static const char *const machine_names[] = {"paper", "mobile", "large", "hull-bound"};

typedef struct ring_options {
    cli_views_options views;
    int machine, retirement, issue, unit;
    uint64_t sms, warps, fill, point_bytes, regular_points;
    double hull_rate, tessellator_rate, domain_rate, latency;
    bool sms_given, warps_given, fill_given, bytes_given, hull_given, tessellator_given, domain_given,
        latency_given, unit_given;
    const char *sizes;
    bool validate, json;
    cli_report report;
} ring_options;

static qp_machine choose_machine(const ring_options *o) {
    qp_machine m = machines[o->machine];
    if (o->sms_given) m.sms = (uint32_t)o->sms;
    if (o->warps_given) m.warps = (uint32_t)o->warps;
    if (o->fill_given) m.fill = (uint32_t)o->fill;
    if (o->bytes_given) m.point_bytes = (uint32_t)o->point_bytes;
    if (o->hull_given) m.hull_rate = o->hull_rate;
    if (o->tessellator_given) m.tessellator_rate = o->tessellator_rate;
    if (o->domain_given) m.domain_rate = o->domain_rate;
    if (o->latency_given) m.latency = o->latency;
    if (o->unit_given) m.tessellator_shared = o->unit == 1;
    m.out_of_order = o->retirement == QP_RETIRE_OUT_OF_ORDER;
    return m;
}

/* Sums over the patches, and their histogram. */
static void count_work(ring_run *run) {
    uint32_t most = 0;
    for (size_t i = 0; i < run->n_work; ++i) {
        const qp_patch_work *w = &run->work[i];
        run->samples += w->samples;
        run->points += w->points;
        run->weights += (double)w->points * w->ring;
        run->with_points += w->points != 0;
        if (w->points > most) most = w->points;
    }
    run->histogram_width = 4;
    while (most / run->histogram_width >= RING_HISTOGRAM_MOST) run->histogram_width *= 2;
    for (size_t i = 0; i < run->n_work; ++i)
        if (run->work[i].points != 0) ++run->histogram[run->work[i].points / run->histogram_width];
    run->histogram_bins = run->with_points == 0 ? 0 : most / run->histogram_width + 1;
    run->largest_bytes = (uint64_t)most * run->machine.point_bytes;
    run->worst_case_bytes = run->points * run->machine.point_bytes;
    const uint64_t slots = (uint64_t)run->machine.sms * run->machine.warps;
    run->at_once = slots < run->with_points ? slots : run->with_points;
    if (run->with_points != 0)
        run->estimate_bytes =
            (uint64_t)((double)run->at_once * (double)run->worst_case_bytes / (double)run->with_points + 0.5);
}

static qp_status simulate(ring_run *run, const uint64_t *sizes, qp_error *err) {
    enum { STEP = 1024 };
    qp_status status = qp_pipeline_run(run->work, run->n_work, &run->machine, 0, &run->scratch, NULL, err);
    for (size_t i = 0; i < run->n_rows && status == QP_OK; ++i) {
        ring_row *row = &run->rows[i];
        row->ring_bytes = sizes[i];
        row->fits = sizes[i] / run->machine.point_bytes * run->machine.point_bytes >= run->largest_bytes;
        if (!row->fits) continue;
        status = qp_pipeline_run(run->work, run->n_work, &run->machine, sizes[i], &row->pipeline, NULL, err);
        row->relative_throughput = row->pipeline.cycles > 0 ? run->scratch.cycles / row->pipeline.cycles : 1;
    }
    if (status == QP_OK)
        status = qp_pipeline_smallest_ring(run->work, run->n_work, &run->machine, 0.99, STEP,
                                           &run->smallest_bytes, err);
    if (status == QP_OK)
        status = qp_pipeline_run(run->work, run->n_work, &run->machine, run->smallest_bytes,
                                 &run->at_smallest, NULL, err);
    return status;
}

static qp_status measure(const char *argument, const ring_options *o, const uint64_t *sizes, size_t n_sizes,
                         cli_views *views, ring_run *run, qp_error *err) {
    run->name = argument;
    run->machine = choose_machine(o);
    run->machine_name = machine_names[o->machine];
    run->issue = o->issue;
    run->regular_points = (uint32_t)o->regular_points;
    run->n_rows = n_sizes;
    run->rows = qp_alloc(n_sizes, sizeof *run->rows, true);
    if (run->rows == NULL) return qp_fail_memory(err, n_sizes * sizeof *run->rows, "results");
    qp_status status = cli_views_open(argument, &o->views, views, err);
    if (status != QP_OK) return status;
    run->tessellation = &views->list[0].tessellation;
    run->factor = views->list[0].factor;
    status = qp_patch_work_list(views->surface, run->tessellation, run->regular_points,
                                o->issue == QP_ISSUE_BY_PLAN, &run->work, &run->n_work, err);
    if (status != QP_OK) return status;
    count_work(run);
    status = simulate(run, sizes, err);
    if (status == QP_OK && o->validate) status = ring_validate(run, views, err);
    return status;
}

static qp_status run_ring(int argc, char **argv, qp_error *err) {
    ring_options o = {.views = CLI_VIEWS_DEFAULTS,
                      .issue = QP_ISSUE_BY_PATCH,
                      .sizes = "64K..32M",
                      .report = {.script = "plot_supports.py",
                                 .write_table = ring_write_table,
                                 .write_json = ring_write_json,
                                 .write_csv = ring_write_csv}};
    const cli_option options[] = {
        {"--sizes", "LIST", "of the ring: A..B doubles from A to B, commas add (default 64K..32M)", CLI_TEXT,
         &o.sizes, 0, 0, NULL},
        {"--machine", MACHINES, "parameters to begin with (default paper)", CLI_CHOICE, &o.machine, 0, 0,
         NULL},
        {"--sm", "N", "processors (paper: 16)", CLI_COUNT, &o.sms, 1, 65536, &o.sms_given},
        {"--warps-per-sm", "N", "patches in flight on each (paper: 12)", CLI_COUNT, &o.warps, 1, 65536,
         &o.warps_given},
        {"--fill", "N", "patches at work that use all of an SM; 0: all it has room for (paper: 0)", CLI_COUNT,
         &o.fill, 0, 65536, &o.fill_given},
        {"--retire", CLI_RETIREMENTS, "out of order, slots are free before older patches are done",
         CLI_CHOICE, &o.retirement, 0, 0, NULL},
        {"--issue", CLI_ISSUE_ORDERS, "patches by their plans, or in the mesh's order (default patch)",
         CLI_CHOICE, &o.issue, 0, 0, NULL},
        {"--hull-rate", "R", "stencil weights a cycle and SM (paper: 32)", CLI_REAL, &o.hull_rate, 1e-9, 1e9,
         &o.hull_given},
        {"--tessellator-rate", "R", "(u,v) a cycle and unit; 0: no time (paper: 0.5)", CLI_REAL,
         &o.tessellator_rate, 0, 1e9, &o.tessellator_given},
        {"--tessellator", UNITS, "one an SM, or one for all (paper: own)", CLI_CHOICE, &o.unit, 0, 0,
         &o.unit_given},
        {"--domain-rate", "R", "vertices a cycle and SM (paper: 0.4)", CLI_REAL, &o.domain_rate, 1e-9, 1e9,
         &o.domain_given},
        {"--latency", "N", "cycles before a patch's hull begins (paper: 100)", CLI_REAL, &o.latency, 0, 1e9,
         &o.latency_given},
        {"--point-bytes", "N", "of a control point (paper: 16)", CLI_COUNT, &o.point_bytes, 1, 65536,
         &o.bytes_given},
        {"--regular-points", "N", "that regular patches put on the ring: 0, or 16 for copies (default 0)",
         CLI_COUNT, &o.regular_points, 0, 16, NULL},
        {"--validate", NULL, "also run the fused kernel on the host, and the model of it beside", CLI_FLAG,
         &o.validate, 0, 0, NULL},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &o.json, 0, 0, NULL},
        {"--csv", "FILE", "the rows, a line a size", CLI_TEXT, &o.report.csv, 0, 0, NULL},
        {"--chart", "FILE.png|.svg", "draw slowdown, histogram and live bytes (needs python3 and matplotlib)",
         CLI_TEXT, &o.report.chart, 0, 0, NULL},
        CLI_VIEWS_OPTIONS(o.views),
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_ring, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    uint64_t *sizes = NULL;
    size_t n_sizes = 0;
    if (o.json) o.report.json = "-";
    status = cli_size_list_read("--sizes", o.sizes, &sizes, &n_sizes, err);
    if (status == QP_OK) status = cli_report_check(&o.report, err);
    ring_run *run = qp_alloc(1, sizeof *run, true);
    cli_views views = {0};
    if (status == QP_OK && run == NULL) status = qp_fail_memory(err, sizeof *run, "results");
    if (status == QP_OK) status = measure(arguments.values[0], &o, sizes, n_sizes, &views, run, err);
    if (status == QP_OK) status = cli_report_write(&o.report, run, err);
    if (run != NULL) {
        free(run->work);
        free(run->rows);
    }
    free(run);
    free(sizes);
    cli_views_close(&views);
    return status;
}

const cli_command cli_ring = {
    "ring", "MESH|SCENE", "How large a ring buffer for control points must be: a model of the hardware.",
    CLI_VIEWS_HELP "\nThe work of each patch (stencil weights, vertices) goes through a model of a "
                   "tessellation pipeline: patches are\n"
                   "issued in order to SMs, take a place on the ring, run their hull, get their (u,v), run "
                   "their domain stage, and\n"
                   "retire. relative_throughput is that of unlimited scratch = 1; stall_fraction is the time "
                   "in which the next patch\n"
                   "had a slot but no room, occupancy the mean share of slots with a patch at work.",
    run_ring};
