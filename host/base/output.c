#define _GNU_SOURCE
#include "host/base/output.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A name beside path; free() it. NULL when memory is out. */
static char *temporary_name(const char *path) {
    const char *slash = strrchr(path, '/');
    const char *name = slash != NULL ? slash + 1 : path;
    size_t size = strlen(path) + 40;
    char *text = qp_alloc(size, 1, false);
    /* The process id keeps two runs apart. */
    if (text != NULL) snprintf(text, size, "%.*s.%ld~%s", (int)(name - path), path, (long)getpid(), name);
    return text;
}

static void output_free(qp_output *output) {
    free(output->path);
    free(output->temporary);
    *output = (qp_output){0};
}

/* A device or a pipe is written as it is: renaming would put a file in its place. */
static bool written_in_place(const char *path) {
    struct stat about;
    return stat(path, &about) == 0 && !S_ISREG(about.st_mode);
}

qp_status qp_output_open(qp_output *output, const char *path, qp_error *err) {
    *output = (qp_output){.path = strdup(path), .temporary = temporary_name(path)};
    if (output->path == NULL || output->temporary == NULL) {
        output_free(output);
        return qp_fail_memory(err, strlen(path), "a file name");
    }
    if (written_in_place(path)) {
        free(output->temporary);
        output->temporary = NULL;
    }
    output->file = fopen(output->temporary != NULL ? output->temporary : path, "wb");
    if (output->file == NULL) {
        int reason = errno;
        output_free(output);
        return qp_fail(err, QP_SYSTEM, "%s: cannot be written: %s", path, strerror(reason));
    }
    return QP_OK;
}

qp_status qp_output_commit(qp_output *output, qp_error *err) {
    errno = 0;
    bool good = ferror(output->file) == 0;
    good = fclose(output->file) == 0 && good;
    if (output->temporary != NULL) good = good && rename(output->temporary, output->path) == 0;
    qp_status status = QP_OK;
    if (!good) {
        const char *reason = errno != 0 ? strerror(errno) : "write error";
        status = qp_fail(err, QP_SYSTEM, "%s: cannot be written: %s", output->path, reason);
        if (output->temporary != NULL) unlink(output->temporary);
    }
    output_free(output);
    return status;
}

void qp_output_abandon(qp_output *output) {
    if (output->file == NULL) return;
    fclose(output->file);
    if (output->temporary != NULL) unlink(output->temporary);
    output_free(output);
}
