/* quadplan info: what the plans of a mesh hold. */
#include "host/cli/cli.h"

#include <inttypes.h>

static void print_levels(qp_json *json, const char *key, const uint64_t *values) {
    qp_json_open_array(json, key);
    for (int i = 0; i < QP_INFO_LEVELS; ++i) qp_json_integer(json, NULL, values[i]);
    qp_json_close(json);
}

static void print_json(const char *name, const qp_mesh *mesh, const qp_surface_info *i, uint64_t depth) {
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_text(&json, "mesh", name);
    qp_json_integer(&json, "depth", depth);
    qp_json_integer(&json, "vertices", i->vertices);
    qp_json_integer(&json, "edges", mesh->n_edges);
    qp_json_integer(&json, "faces", i->faces);
    qp_json_integer(&json, "patches", i->patches);
    qp_json_integer(&json, "regular_faces", i->regular_faces);
    qp_json_integer(&json, "irregular_faces", i->irregular_faces);
    qp_json_integer(&json, "irregular_patches", i->irregular_patches);
    qp_json_integer(&json, "plans", i->plans);
    qp_json_integer(&json, "nodes", i->nodes);
    qp_json_integer(&json, "stencils", i->stencils);
    qp_json_integer(&json, "quadtree_bytes", i->quadtree_bytes);
    qp_json_integer(&json, "stencil_bytes", i->stencil_bytes);
    print_levels(&json, "control_points", i->control_points);
    print_levels(&json, "unique_control_points", i->unique_control_points);
    qp_json_integer(&json, "scratch_bytes", i->scratch_bytes);
    qp_json_real(&json, "build_ms", i->build_ms);
    qp_json_finish(&json);
}

static void print_text(const char *name, const qp_surface_info *i, uint64_t depth) {
    printf("%s, plans to level %" PRIu64 "\n", name, depth);
    printf("  vertices            %12" PRIu64 "\n", i->vertices);
    printf("  faces               %12" PRIu64 "  (%" PRIu64 " regular, %" PRIu64 " irregular)\n", i->faces,
           i->regular_faces, i->irregular_faces);
    printf("  patches             %12" PRIu64 "  (%" PRIu64 " irregular)\n", i->patches,
           i->irregular_patches);
    printf("  plans               %12" PRIu64 "  built in %.2f ms\n", i->plans, i->build_ms);
    printf("  nodes               %12" PRIu64 "  %" PRIu64 " bytes\n", i->nodes, i->quadtree_bytes);
    printf("  stencils            %12" PRIu64 "  %" PRIu64 " bytes\n", i->stencils, i->stencil_bytes);
    printf("  scratch, worst case %12" PRIu64 "  bytes\n", i->scratch_bytes);
    printf("  control points of irregular patches\n    level        needed        unique\n");
    for (int l = 0; l < QP_INFO_LEVELS; ++l)
        printf("    %5d  %12" PRIu64 "  %12" PRIu64 "\n", l, i->control_points[l],
               i->unique_control_points[l]);
}

static qp_status run(int argc, char **argv, qp_error *err) {
    cli_mesh_options mesh_options = {0};
    uint64_t depth = 6;
    bool json = false, no_crease_nodes = false, no_terminal_nodes = false;
    const cli_option options[] = {
        {"--depth", "N", "deepest subdivision level of the plans, 1 to 60 (default 6, the paper's)",
         CLI_COUNT, &depth, 1, QP_DEPTH_LIMIT, NULL},
        {"--no-crease-nodes", NULL, "subdivide along single creases instead, for comparison", CLI_FLAG,
         &no_crease_nodes, 0, 0, NULL},
        {"--no-terminal-nodes", NULL, "internal nodes in place of terminal ones, for comparison", CLI_FLAG,
         &no_terminal_nodes, 0, 0, NULL},
        CLI_MESH_OPTIONS(mesh_options),
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_info, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;

    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_surface_info info;
    qp_surface_options surface_options = {
        .depth = (uint32_t)depth, .no_crease_nodes = no_crease_nodes, .no_terminal_nodes = no_terminal_nodes};
    status = cli_mesh_open(arguments.values[0], &mesh_options, &mesh, err);
    if (status == QP_OK) status = qp_surface_create(mesh, &surface_options, &surface, err);
    if (status == QP_OK) status = qp_surface_get_info(surface, &info, err);
    if (status == QP_OK) {
        if (json) {
            print_json(arguments.values[0], mesh, &info, depth);
        } else {
            print_text(arguments.values[0], &info, depth);
        }
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    return status;
}

const cli_command cli_info = {"info", "MESH", "What the subdivision plans of a mesh hold.", CLI_MESH_HELP,
                              run};
