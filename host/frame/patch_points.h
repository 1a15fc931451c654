/* The control points of a patch on the host, in double, for bounds. */
#ifndef QP_FRAME_PATCH_POINTS_H
#define QP_FRAME_PATCH_POINTS_H

#include "host/plan/plan.h"

/* Scratch, reused from patch to patch. Zero-initialise. */
typedef struct qp_patch_points {
    const qp_plan *plan;
    double *ring;   /* 3 a ring vertex, relative to the first one */
    double *points; /* 3 a point of the plan: likewise, or relative to the point it is an offset from */
    size_t ring_capacity, point_capacity;
} qp_patch_points;

/* For the positions as they are now. False when memory is out. */
bool qp_patch_points_make(const qp_surface *surface, uint32_t patch, qp_patch_points *made);
void qp_patch_points_free(qp_patch_points *points);

/* Are the rules about the patch's corners the same for ever three levels above `depth`, so that the rings of a plan of that depth have
 * begun to shrink by the eigenvalues that they go on with? */
bool qp_patch_settles(const qp_mesh *mesh, uint32_t patch, uint32_t depth);

/* Point number `slot` of a list in a plan's tree (plan_layout.h). */
static inline const double *qp_patch_point(const qp_patch_points *p, const uint32_t *words, uint32_t slot) {
    return p->points + 3 * (size_t)(words[slot / 2] >> (slot % 2 * 16) & 0xffffu);
}

/* The offset of a ring's point from its corner's limit position, whichever way it is stored. */
static inline void qp_patch_offset(const qp_patch_points *p, const uint32_t *terminal,
                                   const uint32_t *extraordinary, uint32_t ring, uint32_t slot,
                                   double offset[3]) {
    const bool absolute = ring < QP_NODE_ABSOLUTE_RINGS(terminal[0]) || terminal[1] == QP_NO_POINT;
    const double *point = qp_patch_point(p, terminal + 3 + 12 * ring, slot);
    const double *limit = p->points + 3 * (size_t)extraordinary[1];
    for (int x = 0; x < 3; ++x) offset[x] = point[x] - (absolute ? limit[x] : 0.0);
}

#endif
