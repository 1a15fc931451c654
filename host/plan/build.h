/* Building one plan: the adaptive quadtree over a patch and the stencils of its control points (sections 4
 * and 5). */
#ifndef QP_PLAN_BUILD_H
#define QP_PLAN_BUILD_H

#include "host/plan/local.h"
#include "host/plan/plan.h"

/* What a point is; kept beside the plan for `info`, which tells distinct points of a mesh apart. */
enum { QP_POINT_REFINED, QP_POINT_LIMIT, QP_POINT_TANGENT, QP_POINT_MODE };

/* Final points of the points of a level, QP_NONE where there is none yet. */
typedef struct qp_final_table {
    uint32_t *of;
    size_t capacity;
    uint32_t size;
} qp_final_table;

/* Scratch of one worker, reused from plan to plan. Zero-initialise. */
typedef struct qp_builder {
    qp_local local;
    qp_local tail; /* of the terminal chain at hand */
    uint32_t depth;
    bool crease_nodes, terminal_nodes;
    uint32_t base; /* level of the patch: 0 for a quad, 1 for an n-gon's child */
    double *rows;  /* final points, [count * width] */
    size_t row_capacity;
    struct qp_final_point *points;
    size_t point_capacity;
    uint32_t point_count;
    qp_final_table absolute[2], offsets[2]; /* of level k & 1 */
    double *corner_rows;                    /* [4 * width] limits of the patch's corners that are known */
    size_t corner_capacity;
    bool corner_known[4];
    uint32_t corner_final[4]; /* those as final points, or QP_NONE */
    uint32_t *tree;
    size_t tree_capacity;
    uint32_t tree_words, node_count;
    double *constants;
    size_t constant_capacity;
    uint32_t constant_count;
    struct qp_item *items[2]; /* cells of level k & 1 that are yet to be placed */
    size_t item_capacity[2];
    uint32_t item_count[2];
    struct qp_chain *chains;
    size_t chain_capacity;
    uint32_t chain_count;
    uint32_t flags;
    bool too_large; /* more points than 16 bits number: build again less deep */
    bool failed;    /* memory is out */
} qp_builder;
void qp_builder_free(qp_builder *builder);

/* Builds the plan of the cell that qp_gather_cell left in builder->local (level 0; of an n-gon, the child at
 * corner 0). The plan is malloced. NULL and builder->failed when memory is out; NULL and builder->too_large as above. */
qp_plan *qp_build_plan(qp_builder *builder, const qp_cell *cell, bool child);

void qp_plan_free(qp_plan *plan);

/* Places in a 4x4 grid of control points, row-major from (-1,-1): of corner i of the cell, of the two points beyond its
 * edge i, and of the point beyond corner i. */
static const uint8_t qp_grid_inner[4] = {5, 6, 10, 9}, qp_grid_beyond_a[4] = {1, 7, 14, 8},
                     qp_grid_beyond_b[4] = {2, 11, 13, 4}, qp_grid_outer[4] = {0, 3, 15, 12};

/* nodes.c: what kind of leaf a cell is. */
bool qp_cell_is_regular(const qp_cell *cell);
/* Corner that the single semi-sharp crease edge starts at, or -1. */
int qp_cell_crease_edge(const qp_cell *cell);
/* The 16 points of a regular or crease cell in the frame turned by `rotation`; phantom points across
 * infinitely sharp edges are made where they are missing. */
void qp_cell_points(qp_local *local, qp_level *level, const qp_cell *cell, uint32_t rotation,
                    uint32_t points[16]);
/* The QP_CREASE_REALS constants of plan_layout.h for sharpness s. */
void qp_crease_constants(float s, double *constants);

#endif
