/* quadplan bench NAME: the benchmarks that the program has. */
#include "host/cli/cli.h"

#include <string.h>

static const cli_command *const benchmarks[] = {&cli_error_time};
enum { N_BENCHMARKS = sizeof benchmarks / sizeof benchmarks[0] };

/* "error-time" of "bench error-time" */
static const char *own_name(const cli_command *benchmark) {
    return strchr(benchmark->name, ' ') + 1;
}

static qp_status run(int argc, char **argv, qp_error *err) {
    if (argc < 2) return qp_fail(err, QP_BAD_INPUT, "no benchmark; see `quadplan bench --help`");
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        printf("usage: quadplan bench NAME ...\n%s\n\n", cli_bench.summary);
        for (int i = 0; i < N_BENCHMARKS; ++i)
            printf("  %-12s %s\n", own_name(benchmarks[i]), benchmarks[i]->summary);
        printf("\n`quadplan bench NAME --help` explains each.\n");
        return QP_OK;
    }
    for (int i = 0; i < N_BENCHMARKS; ++i) {
        if (strcmp(argv[1], own_name(benchmarks[i])) == 0) return benchmarks[i]->run(argc - 1, argv + 1, err);
    }
    return qp_fail(err, QP_BAD_INPUT, "unknown benchmark '%s'; see `quadplan bench --help`", argv[1]);
}

const cli_command cli_bench = {"bench", "NAME", "Benchmarks: run time against error, beside other libraries.",
                               NULL, run};
