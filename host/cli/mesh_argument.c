#define _GNU_SOURCE
#include "host/cli/cli.h"

#include <stdlib.h>
#include <string.h>

void cli_print_warning(void *context, const char *line) {
    (void)context;
    fprintf(stderr, "quadplan: warning: %s\n", line);
}

/* One "key=value" of a gen: argument. */
static bool read_setting(char *setting, qp_generate_options *options) {
    char *equals = strchr(setting, '=');
    if (equals == NULL) return false;
    *equals = '\0';
    const char *value = equals + 1;
    cli_sizes sizes;
    uint64_t n;
    switch (cli_choice("n|sharpness|seed|faces", setting)) {
    case 0:
        if (!cli_sizes_read(value, &sizes)) return false;
        memcpy(options->n, sizes.n, sizeof options->n);
        return true;
    case 1:
        return cli_real_read(value, &options->sharpness) && options->sharpness >= 0;
    case 2:
        return cli_count_read(value, &options->seed);
    case 3:
        if (!cli_count_read(value, &n) || n > 0x80000000u) return false;
        options->faces = (uint32_t)n;
        return true;
    default:
        return false;
    }
}

static qp_status generate(const char *specification, qp_mesh **mesh, qp_error *err) {
    char *text = strdup(specification);
    if (text == NULL) return qp_fail_memory(err, strlen(specification), "the mesh argument");
    qp_generate_options options = {.sharpness = -1};
    char *rest = strchr(text, ',');
    qp_status status = QP_OK;
    if (rest != NULL) *rest++ = '\0';
    while (rest != NULL && status == QP_OK) {
        char *setting = strsep(&rest, ",");
        char *copy = strdup(setting);
        if (copy == NULL) {
            status = qp_fail_memory(err, strlen(setting), "the mesh argument");
        } else if (!read_setting(setting, &options)) {
            status = qp_fail(err, QP_BAD_INPUT, "gen:%s: '%s' is not a setting", text, copy);
        }
        free(copy);
    }
    if (status == QP_OK) status = qp_mesh_generate(text, &options, mesh, err);
    free(text);
    return status;
}

qp_status cli_mesh_open(const char *argument, const cli_mesh_options *options, qp_mesh **mesh,
                        qp_error *err) {
    qp_mesh_options mesh_options = {
        .override_boundary = options->boundary_given,
        .boundary = (qp_boundary)options->boundary,
        .override_crease_method = options->creases_given,
        .crease_method = (qp_crease_method)options->creases,
        .override_triangle_rule = options->triangles_given,
        .triangle_rule = (qp_triangle_rule)options->triangles,
        .warn = cli_print_warning,
    };
    *mesh = NULL;
    if (strncmp(argument, "gen:", 4) != 0) return qp_mesh_read_obj(argument, &mesh_options, mesh, err);
    qp_status status = generate(argument + 4, mesh, err);
    if (status == QP_OK) status = qp_mesh_apply_options(mesh, &mesh_options, err);
    if (status != QP_OK) {
        qp_mesh_free(*mesh);
        *mesh = NULL;
    }
    return status;
}
