/* What `eval` and `error` share: a mesh, its surface, a device and a frame, from common options. */
#ifndef QP_CLI_EVALUATION_H
#define QP_CLI_EVALUATION_H

#include "host/cli/supports.h"

typedef struct cli_evaluation_options {
    cli_mesh_options mesh;
    double tess, tolerance; /* tolerance 0: none */
    bool tess_given;
    int spacing, precision; /* indices into CLI_SPACINGS, CLI_PRECISIONS, which are the API's values */
    uint64_t depth;         /* 0: the library's default */
    const char *device;     /* NULL: the library's default */
    bool no_regular_pass, no_sharing, no_exact_tail;
    bool derivatives, no_triangles; /* set by the subcommand */
    cli_supports_options supports;
} cli_evaluation_options;

#define CLI_EVALUATION_DEFAULTS                                                                              \
    { .tess = 16, .supports = CLI_SUPPORTS_DEFAULTS }
/* clang-format off */
#define CLI_EVALUATION_OPTIONS(o)                                                                            \
    {"--tess", "F", "uniform tessellation factor, 1 to 64 (default 16)",                                     \
     CLI_REAL, &(o).tess, 1, 64, &(o).tess_given},                                                           \
    {"--tolerance", "T", "instead, the least factors that err by no more than T times the bounding box's diagonal",        \
     CLI_REAL, &(o).tolerance, 1e-300, 1e300, NULL},                                                                      \
    {"--spacing", CLI_SPACINGS, "of the tessellator (default equal)",                                        \
     CLI_CHOICE, &(o).spacing, 0, 0, NULL},                                                                  \
    CLI_SAMPLING_OPTIONS(o)
/* Those that any sampling takes. */
#define CLI_SAMPLING_OPTIONS(o)                                                                              \
    {"--precision", CLI_PRECISIONS, "of stencils and kernels (default float)",                               \
     CLI_CHOICE, &(o).precision, 0, 0, NULL},                                                                \
    {"--depth", "N", "deepest subdivision level of the plans, 1 to 60 (default 10)",                         \
     CLI_COUNT, &(o).depth, 1, QP_DEPTH_LIMIT, NULL},                                                                    \
    {"--device", "D", "host, P.D, or part of a name, as `quadplan devices` lists them",                      \
     CLI_TEXT, &(o).device, 0, 0, NULL},                                                                     \
    {"--no-exact-tail", NULL, "approximate below the plans' depth, and flag it, for comparison",             \
     CLI_FLAG, &(o).no_exact_tail, 0, 0, NULL},                                                              \
    {"--no-sharing", NULL, "every patch evaluates its own edges, for comparison",                            \
     CLI_FLAG, &(o).no_sharing, 0, 0, NULL},                                                                 \
    {"--no-regular-pass", NULL, "evaluate regular patches by the general kernels, for comparison",           \
     CLI_FLAG, &(o).no_regular_pass, 0, 0, NULL},                                                            \
    CLI_SUPPORTS_OPTIONS((o).supports),                                                                      \
    CLI_MESH_OPTIONS((o).mesh)
/* clang-format on */

typedef struct cli_evaluation {
    qp_mesh *mesh;
    qp_surface *surface;
    qp_device *device;
    qp_frame *frame;
} cli_evaluation;

/* Frees what it made when it fails. want_triangles: triangles and the stream's hash too. */
qp_status cli_evaluation_open(const char *argument, const cli_evaluation_options *options,
                              bool want_triangles, cli_evaluation *evaluation, qp_error *err);
/* Of --tess, --spacing and --tolerance; with a tolerance --tess, when given, is the largest factor allowed. */
qp_tessellation cli_evaluation_tessellation(const cli_evaluation_options *options);
void cli_evaluation_close(cli_evaluation *evaluation);

#endif
