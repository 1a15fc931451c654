/* Is a tessellated vertex stream watertight, to the bit? Checked from the mesh's faces and the stream alone, by other code than that
 * which makes it so (host/frame). */
#ifndef QP_REFERENCE_WATERTIGHT_H
#define QP_REFERENCE_WATERTIGHT_H

#include "host/mesh/mesh.h"

typedef struct qp_watertight_report {
    uint64_t edges;   /* edges of faces and spokes of n-gons at which two patches or more met */
    uint64_t samples; /* samples on the perimeters of patches, all compared with those at the same place */
    /* Samples whose bits differ from those of the first at their place. Normals (with the flag for "none") are compared where
     * edge and vertex are smooth; at creases and boundaries among the faces on one side. */
    uint64_t position_mismatches, normal_mismatches;
    uint64_t unmatched_samples; /* samples at which a patch on the same edge has none */
    uint64_t
        sharp_edges_skipped; /* of `edges`: infinitely sharp ones, across which normals are not compared */
    double
        worst_ulp; /* largest position mismatch, in units in the last place of the sample's largest coordinate */
    uint32_t
        worst_patch; /* a patch with the first mismatch or unmatched sample, QP_NONE without one, and where */
    float worst_u, worst_v;
} qp_watertight_report;

/* The stream must come from qp_frame_eval, so that uv are the coordinates themselves. Errors: QP_BAD_INPUT for a stream that is not of
 * this mesh, QP_SYSTEM for memory. */
qp_status qp_watertight_check(const qp_mesh *mesh, const qp_stream *stream, qp_watertight_report *report,
                              qp_error *err);
/* Do all counts say "watertight"? */
bool qp_watertight_holds(const qp_watertight_report *report);

#endif
