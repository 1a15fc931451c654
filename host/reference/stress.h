/* Stability stress: families of hard cases, each a mesh and points on it, and the measure of what an evaluation makes of them.
 *
 * A case is a function of its family's name, its number and a seed alone, and is the same on every machine. */
#ifndef QP_REFERENCE_STRESS_H
#define QP_REFERENCE_STRESS_H

#include "host/base/random.h"
#include "host/mesh/mesh.h"

/* Where a case's points lie; every kind also draws from the others now and then. */
typedef enum qp_stress_points {
    QP_STRESS_MIXED,    /* anywhere, and at any power of two's distance from edges */
    QP_STRESS_DYADIC,   /* 2^-k and 1 - 2^-k, k to 24 */
    QP_STRESS_ADJACENT, /* at the floats next to the planes where quadtrees split */
    QP_STRESS_TINY      /* far below 2^-24: 1e-10, 1e-30 ... */
} qp_stress_points;

typedef struct qp_stress_case {
    qp_mesh *mesh;
    uint32_t depth; /* of the plans; 0: the library's default */
    qp_stress_points points;
    uint64_t count;
    uint32_t *patch; /* [count] */
    double *uv;      /* [2 * count], numbers that a frame takes as they are in either precision */
} qp_stress_case;

typedef struct qp_stress_family {
    const char *name, *summary; /* a word; one line */
    uint32_t cases;             /* that a run takes unless told otherwise */
    /* Makes mesh, depth and kind of points. The first numbers step through what the family is to cover, later ones are random. */
    qp_status (*make)(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err);
} qp_stress_family;

const qp_stress_family *qp_stress_families(size_t *count);

/* Case `number` of the family with `samples` points, fewer where no patch has a surface (0). */
qp_status qp_stress_case_make(const qp_stress_family *family, uint32_t number, uint64_t seed,
                              uint64_t samples, qp_stress_case *made, qp_error *err);
void qp_stress_case_free(qp_stress_case *made);

/* A sample and what is wrong with it. */
typedef struct qp_stress_sample {
    uint32_t number; /* of the case */
    uint32_t patch;
    double uv[2];
    double ulp, normal_deg;
    double got[6], p[3], n[3]; /* made, and the reference's */
    uint8_t flags;
    bool finite;
} qp_stress_sample;

/* Errors of positions are in units in the last place, an axis at a time: the largest over the three axes k of
 *   |p_k - reference_k| / ulp(max |x_k|)
 * with ulp that of the frame's precision and the maximum over the patch's 1-ring: all vertices of the base faces that touch the
 * patch's base face. The reference is the surface of the mesh's own double coordinates, so that the rounding of the coordinates
 * on their way to the device (half a unit at the most) counts as an error of the evaluation.
 *
 * The normal of a sample is *well conditioned* where the reference has one, the condition of its tangents is QP_WELL_CONDITIONED
 * at the most, and it turns by no more than 1e-3 degrees (double: 1e-11) when every coordinate of the 1-ring is moved up or down, at
 * random, by a unit in the last place of the largest one on its axis, as the device holds them (qp_mesh_local_frame). */
typedef struct qp_stress_report {
    uint64_t cases, samples;
    uint64_t nonfinite;       /* samples with a NaN or an infinity in position or normal */
    uint64_t past_depth;      /* samples flagged as approximate: left out of worst_ulp and worst_normal_deg */
    uint64_t no_normal;       /* flagged as without a normal */
    uint64_t normals_missing; /* of them, those whose normal is well conditioned */
    uint64_t normals_not_unit; /* off 1 in length by more than 1e-6, those flagged included */
    uint64_t normals_ill;      /* neither measured nor flagged, as they are not well conditioned */
    double worst_ulp;
    double worst_normal_deg;              /* over the well-conditioned that are not flagged */
    qp_stress_sample worst, worst_normal; /* of the first sample that is not finite, else of worst_ulp */
    qp_stress_sample missing;             /* the first of normals_missing */
} qp_stress_report;

/* Evaluates the case in frames on the device and adds to *report, which starts zeroed. each, unless NULL, is called with every
 * sample in turn. */
qp_status qp_stress_measure(const qp_stress_case *tried, uint32_t number, qp_device *device,
                            qp_precision precision, qp_stress_report *report,
                            void (*each)(void *context, const qp_stress_sample *sample), void *context,
                            qp_error *err);

/* ---- Shapes (stress_shapes.c) ---- */

/* n sectors of `rings` x `rings` quads about vertex 0, which is interior or, `open`, on the boundary. rough: heights at random
 * instead of a dome. */
qp_status qp_stress_fan(uint32_t n, uint32_t rings, bool open, double rough, qp_random *random,
                        qp_mesh **mesh, qp_error *err);
/* A mesh to put tags on: torus, fan, prism or random. Without tags of its own but for the last. */
qp_status qp_stress_shape(uint32_t number, qp_random *random, qp_mesh **mesh, qp_error *err);
/* Faces with vertices at random: edges of many faces, faces that run against each other, vertices of several fans. */
qp_status qp_stress_nonmanifold(qp_random *random, qp_mesh **mesh, qp_error *err);

/* Tags to add to a mesh. */
typedef struct qp_stress_tags {
    uint32_t chains, length;    /* creases along paths of edges */
    uint32_t corners;           /* single vertices */
    uint32_t holes, first_hole; /* faces one after another, from this one on or (QP_NONE) from any */
    float (*sharpness)(qp_random *, void *); /* called once an edge, or once a chain where `constant` */
    bool constant;
    void *context;
    int rules; /* index of boundary (3), crease method (2) and triangle rule (2), or -1: as they are */
} qp_stress_tags;
qp_status qp_stress_tag(qp_mesh **mesh, const qp_stress_tags *tags, qp_random *random, qp_error *err);
/* Makes the mesh anew after its positions were changed in place. */
qp_status qp_stress_moved(qp_mesh **mesh, qp_error *err);

#endif
