/* The distinct control points of a frame's plans (section 8.2 of the paper: the subdivision cache is indexed after
 * de-duplication over the mesh).
 *
 * Two control points are one when the hull makes the same bits of them for every mesh of this topology, before it moves them to their
 * patch's origin: same anchor, same terms (base vertex and weight as the device has it, in the order of the sum, zero weights left out),
 * same fourth number. That is compared in full; a hash only finds candidates. Regular patches have no control points. */
#ifndef QP_FRAME_UNIQUE_H
#define QP_FRAME_UNIQUE_H

#include "host/plan/plan.h"

struct qp_frame;

/* Patches of one frame are counted surface by surface, in the order of its steps (frame.h): patch p of surface number s is
 * s * n_patches + p. */
typedef struct qp_unique {
    uint32_t n_points; /* distinct ones, numbered from 0 in the order in which patches first have them */
    uint32_t
        n_base; /* those of the frame's own surface, which come first: their numbers do not change when deeper plans come */
    uint64_t n_needed; /* control points of all patches together */
    uint32_t *numbers; /* [n_needed] of each patch's points, patch after patch */
    uint64_t *first;   /* [n_surfaces * n_patches] where they begin, UINT64_MAX where a patch has none */
    uint8_t *levels;   /* [n_points] first level that needs it */
    uint8_t *shares;   /* [n_points] how many patches have it, 255 for more */
    uint32_t n_surfaces, n_patches, n_vertices;
    uint64_t *vertex_offsets; /* [n_vertices + 1] into vertex_patches */
    uint32_t *vertex_patches; /* patches whose rings hold a vertex */

    /* What the device has, kept to tell what depends on a vertex. */
    qp_precision precision;
    qp_plan_pack pack;
    uint32_t *rings;
    uint64_t *ring_of; /* [n_surfaces * n_patches] first word in rings */
    uint32_t *head_of; /* first word in pack.heads */
} qp_unique;

/* Of the plans that a frame has. Takes *pack and *rings, which are then empty. Linear in the number of points, but for the lengths
 * of rings. Errors: QP_SYSTEM for memory, or for 2^32 points and more. */
qp_status qp_unique_create(const struct qp_frame *frame, qp_plan_pack *pack, uint32_t **rings,
                           qp_unique **unique, qp_error *err);
void qp_unique_free(qp_unique *unique);

/* The points whose values depend on a vertex v with moved[v] != 0: numbers, ascending, in *list, which is malloced. */
qp_status qp_unique_affected(const qp_unique *unique, const uint8_t *moved, uint32_t **list, uint32_t *count,
                             qp_error *err);

/* Bytes of the tables, all on the host. */
uint64_t qp_unique_bytes(const qp_unique *unique);

#endif
