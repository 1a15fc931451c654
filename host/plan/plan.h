/* Plans and surfaces as the other host parts read them. Node and row layout: kernels/plan_layout.h. */
#ifndef QP_PLAN_PLAN_H
#define QP_PLAN_PLAN_H

#include "host/mesh/mesh.h"
#include "kernels/plan_layout.h"

/* One plan; immutable once built. */
typedef struct qp_plan {
    uint32_t ring_size, point_count, tree_words, constant_count, node_count;
    uint32_t flags;           /* QP_PLAN_* */
    uint32_t rows[QP_LEVELS]; /* points needed at level <= n */
    uint32_t
        corner_rows[QP_LEVELS]; /* points needed by samples that lie 2^-n or more (by the larger coordinate) from all corners */
    uint32_t *tree;           /* [tree_words], root at 0 */
    double *weights;          /* [point_count * ring_size], row-major: a row is one stencil */
    uint8_t *point_kinds;     /* [point_count] what each point is (host/plan/build.h), for info */
    uint16_t *point_origins;  /* [point_count] point that a row is an offset from, or QP_NO_POINT */
    uint8_t *point_scales;    /* [point_count] a device gets 2^scale times the row (exact) */
    uint16_t *
        point_modes; /* [point_count] NULL, or the point of which a row holds point_shares[i] (mode.c), or QP_NO_POINT */
    double *point_shares;
    uint8_t *point_anchors; /* [point_count] corner 0..3 of the plan that a point is computed relative to, and QP_ANCHOR_MOVES (anchor.c) */
    uint8_t base;           /* the corner that positions are relative to in the end */
    double *constants; /* [constant_count]; nodes hold index + qp_plan_first_constant() */
    uint32_t depth;    /* deepest level stored; less than asked for where that took too many points */
} qp_plan;

/* Words of anchors behind a plan's tree on a device: 4 bits a point, 0 where the base is all there is. */
static inline uint32_t qp_plan_anchor_words(const qp_plan *plan) {
    return (plan->flags & QP_PLAN_ANCHORS) != 0 ? (plan->point_count + 7u) / 8u : 0u;
}

/* Where constants begin in a plan's reals. */
static inline uint32_t qp_plan_first_constant(const qp_plan *plan) {
    return plan->point_count * (plan->ring_size + ((plan->flags & QP_PLAN_MODES) != 0 ? 1u : 0u));
}

struct qp_surface {
    const qp_mesh *mesh;
    qp_surface_options options;
    uint32_t n_plans;
    qp_plan **plans;         /* [n_plans] */
    uint32_t regular_plan;   /* index of the regular plan or QP_NONE */
    uint32_t *patch_plan;    /* [mesh->n_patches] plan, or QP_NONE where the patch has no surface (holes) */
    uint8_t *patch_rotation; /* [n_patches] 0..3 */
    uint64_t *patch_ring;    /* [n_patches] first entry in rings */
    uint32_t *rings;         /* base vertices of each patch's 1-ring in its plan's order */
    uint64_t ring_entries;
    double build_ms;
};

/* qp_surface_create for the patches p with mask[p] != 0 only (NULL: all); the others have no plan. */
qp_status qp_surface_create_for(const qp_mesh *mesh, const qp_surface_options *options, const uint8_t *mask,
                                qp_surface **surface, qp_error *err);

/* All plans of some surfaces concatenated, one surface after the other, as plan_layout.h says; caller frees the three arrays with
 * free(). */
typedef struct qp_plan_pack {
    uint32_t *heads;
    uint32_t *tree;
    void *reals; /* float or double */
    size_t head_words, tree_words, real_count;
} qp_plan_pack;
qp_status qp_surface_pack(const qp_surface *const *surfaces, uint32_t n_surfaces, qp_precision precision,
                          qp_plan_pack *pack, qp_error *err);

#endif
