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

/* The options given on the command line over a mesh that has been generated: they are part of its analysis,
 * so it is made anew from its own arrays. */
static qp_status apply_options(qp_mesh **mesh, const qp_mesh_options *options, qp_error *err) {
    const qp_mesh *m = *mesh;
    uint32_t *sizes = qp_alloc(m->n_faces, sizeof *sizes, false);
    if (sizes == NULL) return qp_fail_memory(err, m->n_faces * sizeof *sizes, "face sizes");
    for (uint32_t f = 0; f < m->n_faces; ++f) sizes[f] = qp_face_size(m, f);
    qp_mesh_desc desc = {
        .n_vertices = m->n_vertices,
        .n_faces = m->n_faces,
        .positions = m->positions,
        .face_sizes = sizes,
        .face_vertices = m->face_vertices,
        .n_creases = m->n_creases,
        .crease_vertices = m->crease_vertices,
        .crease_sharpness = m->crease_sharpness,
        .n_corners = m->n_corner_tags,
        .corner_vertices = m->corner_tag_vertices,
        .corner_sharpness = m->corner_tag_sharpness,
        .n_holes = m->n_hole_tags,
        .hole_faces = m->hole_tag_faces,
        .boundary = options->override_boundary ? options->boundary : m->boundary,
        .crease_method = options->override_crease_method ? options->crease_method : m->crease_method,
        .triangle_rule = options->override_triangle_rule ? options->triangle_rule : m->triangle_rule,
    };
    qp_mesh *remade = NULL;
    qp_status status = qp_mesh_create(&desc, &remade, err);
    free(sizes);
    if (status != QP_OK) return status;
    qp_mesh_free(*mesh);
    *mesh = remade;
    return QP_OK;
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
    if (status == QP_OK && (options->boundary_given || options->creases_given || options->triangles_given))
        status = apply_options(mesh, &mesh_options, err);
    if (status != QP_OK) {
        qp_mesh_free(*mesh);
        *mesh = NULL;
    }
    return status;
}
