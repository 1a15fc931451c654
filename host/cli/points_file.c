#define _POSIX_C_SOURCE 200809L /* getline */
/* Points to sample, from a file of "patch,u,v" lines. */
#include "host/cli/points_file.h"
#include "host/base/number.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

void cli_points_free(cli_points *points) {
    free(points->patch);
    free(points->uv);
    *points = (cli_points){0};
}

qp_status cli_points_add(cli_points *points, uint32_t patch, double u, double v, qp_error *err) {
    if (!qp_grow((void **)&points->patch, &points->patch_capacity, points->count + 1,
                 sizeof *points->patch) ||
        !qp_grow((void **)&points->uv, &points->uv_capacity, 2 * (points->count + 1), sizeof *points->uv))
        return qp_fail_memory(err, (points->count + 1) * 20, "points");
    points->patch[points->count] = patch;
    points->uv[2 * points->count] = u;
    points->uv[2 * points->count + 1] = v;
    ++points->count;
    return QP_OK;
}

static const char *skip_blanks(const char *at, const char *end) {
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
    return at;
}

/* Past a comma and the blanks around it; NULL where there is none. */
static const char *skip_comma(const char *at, const char *end) {
    at = skip_blanks(at, end);
    return at < end && *at == ',' ? skip_blanks(at + 1, end) : NULL;
}

bool cli_uv_read(const char *text, const char *end, double uv[2]) {
    const char *at = qp_read_double(text, end, &uv[0]);
    if (at != NULL) at = skip_comma(at, end);
    if (at != NULL) at = qp_read_double(at, end, &uv[1]);
    return at != NULL && skip_blanks(at, end) == end;
}

static bool read_point(const char *at, const char *end, int64_t *patch, double uv[2]) {
    at = qp_read_int64(at, end, patch);
    if (at != NULL) at = skip_comma(at, end);
    return at != NULL && *patch >= 0 && *patch < (int64_t)UINT32_MAX && cli_uv_read(at, end, uv);
}

static qp_status add_line(cli_points *points, const char *path, size_t number, const char *line,
                          size_t length, qp_error *err) {
    const char *end = line + length, *at = skip_blanks(line, end);
    while (end > at && (end[-1] == '\n' || end[-1] == '\r' || end[-1] == ' ' || end[-1] == '\t')) --end;
    if (at == end || *at == '#') return QP_OK;
    static const char header[] = "patch,u,v";
    if (number == 1 && (size_t)(end - at) == sizeof header - 1 && memcmp(at, header, sizeof header - 1) == 0)
        return QP_OK;
    int64_t patch;
    double uv[2];
    if (!read_point(at, end, &patch, uv))
        return qp_fail(err, QP_BAD_INPUT, "%s:%zu: '%.*s' is no point \"patch,u,v\"", path, number,
                       end - at > 60 ? 60 : (int)(end - at), at);
    return cli_points_add(points, (uint32_t)patch, uv[0], uv[1], err);
}

qp_status cli_points_read(const char *path, cli_points *points, qp_error *err) {
    const bool from_stdin = strcmp(path, "-") == 0;
    FILE *file = from_stdin ? stdin : fopen(path, "rb");
    if (file == NULL) return qp_fail(err, QP_BAD_INPUT, "%s: %s", path, strerror(errno));
    char *line = NULL;
    size_t capacity = 0, number = 0;
    qp_status status = QP_OK;
    errno = 0;
    for (ssize_t length; status == QP_OK && (length = getline(&line, &capacity, file)) >= 0;)
        status = add_line(points, path, ++number, line, (size_t)length, err);
    if (status == QP_OK && !feof(file))
        status =
            qp_fail(err, QP_SYSTEM, "%s: %s", path, errno != 0 ? strerror(errno) : "error while reading");
    free(line);
    if (!from_stdin) fclose(file);
    return status;
}
