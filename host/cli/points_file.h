/* Points to sample. */
#ifndef QP_CLI_POINTS_FILE_H
#define QP_CLI_POINTS_FILE_H

#include "host/cli/cli.h"

/* Zero-initialise; free with cli_points_free. */
typedef struct cli_points {
    size_t count;
    uint32_t *patch; /* [count] */
    double *uv;      /* [2 * count] */
    size_t patch_capacity, uv_capacity;
} cli_points;
void cli_points_free(cli_points *points);

qp_status cli_points_add(cli_points *points, uint32_t patch, double u, double v, qp_error *err);

/* "U,V" and nothing else; the range is left to the evaluation. */
bool cli_uv_read(const char *text, const char *end, double uv[2]);

/* Appends the points of a file, or of standard input for "-": a line "patch,u,v" each; empty lines, lines that start with # and a
 * first line that names the columns are passed over. QP_BAD_INPUT names file and line. */
qp_status cli_points_read(const char *path, cli_points *points, qp_error *err);

#endif
