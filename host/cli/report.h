/* What a measuring subcommand leaves: a table on standard output or JSON in its place, and files of JSON and CSV and a chart. */
#ifndef QP_CLI_REPORT_H
#define QP_CLI_REPORT_H

#include "host/base/status.h"

#include <stdio.h>

typedef void cli_writer(const void *result, FILE *file);

typedef struct cli_report {
    const char
        *json;       /* FILE, or "-": to standard output, in place of the table; NULL: none; likewise below */
    const char *csv; /* FILE */
    const char *chart;  /* FILE.png or FILE.svg */
    const char *script; /* of bench/, built into the program, that draws the chart from the JSON */
    cli_writer *write_table, *write_json, *write_csv;
} cli_report;

/* Before the measurement: that its results can be kept. Errors: QP_BAD_INPUT for a chart that is named neither .png nor .svg; QP_SYSTEM
 * for a file that cannot be written and where python3 or matplotlib is missing. */
qp_status cli_report_check(const cli_report *report, qp_error *err);
qp_status cli_report_write(const cli_report *report, const void *result, qp_error *err);

#endif
