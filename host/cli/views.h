/* What is looked at, and how finely: a mesh at one factor, or a scene's geometry in the view of the scene and those of its passes. */
#ifndef QP_CLI_VIEWS_H
#define QP_CLI_VIEWS_H

#include "host/cli/cli.h"
#include "host/scene/scene.h"

typedef struct cli_view {
    const char *name; /* of a scene's pass, or NULL */
    double factor;    /* as asked for; 0: chosen within a tolerance, or at random */
    qp_tessellation tessellation;
    float *factors; /* that it points to, or NULL */
} cli_view;

typedef struct cli_views_options {
    cli_mesh_options mesh; /* of a mesh; with a scene, which has its own, they are refused */
    double tess, tolerance;
    bool tess_given, spacing_given;
    int spacing;
    uint64_t depth; /* 0: the scene's or the library's */
} cli_views_options;

#define CLI_VIEWS_DEFAULTS                                                                                   \
    { .tess = 16 }
/* clang-format off */
#define CLI_VIEWS_OPTIONS(o)                                                                                 \
    {"--tess", "F", "tessellation factor, 1 to 64 (default 16; of a scene: its own)",                        \
     CLI_REAL, &(o).tess, 1, 64, &(o).tess_given},                                                           \
    {"--tolerance", "T", "instead, the least factors that err by no more than T times the bounding box's diagonal", \
     CLI_REAL, &(o).tolerance, 1e-300, 1e300, NULL},                                                         \
    {"--spacing", CLI_SPACINGS, "of the tessellator (default equal)",                                        \
     CLI_CHOICE, &(o).spacing, 0, 0, &(o).spacing_given},                                                    \
    {"--depth", "N", "deepest subdivision level of the plans, 1 to 60 (default 10)",                         \
     CLI_COUNT, &(o).depth, 1, QP_DEPTH_LIMIT, NULL},                                                        \
    CLI_MESH_OPTIONS((o).mesh)
/* clang-format on */

typedef struct cli_views {
    qp_scene *scene; /* or NULL */
    qp_mesh *mesh;
    qp_surface *surface;
    size_t count;
    cli_view *list; /* [count], at least one */
} cli_views;

/* argument: a scene file where it ends in .json, else a mesh. What the options say goes before what the scene and its passes do. Frees what it
 * made when it fails. */
qp_status cli_views_open(const char *argument, const cli_views_options *options, cli_views *views,
                         qp_error *err);
void cli_views_close(cli_views *views);
#define CLI_VIEWS_HELP CLI_MESH_HELP "\nSCENE is a scene file (.json)."

/* "64K..32M" doubles from 64K to 32M, "1M" is one size, and commas join both. *sizes is malloced, each size once, increasing; all are at
 * least 1. Errors: QP_BAD_INPUT, naming the option. */
qp_status cli_size_list_read(const char *option, const char *text, uint64_t **sizes, size_t *count,
                             qp_error *err);

#endif
