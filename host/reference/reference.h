/* The exact limit surface, by recursive refinement around (u,v) in __float128, written independently of
 * host/plan. */
#ifndef QP_REFERENCE_REFERENCE_H
#define QP_REFERENCE_REFERENCE_H

#include "host/mesh/mesh.h"

typedef struct qp_reference_sample {
    /* du, dv with respect to the patch's own (u,v) in [0,1]^2. At a corner of an irregular cell they span the
     * tangent plane, and are the one-sided derivatives where those are finite and not zero, else tangents of
     * any length (often 0) where there is no tangent plane. */
    double p[3], du[3], dv[3];
    double p_rest[3];    /* what rounding took from p: p + p_rest has twice the digits */
    double n[3];         /* unit normal, or 0 where undefined */
    bool normal_defined; /* false where the surface has no tangent plane, or it is too ill-conditioned to tell
                          */
    /* Condition number of the tangent frame [du dv], the ratio of its singular values: 1 where they are of one length at a
     * right angle, never less; infinite where the normal is undefined. At a corner of an irregular cell that of the two tangents
     * that span the limit's plane, whatever part of a turn the patch takes of it. */
    double condition;
} qp_reference_sample;

/* Limit position, derivatives and normal of one patch at count points uv[2*i], uv[2*i+1] in [0,1]; exact at
 * any of them, corners of extraordinary vertices included. QP_BAD_INPUT for a patch without surface (a
 * hole) and for points outside the square. Thread-safe: reads the mesh only. positions: 3 a
 * vertex, usually mesh->positions (or their float-rounded values, so that float evaluation is measured
 * against what it was given). */
qp_status qp_reference_eval(const qp_mesh *mesh, const double *positions, uint32_t patch, size_t count,
                            const double *uv, qp_reference_sample *samples, qp_error *err);

/* Normals of tangent frames up to this condition are well conditioned. Derivation: let J = [du dv] be off by an error E with
 * |E| <= e |J|. The normal is the left singular vector of J's third, zero singular value, and E turns it by |E| / s_min at the
 * most, to first order, with s_min the smaller of J's two singular values: by e |J| / s_min = e cond(J). One rounding to float
 * is e = 6e-8; at a condition of 100 that is 6e-6, and 0.01 degrees, 1.75e-4, leave room for 29 of them: what positions in float
 * and a sum of 16 of them take. Neither a rotation nor a scale of the surface changes the condition. */
enum { QP_WELL_CONDITIONED = 100 };

/* Error measures of DESIGN.md, "Measuring". */
typedef struct qp_error_report {
    uint64_t samples, past_depth, normals_undefined, nonfinite;
    uint64_t
        normals_ill; /* of samples whose tangent frame's condition exceeds QP_WELL_CONDITIONED, measured apart */
    double ill_normal_max_deg,
        ill_normal_deg_per_condition;  /* largest error of theirs, and over their condition */
    double position_max, position_rms; /* of the bounding box diagonal */
    double normal_max_deg, normal_rms_deg;
    uint32_t worst_patch;
    double worst_u, worst_v; /* of position_max */
    uint32_t worst_normal_patch;
    double worst_normal_u, worst_normal_v;
    double past_position_max; /* of the samples past depth, which the maxima above leave out */
    double past_normal_max_deg;
} qp_error_report;

/* Compares a vertex stream with the reference, in parallel over patches; the report is the same for any
 * number of threads. Samples flagged QP_SAMPLE_PAST_DEPTH are counted apart. Float streams are compared with
 * the surface of the positions rounded to float, which is what the kernels were given, double streams with
 * that of the positions themselves. uv: the points where the stream was evaluated, 2 a sample; NULL: stream->uv, which holds the
 * tessellator's points in full. A sample flagged as without a normal where the reference has one counts as 180
 * degrees off; samples that are not finite are counted and left out of the measures. QP_BAD_INPUT when a
 * sample lies on a patch without surface or outside [0,1]^2. */
qp_status qp_reference_compare(const qp_mesh *mesh, const qp_stream *stream, const double *uv,
                               qp_error_report *report, qp_error *err);

/* Sample sets. Arrays are malloced for the caller; nothing is held on failure. kind "corner": (u,v) in
 * {0, 2^-k} offsets about every corner of every patch with a surface, k = 1..24 (count and seed are not
 * used); "random": count low-discrepancy points over all patches with a surface,
 * multiples of 2^-24. */
typedef struct qp_sample_set {
    uint64_t count;
    uint32_t *patch;
    double *uv;
} qp_sample_set;
qp_status qp_sample_set_make(const qp_mesh *mesh, const char *kind, uint64_t count, uint64_t seed,
                             qp_sample_set *set, qp_error *err);
void qp_sample_set_free(qp_sample_set *set);

#endif
