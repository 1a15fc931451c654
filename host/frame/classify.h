/* Which quadtree node of its plan evaluates a point: for deeper plans, pictures and statistics. Coordinates are signed, as the
 * device holds them (kernels/frame_layout.h). */
#ifndef QP_FRAME_CLASSIFY_H
#define QP_FRAME_CLASSIFY_H

#include "host/plan/plan.h"

typedef struct qp_leaf {
    uint32_t kind;  /* QP_NODE_*: what evaluates the point; a regular sub-domain of a terminal node is
                       QP_NODE_TERMINAL */
    uint32_t level; /* subdivision level of the domain in which it is evaluated; 0: the patch itself */
    bool corner;    /* the point is a corner of that domain */
} qp_leaf;

/* Walks the plan's tree (kernels/plan_layout.h) to (u, v) of the plan, as the domain stage does. */
qp_leaf qp_classify(const qp_plan *plan, double u, double v);

/* (u, v) of a patch in the frame of its plan, which lies turned by `rotation` on it. */
void qp_rotate_uv(uint32_t rotation, double *u, double *v);

#endif
