/* Limit position and tangents at a vertex, whatever its tags. */
#ifndef QP_REFERENCE_CORNER_H
#define QP_REFERENCE_CORNER_H

#include "host/reference/piece.h"

/* Buffers that grow as needed; zero-initialise, free with qp_corner_work_free. */
typedef struct qp_corner_work {
    qp_piece step[2];
    qp_quad *ring; /* of a sector: the far ends of its spokes and the opposite vertices of its faces */
    size_t ring_capacity;
    qp_quad *next;
    size_t next_capacity;
} qp_corner_work;
void qp_corner_work_free(qp_corner_work *work);

typedef struct qp_corner_limit {
    qp_quad p[3];
    /* Tangents along the face's two edges at the vertex: toward the next vertex of the face and toward the
     * previous one. Where the surface is regular there, they are the derivatives by the parameter that runs
     * from 0 to 1 along that edge of the face; else only the plane they span and the sign of their cross
     * product mean something. Where has_plane is false they are zero, or the tangents of the curve and across
     * it at a crease of five faces or more. */
    double toward_next[3], toward_prev[3];
    double a[3],
        b[3]; /* what the two are combinations of: at a right angle where the ring is an affine image of its eigenring */
    bool has_plane;
} qp_corner_limit;

/* The limit at a corner of the mesh as the face of that corner sees it (at creases, its side). The corner's
 * vertex must be complete; the mesh's maps are used as scratch. */
qp_status qp_corner_eval(qp_piece *mesh, uint32_t corner, qp_corner_work *work, qp_corner_limit *limit,
                         qp_error *err);

#endif
