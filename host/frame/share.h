/* Samples that patches have in common: who owns them, and the copies that give all patches the owner's bits. */
#ifndef QP_FRAME_SHARE_H
#define QP_FRAME_SHARE_H

#include "host/plan/plan.h"

/* Owners over a mesh, as its corners (mesh.h): the lowest one wins, patches being numbered in the order of corners. */
typedef struct qp_share {
    const qp_surface *surface;
    uint32_t *
        edge_owner; /* [n_edges] half-edge that owns the edge, of an n-gon if there is one; QP_NONE: no surface */
    uint32_t
        *vertex_owner; /* [n_vertices] corner that owns the position of the vertex; QP_NONE: no surface */
    uint32_t
        *corner_normal; /* [n_corners] corner that owns the normal at this corner; QP_NONE: each its own */
} qp_share;

/* What a copy takes from its source. */
enum {
    QP_SHARE_POSITION = 1,
    QP_SHARE_NORMAL = 2, /* and the flags that are not of derivatives, which are never shared */
    QP_SHARE_DEPTH = 4   /* with a position alone: that it lies past depth */
};

/* A patch's corner or edge, 0..3: corner 0 is (0,0), then counter-clockwise; edge k runs from corner k to the next. */
typedef struct qp_side {
    uint32_t patch, index;
} qp_side;

/* Owner of one edge of a patch. With t in [0,1] along that edge and T = reversed ? 1 - t : t, the owner is side[0] at T; or, when
 * split, side[0] at 2T for T <= 1/2, side[1] at 2T - 1 above. */
typedef struct qp_edge_owner {
    qp_side side[2];
    bool own; /* the patch itself */
    bool reversed, split;
    bool normal; /* is the normal shared as well? (at the ends, the corners' rules hold) */
} qp_edge_owner;

/* Owners of one corner of a patch. */
typedef struct qp_corner_owner {
    qp_side position;
    qp_side normal; /* .patch QP_NONE: the patch's own */
} qp_corner_owner;

/* Errors: QP_SYSTEM for memory. Linear time. */
qp_status qp_share_create(const qp_surface *surface, qp_share **share, qp_error *err);
void qp_share_free(qp_share *share);
/* child: which one of an n-gon, 0 for a quad. The face must have a surface. */
qp_edge_owner qp_share_edge(const qp_share *share, uint32_t face, uint32_t child, uint32_t edge);
qp_corner_owner qp_share_corner(const qp_share *share, uint32_t face, uint32_t child, uint32_t corner);

/* ---- Copies (copies.c) ---- */

/* Samples to .. to + count - 1 take what `fields` says from samples from, from + step, ... Never is a source's field the target of
 * another copy, so that copies may run in any order. */
typedef struct qp_copy {
    uint64_t to, from;
    uint32_t count;
    int8_t step; /* 1 or -1 */
    uint8_t fields;
} qp_copy;

typedef struct qp_copies {
    size_t count, capacity;
    qp_copy *list;
} qp_copies;

/* A sample that is evaluated for others to copy. Coordinates are in double, and may be signed (kernels/frame_layout.h). */
typedef struct qp_ghost {
    uint32_t patch;
    uint32_t level; /* of the patch's own samples, where this is one of them; QP_LEVELS - 1 elsewhere */
    double u, v;
} qp_ghost;

typedef struct qp_ghosts {
    size_t count, capacity;
    qp_ghost *list;
} qp_ghosts;

/* One part of a patch of a tessellation: the patch, or a quarter (factors.h). */
typedef struct qp_share_part {
    uint64_t out;    /* its first sample; of a patch outside the stream anything */
    const float *uv; /* of its samples, in the patch's coordinates */
    const struct qp_rim *rim;
    uint32_t patch, level; /* the level of the patch's samples */
} qp_share_part;

/* The patches first .. end - 1, whose samples make the stream, and some others, which have none there but may own samples of it. A patch
 * has no part, 1 or 4. */
typedef struct qp_share_parts {
    uint32_t first, end;
    const size_t *first_part; /* [end - first + 1] */
    const qp_share_part *parts;
    size_t n_others;
    const uint32_t *others;    /* [n_others] patches, increasing */
    const size_t *others_part; /* [n_others + 1] */
} qp_share_parts;

/* The first `count` samples of a part run counter-clockwise around it, and these of them are its corners. */
typedef struct qp_rim {
    uint32_t count, corner[4];
} qp_rim;

typedef struct qp_patch_list {
    size_t count, capacity;
    uint32_t *list;
} qp_patch_list;

/* The patches that own samples of patches first .. end - 1 and are none of those, increasing. Errors: QP_SYSTEM for memory. */
qp_status qp_share_others(const qp_share *share, uint32_t first, uint32_t end, qp_patch_list *others, qp_error *err);

/* The copies of a tessellation. Of every owner in it the parts must be there. Samples of others that are copied become ghosts. A copy
 * from QP_SHARE_GHOST + i is from ghost i, which the caller gives a place. Errors: QP_SYSTEM for memory. */
#define QP_SHARE_GHOST (UINT64_C(1) << 63)
qp_status qp_share_tessellation(const qp_share *share, const qp_share_parts *parts, qp_copies *copies,
                                qp_ghosts *ghosts, qp_error *err);

/* Appends the copies for a point of a patch at (u,v) in [0,1]^2, where it lies on the perimeter: to sample `to`, from ghosts as above. */
qp_status qp_share_point(const qp_share *share, uint32_t patch, double u, double v, uint64_t to,
                         qp_copies *copies, qp_ghosts *ghosts, qp_error *err);

/* Makes the copies in a stream of 6 reals and one byte of flags a sample, in parallel. */
void qp_copies_apply(const qp_copies *copies, size_t real_size, void *vertices, uint8_t *flags);

#endif
