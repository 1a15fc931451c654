/* quadplan gen: procedural meshes. */
#include "host/cli/cli.h"

#include <inttypes.h>
#include <string.h>

static qp_status run(int argc, char **argv, qp_error *err) {
    qp_generate_options generate = {.sharpness = -1};
    const char *path = NULL;
    cli_sizes sizes = {0};
    uint64_t faces = 0;
    bool json = false;
    const cli_option options[] = {
        {"-o", "FILE.obj", "where to write the mesh", CLI_TEXT, &path, 0, 0, NULL},
        {"--n", "AxBxC", "resolution; its meaning depends on the kind", CLI_SIZES, &sizes, 0, 0, NULL},
        {"--sharpness", "S", "of the creases, where the kind has some; 10 is infinite", CLI_REAL,
         &generate.sharpness, 0, 10, NULL},
        {"--seed", "N", "of the random kinds (default 0)", CLI_COUNT, &generate.seed, 0,
         18446744073709551615.0, NULL},
        {"--faces", "N", "most faces of the random kinds (default 200)", CLI_COUNT, &faces, 1, 2147483648.0,
         NULL},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_gen, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    if (path == NULL) return qp_fail(err, QP_BAD_INPUT, "gen needs -o FILE.obj");
    memcpy(generate.n, sizes.n, sizeof generate.n);
    generate.faces = (uint32_t)faces;

    qp_mesh *mesh = NULL;
    status = qp_mesh_generate(arguments.values[0], &generate, &mesh, err);
    if (status == QP_OK) status = qp_mesh_write_obj(mesh, path, err);
    if (status == QP_OK && json) {
        qp_json out;
        qp_json_begin(&out, stdout);
        qp_json_text(&out, "file", path);
        qp_json_text(&out, "kind", arguments.values[0]);
        qp_json_integer(&out, "vertices", mesh->n_vertices);
        qp_json_integer(&out, "edges", mesh->n_edges);
        qp_json_integer(&out, "faces", mesh->n_faces);
        qp_json_integer(&out, "patches", mesh->n_patches);
        qp_json_finish(&out);
    } else if (status == QP_OK) {
        printf("%s: %" PRIu32 " vertices, %" PRIu32 " faces\n", path, mesh->n_vertices, mesh->n_faces);
    }
    qp_mesh_free(mesh);
    return status;
}

const cli_command cli_gen = {
    "gen", "KIND", "Writes a procedural mesh as an OBJ file.",
    "KIND is cube, torus, creased-torus, cubes (the paper's 12 x 12 x 10 grid), fan (n: valence), prism (n: "
    "sides),\n"
    "terrain (scattered extraordinary vertices), irregular (a torus of AxB cells of 6 quads, none of them regular),\n"
    "random-closed or random-open (random tags, from a seed).",
    run};
