#define _GNU_SOURCE
#include "host/cli/report.h"
#include "host/base/embedded.h"
#include "host/base/output.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- Charts ---- */

/* Exit codes of the script, beside its own. */
enum { NO_MATPLOTLIB = 4, NO_PYTHON = 127 };

static const char *script_text(const char *name) {
    const qp_embedded *script = qp_embedded_scripts;
    while (script->name != NULL && strcmp(script->name, name) != 0) ++script;
    return (const char *)script->bytes;
}

/* Runs the script; its exit code. */
static int run_script(const char *python, const char *script, const char *json_path, const char *chart_path) {
    const pid_t child = fork();
    if (child == 0) {
        execlp(python, python, "-c", script_text(script), json_path != NULL ? json_path : "--check",
               chart_path, (char *)NULL);
        _exit(NO_PYTHON);
    }
    int state;
    while (child < 0 || waitpid(child, &state, 0) < 0)
        if (child < 0 || errno != EINTR) return -1;
    return WIFEXITED(state) ? WEXITSTATUS(state) : -1;
}

/* Calls the script on a JSON file; without one it only finds out whether it could. */
static qp_status draw_file(const cli_report *report, const char *json_path, qp_error *err) {
    int code = run_script("python3", report->script, json_path, report->chart);
    /* The system's packages belong to the system's python3, which need not be the first one of the path. */
    if (code == NO_MATPLOTLIB)
        code = run_script("/usr/bin/python3", report->script, json_path, report->chart);
    if (code == 0) return QP_OK;
    if (code == NO_PYTHON)
        return qp_fail(err, QP_SYSTEM, "%s: charts are drawn by python3, which is missing", report->chart);
    if (code == NO_MATPLOTLIB)
        return qp_fail(err, QP_SYSTEM,
                       "%s: charts are drawn by matplotlib, which is missing (Debian: python3-matplotlib)",
                       report->chart);
    return qp_fail(err, QP_SYSTEM, "%s: the chart could not be drawn", report->chart);
}

/* From the JSON file that was asked for, or from one that is removed again. */
static qp_status draw(const cli_report *report, const void *result, qp_error *err) {
    if (report->json != NULL && strcmp(report->json, "-") != 0) return draw_file(report, report->json, err);
    const char *folder = getenv("TMPDIR");
    char path[4096];
    snprintf(path, sizeof path, "%s/quadplan-XXXXXX", folder != NULL && folder[0] != '\0' ? folder : "/tmp");
    const int descriptor = mkstemp(path);
    FILE *file = descriptor < 0 ? NULL : fdopen(descriptor, "w");
    if (file == NULL) return qp_fail(err, QP_SYSTEM, "%s: %s", path, strerror(errno));
    report->write_json(result, file);
    const bool written = ferror(file) == 0;
    qp_status status = QP_OK;
    if (fclose(file) != 0 || !written)
        status = qp_fail(err, QP_SYSTEM, "%s: cannot be written", path);
    else
        status = draw_file(report, path, err);
    unlink(path);
    return status;
}

static bool ends_in(const char *path, const char *extension) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, extension) == 0;
}

/* ---- Files ---- */

static qp_status write_file(const void *result, const char *path, cli_writer *write, qp_error *err) {
    qp_output output;
    qp_status status = qp_output_open(&output, path, err);
    if (status != QP_OK) return status;
    write(result, output.file);
    return qp_output_commit(&output, err);
}

qp_status cli_report_check(const cli_report *report, qp_error *err) {
    const char *const files[] = {report->json, report->csv, report->chart};
    if (report->chart != NULL && !ends_in(report->chart, ".png") && !ends_in(report->chart, ".svg"))
        return qp_fail(err, QP_BAD_INPUT, "%s: a chart must be named .png or .svg", report->chart);
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        if (files[i] == NULL || strcmp(files[i], "-") == 0) continue;
        qp_output output;
        qp_status status = qp_output_open(&output, files[i], err);
        if (status != QP_OK) return status;
        qp_output_abandon(&output);
    }
    return report->chart != NULL ? draw_file(report, NULL, err) : QP_OK;
}

qp_status cli_report_write(const cli_report *report, const void *result, qp_error *err) {
    const bool json_to_stdout = report->json != NULL && strcmp(report->json, "-") == 0;
    qp_status status = QP_OK;
    if (json_to_stdout)
        report->write_json(result, stdout);
    else
        report->write_table(result, stdout);
    if (report->json != NULL && !json_to_stdout)
        status = write_file(result, report->json, report->write_json, err);
    if (status == QP_OK && report->csv != NULL)
        status = write_file(result, report->csv, report->write_csv, err);
    if (status == QP_OK && report->chart != NULL) status = draw(report, result, err);
    return status;
}
