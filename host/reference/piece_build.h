/* How pieces are filled; only host/reference/piece.c and refine.c use this. */
#ifndef QP_REFERENCE_PIECE_BUILD_H
#define QP_REFERENCE_PIECE_BUILD_H

#include "host/reference/piece.h"

/* Empties the mesh and makes room for at most so many elements. */
qp_status qp_piece_reserve(qp_piece *m, size_t nv, size_t ne, size_t nf, size_t nc, qp_error *err);

/* Appends a face; its edges must be there already. */
void qp_piece_add_face(qp_piece *m, uint32_t size, const uint32_t *vertices, const uint32_t *edges);

/* Builds the incidence lists from faces and edges. */
void qp_piece_index(qp_piece *m);

#endif
