/* How local meshes are filled; only host/reference/local.c and refine.c use this. */
#ifndef QP_REFERENCE_LOCAL_BUILD_H
#define QP_REFERENCE_LOCAL_BUILD_H

#include "host/reference/local.h"

/* Empties the mesh and makes room for at most so many elements. */
qp_status qp_local_reserve(qp_local_mesh *m, size_t nv, size_t ne, size_t nf, size_t nc, qp_error *err);

/* Appends a face; its edges must be there already. */
void qp_local_add_face(qp_local_mesh *m, uint32_t size, const uint32_t *vertices, const uint32_t *edges);

/* Builds the incidence lists from faces and edges. */
void qp_local_index(qp_local_mesh *m);

#endif
