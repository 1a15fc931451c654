/* quadplan bench error-time: run time against error, of every configuration and of the peers. */
#include "host/cli/error_time.h"
#include "host/cli/report.h"

#include <stdlib.h>

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
    o.processor_time = clock == 1;
    const cli_report report = {o.json,         o.csv,         o.chart,     "plot_error_time.py",
                               et_print_table, et_write_json, et_write_csv};
    status = cli_report_check(&report, err);
    if (status != QP_OK) return status;
    et_run *run = qp_alloc(1, sizeof *run, true);
    if (run == NULL) return qp_fail_memory(err, sizeof *run, "the benchmark");
    status = et_measure(run, arguments.values[0], &o, err);
    if (status == QP_OK) {
        et_mark_fronts(run);
        status = cli_report_write(&report, run, err);
    }
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
