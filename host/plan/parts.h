/* What the parts of plan building share: points.c (final points and the level that needs them), chain.c (terminal nodes), mode.c (their slivers), build.c (the
 * quadtree), finish.c (sorting and numbering). Builders fail by setting builder->failed or too_large; what they return then is of
 * no use. */
#ifndef QP_PLAN_PARTS_H
#define QP_PLAN_PARTS_H

#include "host/plan/build.h"

/* Coordinates of the patch in units of 2^-62, so that cells of the deepest level still have two ends. */
#define QP_PLAN_ONE ((uint64_t)1 << 62)

typedef struct qp_final_point {
    uint8_t need;    /* first level that needs it */
    uint8_t kind;    /* QP_POINT_* | depth << 2 */
    uint16_t origin; /* point its row is an offset from, or QP_NO_POINT */
    uint8_t scale;   /* a device gets 2^scale times the row */
    uint16_t mode;   /* point of which the row holds `share` (mode.c), or QP_NO_POINT */
    double share;
} qp_final_point;

/* One dimension of a cell: [lo, hi], and whether a sample at either end comes here or goes on. */
typedef struct qp_span {
    uint64_t lo, hi;
    bool own_lo, own_hi;
} qp_span;

typedef struct qp_item {
    qp_cell *cell;
    qp_span u, v;
    uint32_t parent_word; /* tree word for this node's offset; QP_NONE: the root, or a chain's tail */
    uint32_t chain;       /* the terminal chain this cell ends or goes on with, or QP_NONE */
} qp_item;

/* Rings of the first two levels may overlap those of other corners of the patch, and are shared; deeper ones never do, and are
 * stored as offsets from their corner's limit point. */
#define QP_PLAN_SHARED_LEVELS 2u

/* Semi-sharp features have decayed by level 10, and what is irregular then are single vertices, which are terminal
 * nodes' corners; deeper internal nodes would double with every level. */
#define QP_PLAN_INTERNAL_LEVELS 12u

/* A terminal node in the making: its rings are known level by level. */
typedef struct qp_chain {
    uint32_t parent_word, corner, rings;
    uint32_t absolute_rings;             /* the first ones, whose points stay absolute */
    uint32_t offset_ring;                /* from this one on rows are offsets already */
    uint32_t start;                      /* level of the cell that its first ring is in, of the mesh */
    uint64_t corner_u, corner_v;         /* of the patch, in units of 1 / QP_PLAN_ONE */
    uint32_t points[QP_DEPTH_LIMIT][24]; /* final points */
} qp_chain;

/* points.c */
void *qp_plan_grown(qp_builder *b, void *block, size_t *capacity, size_t need, size_t size);
uint8_t qp_plan_cell_need(qp_span u, qp_span v);
uint8_t qp_plan_point_need(uint64_t u, uint64_t v);
qp_span qp_plan_half(qp_span s, bool upper, bool tie_low);
bool qp_plan_corner_high_u(uint32_t i);
bool qp_plan_corner_high_v(uint32_t i);
uint32_t qp_plan_new_final(qp_builder *b, uint8_t need, uint32_t kind);
void qp_plan_lower_need(qp_builder *b, uint32_t point, uint8_t need);
double *qp_plan_final_row(qp_builder *b, uint32_t point);
/* A final point of its own for a point of a level of `local`. */
uint32_t qp_plan_copy_final(qp_builder *b, const qp_local *local, uint32_t level, uint32_t point,
                            uint8_t need);
/* The final point of a point of a level of b->local, shared by all nodes of that level. */
uint32_t qp_plan_shared_final(qp_builder *b, uint32_t level, uint32_t point, uint8_t need);
/* Likewise as an offset from the final point `origin`. */
uint32_t qp_plan_offset_final(qp_builder *b, uint32_t level, uint32_t point, uint8_t need, uint32_t origin);
/* The limit of the patch's corner i as a final point, or QP_NO_POINT where it is not known. */
uint32_t qp_plan_corner_origin(qp_builder *b, uint32_t i);
/* Limit position and tangents of a cell's corner as three new points; tangents may be QP_NO_POINT. */
void qp_plan_limit_finals(qp_builder *b, uint32_t level, const qp_corner *corner, uint8_t need,
                          uint32_t out[3]);

/* build.c */
uint32_t qp_plan_new_node(qp_builder *b, uint32_t words);
void qp_plan_link_node(qp_builder *b, const qp_item *item, uint32_t node);
void qp_plan_put_point(uint32_t *words, uint32_t slot, uint32_t point);
void qp_plan_push_item(qp_builder *b, uint32_t level, qp_item item);
qp_item qp_plan_child_item(const qp_item *item, qp_cell *children, uint32_t i, bool tie_u, bool tie_v);

/* chain.c */
/* The corner at which the only child that is no plain leaf lies, -1 if the children are no ring. */
int qp_plan_ring_corner(const qp_builder *b, const qp_item *item, const qp_cell *children);
void qp_plan_go_on_chain(qp_builder *b, uint32_t level, const qp_item *item, qp_cell *children,
                         uint32_t corner);
void qp_plan_close_chain(qp_builder *b, qp_item *item);
/* The chain's corner is extraordinary for good: all its other rings to the plan's depth, and its end. */
bool qp_plan_is_permanent(const qp_builder *b, uint32_t level, const qp_item *item);
void qp_plan_put_tail(qp_builder *b, uint32_t level, qp_item *item);

/* anchor.c: fills point_anchors and base of a plan that is otherwise finished. */
void qp_plan_anchor(qp_plan *plan);
/* Fills in corner_rows; the tree is final. */
void qp_plan_find_reach(qp_plan *plan);
/* mode.c: splits the rings of a chain that has an origin, where they tend to one vector. The point of that vector, or QP_NO_POINT. */
uint32_t qp_plan_split_mode(qp_builder *b, const qp_chain *chain, const qp_fan *fan, uint32_t level);

/* finish.c */
qp_plan *qp_plan_finish(qp_builder *b);

#endif
