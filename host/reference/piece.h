/* A piece of a mesh in extended precision, and one Catmull-Clark step of it around a few vertices.
 *
 * A vertex of a piece is *complete* when all its faces and edges are in the mesh. Only complete vertices
 * may be refined; what lies around the others is never read, except the sums that Chaikin's rule needs. */
#ifndef QP_REFERENCE_PIECE_H
#define QP_REFERENCE_PIECE_H

#include "host/mesh/mesh.h"

/* IEEE binary128; the reference is written for this type only. */
__extension__ typedef __float128 qp_quad;

typedef struct qp_piece_edge {
    uint32_t v[2];
    uint32_t f[2];    /* the first two faces */
    uint32_t n_faces; /* of the faces in this mesh; exact when an end is complete */
    float sharpness;
} qp_piece_edge;

typedef struct qp_piece_vertex {
    qp_quad p[3];
    float sharpness;
    /* Over all semi-sharp edges at the vertex in the whole surface, also where it is not complete: the sum is
     * exact, since floats of at most 10 are added in double. */
    double semi_sum;
    uint32_t semi_count;
} qp_piece_vertex;

typedef struct qp_piece {
    uint32_t n_vertices, n_edges, n_faces, n_corners;
    qp_piece_vertex *vertices;
    qp_piece_edge *edges;
    uint32_t *face_offsets;                              /* [n_faces + 1] */
    uint32_t *corner_face, *corner_vertex, *corner_edge; /* edge from this corner to the next */
    uint32_t *vertex_edge_offsets, *vertex_edges;        /* incidence, [n_vertices + 1] offsets */
    uint32_t *vertex_corner_offsets, *vertex_corners;
    bool chaikin;
    bool smooth_triangles; /* the triangle rule "smooth"; only a base mesh has triangles */
    /* Written by qp_piece_refine when this mesh is the parent. */
    uint32_t *corner_child; /* [n_corners] child face, where the corner's vertex was refined */
    uint32_t *map_vertex, *map_edge, *map_face; /* child vertices */
    uint32_t *map_half;                         /* [2 * n_edges] child edges at either end */
    uint32_t *map_spoke;                        /* [n_corners] child edges from edge points to face points */
    void *block;                                /* owns all arrays above */
    size_t block_bytes;
} qp_piece;

/* Gathers all faces that touch the given base face; its own corners become the corners of face 0 of the piece
 * in the same order, and its vertices are complete. positions: 3 a vertex of the base mesh. */
qp_status qp_piece_gather(const qp_mesh *mesh, const double *positions, uint32_t face, qp_piece *piece,
                          qp_error *err);

/* One step around the given complete vertices: child has a face for every corner at one of them. A quad's
 * child at corner j keeps its orientation: the old vertex is again at place j. An n-gon's child starts with
 * the old vertex. In child, the refined vertices are complete, and so are the points of edges and faces all
 * of whose vertices were refined. child is overwritten and its memory reused. */
qp_status qp_piece_refine(qp_piece *parent, const uint32_t *centers, uint32_t n_centers, qp_piece *child,
                          qp_error *err);

void qp_piece_free(qp_piece *piece);

static inline uint32_t qp_piece_face_size(const qp_piece *m, uint32_t f) {
    return m->face_offsets[f + 1] - m->face_offsets[f];
}
static inline uint32_t qp_piece_next(const qp_piece *m, uint32_t corner) {
    uint32_t f = m->corner_face[corner];
    return corner + 1 == m->face_offsets[f + 1] ? m->face_offsets[f] : corner + 1;
}
static inline uint32_t qp_piece_prev(const qp_piece *m, uint32_t corner) {
    uint32_t f = m->corner_face[corner];
    return corner == m->face_offsets[f] ? m->face_offsets[f + 1] - 1 : corner - 1;
}
static inline bool qp_piece_infinite(float sharpness) {
    return sharpness >= QP_SHARPNESS_INFINITE;
}
static inline bool qp_piece_semisharp(float sharpness) {
    return sharpness > 0.0f && sharpness < QP_SHARPNESS_INFINITE;
}

/* What a vertex's incident edges and faces say about its rules. */
typedef struct qp_piece_kind {
    uint32_t n_edges, n_faces;
    uint32_t n_infinite, n_semisharp; /* incident edges */
    bool quads;                       /* all incident faces are quads */
} qp_piece_kind;
qp_piece_kind qp_piece_vertex_kind(const qp_piece *m, uint32_t vertex);

/* The corner at the same vertex in the face across `edge` from the corner's face, or QP_NONE when there is
 * none or the edge is not shared by exactly two faces. */
uint32_t qp_piece_across(const qp_piece *m, uint32_t corner, uint32_t edge);

#endif
