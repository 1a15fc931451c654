/* Evaluation of many patches with one set of buffers. */
#ifndef QP_REFERENCE_EVAL_H
#define QP_REFERENCE_EVAL_H

#include "host/reference/corner.h"
#include "host/reference/reference.h"

/* Below this level a sample counts as lying at the corner of its cell. The ring of a vertex shrinks by at
 * most 0.655 a level (a fan of unbounded valence), so the position is off by less than 1e-19 of the ring. */
enum { QP_REFERENCE_DEPTH = 104 };

/* Zero-initialise; one thread at a time. */
typedef struct qp_reference_work {
    qp_piece levels[QP_REFERENCE_DEPTH + 3];
    qp_corner_work corner;
    double *uv; /* of the samples, local to the cell that is being visited */
    size_t uv_capacity;
    uint32_t *order; /* samples, those of one cell together */
    size_t order_capacity;
} qp_reference_work;
void qp_reference_work_free(qp_reference_work *work);

/* qp_reference_eval with buffers kept between calls. */
qp_status qp_reference_eval_with(qp_reference_work *work, const qp_mesh *mesh, const double *positions,
                                 uint32_t patch, size_t count, const double *uv, qp_reference_sample *samples,
                                 qp_error *err);

/* The mesh's positions as frames in float get them: rounded in the mesh's local frame. malloced, 3 a vertex; NULL when
 * memory is out. */
double *qp_reference_rounded_positions(const qp_mesh *mesh);

/* qp_reference_compare where the reference's samples are known already, for many streams of one set of points:
 * references has one for each sample of the stream. */
qp_status qp_reference_compare_known(const qp_mesh *mesh, const qp_stream *stream, const double *uv,
                                     const qp_reference_sample *references, qp_error_report *report,
                                     qp_error *err);

#endif
