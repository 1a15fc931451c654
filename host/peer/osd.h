/* OpenSubdiv 3.5 behind a C face: its evaluation in double, for cross-checks, and its set-up times. */
#ifndef QP_PEER_OSD_H
#define QP_PEER_OSD_H

#ifdef __cplusplus
extern "C" {
#endif

#include "host/mesh/mesh.h" /* inside: the house's own headers are plain C */

typedef struct qp_osd qp_osd;

typedef struct qp_osd_sample {
    double p[3], du[3], dv[3]; /* derivatives by the (u,v) of OpenSubdiv's ptex face, see qp_osd_eval */
    bool end_cap;              /* inside a Gregory patch: an approximation of the surface */
    bool missing;              /* no patch there: a hole */
} qp_osd_sample;

/* Refines the mesh adaptively to `depth` (1..10) and makes its patch table and points in double. The mesh
 * goes over with its tags as given, not as made effective. Single-crease patches are off and infinitely
 * sharp patches on: those are exact, the others are not. positions: 3 a vertex, copied. QP_BAD_INPUT when
 * OpenSubdiv refuses the mesh, QP_SYSTEM when it throws. The caller frees *osd. */
qp_status qp_osd_create(const qp_mesh *mesh, const double *positions, unsigned depth, qp_osd **osd,
                        qp_error *err);
void qp_osd_free(qp_osd *osd);

/* The limit at count points of one patch (numbered as ours), uv two a point. On children of n-gons its
 * derivatives are twice ours: it measures them by half the parameter. */
qp_status qp_osd_eval(const qp_osd *osd, uint32_t patch, size_t count, const double *uv,
                      qp_osd_sample *samples, qp_error *err);

typedef struct qp_osd_limit {
    uint32_t patch;
    double u, v;
    double p[3], n[3]; /* n: unit, where has_normal */
    /* The rule at the vertex no longer changes, so that its limit mask is right. False at darts (OpenSubdiv
     * takes the smooth mask there) and at interior vertices of valence 2 (it takes the vertex itself). */
    bool settled;
    /* Settled, and smooth or on a boundary of two faces. (On wider ones its tangent across the boundary is
     * that of another rule, see docs/reference.md.) */
    bool has_normal;
} qp_osd_limit;

/* Limits by masks at all face corners of a uniform refinement to `level` (1..8), in double; a vertex appears
 * once for each of its faces. Unlike adaptive refinement this knows every neighbour at every level. The
 * caller frees *limits with free(). */
qp_status qp_osd_uniform_limits(const qp_mesh *mesh, const double *positions, unsigned level,
                                qp_osd_limit **limits, size_t *count, qp_error *err);

/* Milliseconds of adaptive refinement to `level`, of the patch table with B-spline end caps, and of the
 * stencil table of all points, in float, as a program would set it up; topology only. One run. */
qp_status qp_osd_time_setup(const qp_mesh *mesh, unsigned level, double *refine_ms, double *patch_ms,
                            double *stencil_ms, qp_error *err);

/* OpenSubdiv's base level: what it makes of the mesh's faces and tags before any refinement. Arrays of the
 * mesh's own sizes and numbering, the caller's; flags as mesh.h has them (no QP_VERTEX_UNUSED). *n_edges is its
 * count of edges. QP_CHECK_FAILED when it lacks an edge of ours. */
typedef struct qp_osd_tags {
    uint32_t n_edges;
    float *edge_sharpness, *vertex_sharpness;
    uint8_t *edge_flags, *vertex_flags, *face_flags;
} qp_osd_tags;
qp_status qp_osd_base_tags(const qp_mesh *mesh, qp_osd_tags *tags, qp_error *err);

#ifdef __cplusplus
}
#endif
#endif
