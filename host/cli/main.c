/* quadplan SUBCOMMAND ...: dispatch, and the one place where errors become a line and an exit code. */
#include "host/cli/cli.h"

#include <errno.h>
#include <string.h>

static const cli_command *const commands[] = {&cli_info,       &cli_gen,    &cli_eval,    &cli_error,
                                              &cli_watertight, &cli_sample, &cli_stress,  &cli_render,
                                              &cli_ring,       &cli_cache,  &cli_devices, &cli_bench};
enum { N_COMMANDS = sizeof commands / sizeof commands[0] };

static void usage(FILE *file) {
    fputs("usage: quadplan SUBCOMMAND ...\n"
          "Exact evaluation of Catmull-Clark subdivision surfaces by adaptive quadtrees.\n\n",
          file);
    for (int i = 0; i < N_COMMANDS; ++i)
        fprintf(file, "  %-10s %s\n", commands[i]->name, commands[i]->summary);
    fputs("\n`quadplan SUBCOMMAND --help` explains each; `quadplan --version` prints the version.\n"
          "Exit: 0 good, 1 a check failed, 2 wrong usage or input, 3 device or system.\n",
          file);
}

static qp_status dispatch(int argc, char **argv, qp_error *err) {
    if (argc < 2) return qp_fail(err, QP_BAD_INPUT, "no subcommand; see `quadplan --help`");
    const char *name = argv[1];
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        usage(stdout);
        return QP_OK;
    }
    if (strcmp(name, "--version") == 0) {
        printf("quadplan %d.%d.%d\n", QP_VERSION_MAJOR, QP_VERSION_MINOR, QP_VERSION_PATCH);
        return QP_OK;
    }
    for (int i = 0; i < N_COMMANDS; ++i) {
        if (strcmp(name, commands[i]->name) == 0) return commands[i]->run(argc - 1, argv + 1, err);
    }
    return qp_fail(err, QP_BAD_INPUT, "unknown subcommand '%s'; see `quadplan --help`", name);
}

int main(int argc, char **argv) {
    qp_error err = {0};
    qp_status status = dispatch(argc, argv, &err);
    /* Output that did not get through (a full disk, a closed pipe) is an error too. */
    errno = 0;
    if ((fflush(stdout) != 0 || ferror(stdout) != 0) && status == QP_OK) {
        status =
            qp_fail(&err, QP_SYSTEM, "standard output: %s", errno != 0 ? strerror(errno) : "write error");
    }
    if (status != QP_OK) fprintf(stderr, "quadplan: %s\n", err.message);
    return (int)status;
}
