/* What a frame evaluates, as items of samples of one patch. */
#ifndef QP_FRAME_FRAME_LAYOUT_H
#define QP_FRAME_FRAME_LAYOUT_H

#include "host/frame/share.h"

#include <math.h>

/* Samples of one patch, evaluated by one work-group. */
typedef struct qp_frame_item {
    uint32_t patch, samples;
    uint32_t
        level; /* of the patch's tessellation: says which normals may be made from samples beside (kernels/domain.cl) */
    uint32_t need; /* rows[need] of the patch's plan are enough, for those too; */
    uint32_t away; /* and so are corner_rows[away] for the samples alone, but for those at corners */
    uint64_t grid; /* first (u,v) in grid_u, grid_v */
    uint64_t out;  /* first sample in the stream */
    double
        nearest; /* distance of the sample next to a corner of the patch, those at corners apart; > 1: none */
} qp_frame_item;

/* What to evaluate. Items are in order of .out and cover n_evaluated samples without gaps; several may share a grid, and a patch may
 * have several. Samples that are evaluated only for others to copy are no part of the stream: they lie behind its n_samples, or,
 * where there is an `order`, anywhere. */
typedef struct qp_frame_layout {
    size_t n_items;
    qp_frame_item *items;
    size_t grid_points;
    double *grid_u,
        *grid_v; /* [grid_points] in [0,1], or, with the sign bit set, signed already; upload rounds and signs them */
    uint64_t n_samples, n_triangles;
    float *uv;              /* [2 * n_samples] */
    uint32_t *sample_patch; /* [n_samples] */
    uint32_t *triangles;    /* [3 * n_triangles], NULL unless asked for */
    uint64_t *order;        /* sample i of the caller is sample order[i] of the items; NULL: the same */
    uint64_t n_evaluated;   /* n_samples, and those that are there to be copied */
    qp_copies copies;       /* once all are evaluated */
} qp_frame_layout;

/* The tessellator's points of every patch that has a surface; factors.h says with which factors. share: NULL for none. Errors:
 * QP_BAD_INPUT for a factor that is not in [1, 64], QP_SYSTEM for memory. */
qp_status qp_layout_tessellate(const qp_surface *surface, const qp_tessellation *tessellation,
                               const qp_share *share, bool want_triangles, qp_frame_layout *layout,
                               qp_error *err);
/* Its items alone, in order of patches, and how many samples and triangles they make; no array is filled, and no ghosts are added. */
qp_status qp_layout_items(const qp_surface *surface, const qp_tessellation *tessellation,
                          qp_frame_layout *layout, qp_error *err);
/* Any points, grouped by patch. Errors: QP_BAD_INPUT names the first point that is none of a patch with a
 * surface. */
qp_status qp_layout_points(const qp_surface *surface, uint64_t count, const uint32_t *patch, const double *uv,
                           const qp_share *share, qp_frame_layout *layout, qp_error *err);
void qp_layout_free(qp_frame_layout *layout);

/* ---- In pieces ---- */

/* Makes layouts of runs of patches. Holds a few bytes a face and edge, and the grids of a run and its neighbours. */
typedef struct qp_layout_maker qp_layout_maker;

/* What the tessellation and the share point to must outlive it. Errors as qp_layout_tessellate. */
qp_status qp_layout_open(const qp_surface *surface, const qp_tessellation *tessellation,
                         const qp_share *share, bool want_triangles, qp_layout_maker **maker, qp_error *err);
/* The layout of the patches from `first` on, as many as have no more than most_samples all together; *end is the first one that is left
 * out. Samples that other patches own are ghosts with those patches' own levels, so that any run of patches gets the bits that the
 * whole mesh gets. without_stream: uv, sample_patch and triangles are left out. Errors: QP_BAD_INPUT where one patch has more than
 * most_samples, QP_SYSTEM for memory. */
qp_status qp_layout_run(qp_layout_maker *maker, uint32_t first, uint64_t most_samples, bool without_stream,
                        qp_frame_layout *layout, uint32_t *end, qp_error *err);
void qp_layout_close(qp_layout_maker *maker);

/* ---- What samples need ---- */

/* Over samples: the distance of a coordinate from the edge it is next to, and of a sample from a corner; 0 is left out. */
typedef struct qp_reach {
    double edge, corner;
} qp_reach;
#define QP_REACH_NONE                                                                                        \
    (qp_reach) {                                                                                             \
        2.0, 2.0                                                                                             \
    }

/* Coordinates as in grid_u, grid_v. */
static inline void qp_reach_add(qp_reach *reach, double u, double v) {
    const double du = u <= 0.5 ? fabs(u) : 1.0 - u, dv = v <= 0.5 ? fabs(v) : 1.0 - v;
    const double far = du > dv ? du : dv;
    if (du > 0 && du < reach->edge) reach->edge = du;
    if (dv > 0 && dv < reach->edge) reach->edge = dv;
    if (far > 0 && far < reach->corner) reach->corner = far;
}

static inline uint32_t qp_reach_level(double distance) {
    const int n = distance > 1 ? 0 : -ilogb(distance);
    return n < (int)QP_LEVELS - 1 ? (uint32_t)n : QP_LEVELS - 1;
}

/* Normals that are replaced in an item of some level take samples at eighths, or in the middle (kernels/domain.cl). */
static inline uint32_t qp_item_beside(const qp_frame_item *item) {
    return item->level < 3 ? item->level : 3;
}

/* Puts into an item what its samples need: at level n they lie on the patch's edges or at least 2^-n away from them. */
static inline void qp_item_reach(qp_frame_item *item, const qp_reach *reach) {
    const uint32_t level = qp_reach_level(reach->edge), beside = qp_item_beside(item);
    item->need = level > beside ? level : beside;
    item->away = qp_reach_level(reach->corner);
    item->nearest = reach->corner;
}

/* Points of the plan that an item needs. */
static inline uint32_t qp_item_rows(const qp_plan *plan, const qp_frame_item *item) {
    const uint32_t beside = plan->rows[qp_item_beside(item)], away = plan->corner_rows[item->away];
    const uint32_t rows = beside > away ? beside : away;
    return rows < plan->rows[item->need] ? rows : plan->rows[item->need];
}

#endif
