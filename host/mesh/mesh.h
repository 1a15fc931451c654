/* The base mesh: faces, tags and adjacency, as every other part reads it.
 *
 * Invariants once qp_mesh_create / qp_mesh_read_obj has returned QP_OK:
 * - every face has at least 3 vertices, all different; every index is in range; every position is finite.
 * - a *corner* is a place in face_vertices; corner h of face f is also the half-edge from its vertex to the
 *   vertex of the next corner of f (cyclically).
 * - corner_twin[h] is the one corner whose half-edge runs the other way over the same edge, or QP_NONE where
 * the edge is a boundary or non-manifold (more than two faces, or two faces running the same way).
 *   twin(twin(h)) == h. A fan walk over twins therefore never crosses a non-manifold edge.
 * - sharpness is *effective*: boundary and non-manifold edges and sharpened corners are already at
 *   QP_SHARPNESS_INFINITE, as OpenSubdiv's Far::TopologyRefinerFactory does it; values are clamped to [0,
 * infinite]. */
#ifndef QP_MESH_MESH_H
#define QP_MESH_MESH_H

#include "host/base/status.h"

/* Coordinates beyond this are refused, so that sums and differences of them still fit in a float. */
#define QP_COORDINATE_LIMIT 1e36

enum { QP_EDGE_BOUNDARY = 1, QP_EDGE_NONMANIFOLD = 2 };
enum {
    QP_VERTEX_BOUNDARY = 1,    /* touches a boundary edge */
    QP_VERTEX_NONMANIFOLD = 2, /* touches a non-manifold edge, or its faces form more than one fan */
    QP_VERTEX_UNUSED = 4       /* no face */
};
enum {
    QP_FACE_HOLE = 1, /* no surface: tagged as a hole, or a boundary face under QP_BOUNDARY_NONE */
};

struct qp_mesh {
    uint32_t n_vertices, n_faces, n_corners, n_edges, n_patches;
    double *positions;         /* [3 * n_vertices] */
    uint32_t *face_offsets;    /* [n_faces + 1] first corner of each face */
    uint32_t *face_vertices;   /* [n_corners] */
    uint32_t *corner_face;     /* [n_corners] */
    uint32_t *corner_edge;     /* [n_corners] edge from this corner to the next */
    uint32_t *corner_twin;     /* [n_corners] or QP_NONE */
    uint32_t *edge_vertices;   /* [2 * n_edges] lower index first */
    uint32_t *edge_face_count; /* [n_edges] */
    float *edge_sharpness;     /* [n_edges] effective */
    uint8_t *edge_flags;       /* [n_edges] */
    uint32_t *vertex_offsets;  /* [n_vertices + 1] into vertex_corners */
    uint32_t *vertex_corners;  /* [n_corners] the corners at each vertex, increasing */
    float *vertex_sharpness;   /* [n_vertices] effective */
    uint8_t *vertex_flags;     /* [n_vertices] */
    uint8_t *face_flags;       /* [n_faces] */
    uint32_t *face_lines;      /* [n_faces] line of the source file, or NULL */
    uint32_t *patch_offsets;   /* [n_faces + 1] first patch of each face: 1 for a quad, n for an n-gon */
    /* Face-varying texture coordinates; NULL where the file had none. */
    uint32_t n_texcoords;
    double *texcoords;          /* [2 * n_texcoords] */
    uint32_t *corner_texcoords; /* [n_corners], QP_NONE where a corner has none */
    int fvar_boundary;          /* facevaryinginterpolateboundary value, 5 (all) when untagged */
    /* Tags as given, before the rules above made them effective (needed to hand the mesh to a peer
     * unchanged). */
    uint32_t n_creases;
    uint32_t *crease_vertices; /* [2 * n_creases] */
    float *crease_sharpness;   /* [n_creases] */
    uint32_t n_corner_tags;
    uint32_t *corner_tag_vertices;
    float *corner_tag_sharpness;
    uint32_t n_hole_tags;
    uint32_t *hole_tag_faces;
    qp_boundary boundary;
    qp_crease_method crease_method;
    qp_triangle_rule triangle_rule;
    double box_min[3], box_max[3]; /* of used vertices */
    double diagonal;               /* of that box; 1 when it is a point, so that ratios stay finite */
};

/* The frame in which a device holds the positions, as they are now: (x - centre) / 2^exponent. An axis is centred where the mesh
 * lies more than four of its extents away from 0: the difference is then exact (Sterbenz), so that no digits are lost which x
 * itself still holds; elsewhere centre is 0 and nothing changes but the exponent. */
typedef struct qp_local_frame {
    double centre[3]; /* sums of two floats */
    int exponent;     /* -100 to 100, so that the scale is a normal number of float */
} qp_local_frame;
qp_local_frame qp_mesh_local_frame(const qp_mesh *mesh);

static inline uint32_t qp_face_size(const qp_mesh *m, uint32_t face) {
    return m->face_offsets[face + 1] - m->face_offsets[face];
}
static inline uint32_t qp_corner_next(const qp_mesh *m, uint32_t corner) {
    uint32_t f = m->corner_face[corner];
    return corner + 1 == m->face_offsets[f + 1] ? m->face_offsets[f] : corner + 1;
}
static inline uint32_t qp_corner_prev(const qp_mesh *m, uint32_t corner) {
    uint32_t f = m->corner_face[corner];
    return corner == m->face_offsets[f] ? m->face_offsets[f + 1] - 1 : corner - 1;
}

/* Base face of a patch, and which child of an n-gon it is (0 for a quad). Binary search over patch_offsets.
 */
uint32_t qp_patch_face(const qp_mesh *mesh, uint32_t patch, uint32_t *child);

/* A regular face (DESIGN.md): a quad whose four vertices are interior, manifold, of valence 4, touched by
 * quads only, with no incident sharp edge and no sharpness of their own. */
bool qp_face_is_regular(const qp_mesh *mesh, uint32_t face);

/* Takes arrays filled by a reader (positions, face_offsets, face_vertices, tags as given, options) and
 * computes the rest. Frees nothing on failure: the caller frees the mesh. `name` is for messages. Linear
 * time. */
qp_status qp_mesh_analyse(qp_mesh *mesh, const char *name, const qp_mesh_options *options, qp_error *err);

/* Puts the rules that *options overrides in place of the mesh's own. They are part of its analysis, so the mesh is made anew from
 * its own arrays and *mesh replaced; texture coordinates and face lines are not carried over, so this is for generated meshes (a
 * reader takes the options itself). *mesh stays as it was on failure. */
qp_status qp_mesh_apply_options(qp_mesh **mesh, const qp_mesh_options *options, qp_error *err);

/* Writes an OBJ with tags that qp_mesh_read_obj reads back to the same mesh (17 significant digits). */
qp_status qp_mesh_write_obj(const qp_mesh *mesh, const char *path, qp_error *err);

/* ---- Procedural meshes (host/mesh/generate*.c) ---- */
typedef struct qp_generate_options {
    uint32_t n[3];    /* resolution; meaning depends on the kind; 0: its default */
    double sharpness; /* where the kind has creases; < 0: default */
    uint64_t seed;
    uint32_t faces; /* upper bound of faces for the random kinds; 0: 200 */
} qp_generate_options;

/* kind: cube, torus, creased-torus, cubes (12 x 12 x 10 grid of separate cubes), fan (valence n[0]), prism
 * (n-gon), terrain, irregular (no regular patch), random-closed, random-open. QP_BAD_INPUT names an unknown kind. */
qp_status qp_mesh_generate(const char *kind, const qp_generate_options *options, qp_mesh **mesh,
                           qp_error *err);

#endif
