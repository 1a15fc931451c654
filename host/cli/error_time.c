/* quadplan bench error-time: run time against error, of every configuration and of the peers. */
#define _GNU_SOURCE
#include "host/cli/error_time.h"
#include "host/base/output.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

typedef void writer(const et_run *run, FILE *file);

static qp_status write_file(const et_run *run, const char *path, writer *write, qp_error *err) {
    qp_output output;
    qp_status status = qp_output_open(&output, path, err);
    if (status != QP_OK) return status;
    write(run, output.file);
    return qp_output_commit(&output, err);
}

/* The chart is drawn from JSON: from the file that was asked for, or from one that is removed again. */
static qp_status draw(const et_run *run, const char *json, const char *chart, qp_error *err) {
    if (json != NULL && strcmp(json, "-") != 0) return et_draw_chart(json, chart, err);
    const char *folder = getenv("TMPDIR");
    char path[4096];
    snprintf(path, sizeof path, "%s/quadplan-XXXXXX", folder != NULL && folder[0] != '\0' ? folder : "/tmp");
    const int descriptor = mkstemp(path);
    FILE *file = descriptor < 0 ? NULL : fdopen(descriptor, "w");
    if (file == NULL) return qp_fail(err, QP_SYSTEM, "%s: %s", path, strerror(errno));
    et_write_json(run, file);
    const bool written = ferror(file) == 0;
    qp_status status = QP_OK;
    if (fclose(file) != 0 || !written)
        status = qp_fail(err, QP_SYSTEM, "%s: cannot be written", path);
    else
        status = et_draw_chart(path, chart, err);
    unlink(path);
    return status;
}

static bool ends_in(const char *path, const char *extension) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, extension) == 0;
}

static qp_status report(et_run *run, qp_error *err) {
    const et_options *o = run->options;
    const bool json_to_stdout = o->json != NULL && strcmp(o->json, "-") == 0;
    qp_status status = QP_OK;
    et_mark_fronts(run);
    if (json_to_stdout)
        et_write_json(run, stdout);
    else
        et_print_table(run, stdout);
    if (o->json != NULL && !json_to_stdout) status = write_file(run, o->json, et_write_json, err);
    if (status == QP_OK && o->csv != NULL) status = write_file(run, o->csv, et_write_csv, err);
    if (status == QP_OK && o->chart != NULL) status = draw(run, o->json, o->chart, err);
    return status;
}

/* That results can be kept is found out before the run, not after it. */
static qp_status check_outputs(const et_options *o, qp_error *err) {
    const char *const files[] = {o->json, o->csv, o->chart};
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        if (files[i] == NULL || strcmp(files[i], "-") == 0) continue;
        qp_output output;
        qp_status status = qp_output_open(&output, files[i], err);
        if (status != QP_OK) return status;
        qp_output_abandon(&output);
    }
    return o->chart != NULL ? et_draw_chart(NULL, o->chart, err) : QP_OK;
}

static qp_status run_error_time(int argc, char **argv, qp_error *err) {
    et_options o = {
        .samples = 64, .repeats = 7, .max_level = ET_MOST_LEVEL, .memory_mb = 4096, .setup_limit_ms = 5000};
    int clock = 0;
    const cli_option options[] = {
        {"--samples", "N", "in each patch (default 64)", CLI_COUNT, &o.samples, 1, 65536, NULL},
        {"--seed", "N", "of the samples (default 0)", CLI_COUNT, &o.seed, 0, 18446744073709551615.0, NULL},
        {"--repeats", "R", "rounds over all configurations; times are medians (default 7)", CLI_COUNT,
         &o.repeats, 1, ET_MOST_REPEATS, NULL},
        {"--max-level", "L", "deepest plans, and the peers' highest level (default 10)", CLI_COUNT,
         &o.max_level, 1, ET_MOST_LEVEL, NULL},
        {"--peers", "LIST", "of osd-cpu, osd-omp, far-double, bfr, embree ...: a,b; or none (default all)",
         CLI_TEXT, &o.peers, 0, 0, NULL},
        {"--threads", "T", "of everybody that uses several (default: all processors)", CLI_COUNT, &o.threads,
         1, 64, NULL},
        {"--clock", "wall|processor",
         "processor: of all threads, which other programs disturb less (default wall)", CLI_CHOICE, &clock, 0,
         0, NULL},
        {"--device", "D", "host, P.D, or part of a name, as `quadplan devices` lists them", CLI_TEXT,
         &o.device, 0, 0, NULL},
        {"--memory", "MB", "of configurations that stay set up between rounds (default 4096)", CLI_COUNT,
         &o.memory_mb, 1, 1048576, NULL},
        {"--setup-limit", "MS", "a peer's levels end with the one whose set-up takes longer (default 5000)",
         CLI_REAL, &o.setup_limit_ms, 0, 1e9, NULL},
        {"--json", "FILE|-", "all numbers as JSON; -: to standard output, instead of the table", CLI_TEXT,
         &o.json, 0, 0, NULL},
        {"--csv", "FILE", "all numbers, a line a configuration", CLI_TEXT, &o.csv, 0, 0, NULL},
        {"--chart", "FILE.png|.svg", "draw time against error (needs python3 and matplotlib)", CLI_TEXT,
         &o.chart, 0, 0, NULL},
        CLI_MESH_OPTIONS(o.mesh),
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_error_time, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    if (o.chart != NULL && !ends_in(o.chart, ".png") && !ends_in(o.chart, ".svg"))
        return qp_fail(err, QP_BAD_INPUT, "%s: a chart must be named .png or .svg", o.chart);
    o.processor_time = clock == 1;
    status = check_outputs(&o, err);
    if (status != QP_OK) return status;
    et_run *run = qp_alloc(1, sizeof *run, true);
    if (run == NULL) return qp_fail_memory(err, sizeof *run, "the benchmark");
    status = et_measure(run, arguments.values[0], &o, err);
    if (status == QP_OK) status = report(run, err);
    et_free(run);
    free(run);
    return status;
}

const cli_command cli_error_time = {
    "bench error-time", "MESH",
    "Time a sample against error: every configuration of quadplan, and its peers.",
    CLI_MESH_HELP "\nAll evaluate position and normal (peers: both derivatives) at the same points off any "
                  "grid, in turns. A frame is\n"
                  "everything that follows from new positions; set-up and the search for the samples' "
                  "patches are timed apart. Peers\n"
                  "are OpenSubdiv (Osd's CPU and OpenMP evaluators, Far in double, each with three end caps; "
                  "Bfr) and Embree, in float\n"
                  "unless named double. Embree keeps what it made of a patch until the positions move: "
                  "embree-n-moved moves them for\n"
                  "each frame, as everybody else does, the others do not.",
    run_error_time};
