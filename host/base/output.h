/* Files that appear whole or not at all: written beside their place, then renamed into it (but a device or a
 * pipe is written as it is). */
#ifndef QP_BASE_OUTPUT_H
#define QP_BASE_OUTPUT_H

#include "host/base/status.h"

#include <stdio.h>

typedef struct qp_output {
    FILE *file;
    char *path;
    char *temporary; /* in the same folder; NULL when written in place */
} qp_output;

/* Opens the temporary file. QP_SYSTEM, naming path, when it cannot be made. */
qp_status qp_output_open(qp_output *output, const char *path, qp_error *err);
/* Closes it and renames it into place; on failure (a full disk) nothing is left behind. Frees *output. */
qp_status qp_output_commit(qp_output *output, qp_error *err);
/* Removes the temporary file instead. Frees *output. */
void qp_output_abandon(qp_output *output);

#endif
