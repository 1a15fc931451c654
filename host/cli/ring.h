/* quadplan ring, inside: what it finds out, and who prints it. */
#ifndef QP_CLI_RING_H
#define QP_CLI_RING_H

#include "host/cli/supports.h"
#include "host/cli/views.h"
#include "host/frame/pipeline.h"

enum { RING_HISTOGRAM_MOST = 64, RING_VALIDATION_MOST = 8 };

typedef struct ring_row {
    uint64_t ring_bytes;
    double relative_throughput;  /* scratch's cycles over this ring's */
    bool fits;                   /* false: it cannot hold the largest patch, and nothing ever gets through */
    qp_pipeline_result pipeline; /* zeros where it does not fit */
} ring_row;

/* One ring, as the model has it and as it was measured. Times are in milliseconds. */
typedef struct ring_validation {
    uint64_t ring_bytes;
    double model_ms, measured_ms;
    double model_relative, measured_relative; /* throughput, relative to the largest ring */
    double model_stall_ms, measured_stall_ms;
    uint64_t model_stalls, measured_stalls, model_peak_bytes, measured_peak_bytes;
    uint64_t model_wraps, measured_wraps;
    uint32_t model_in_flight, measured_in_flight;
} ring_validation;

typedef struct ring_run {
    const char *name; /* of the mesh or scene */
    const qp_tessellation *tessellation;
    double factor; /* 0: chosen within a tolerance, or at random */
    const char *machine_name;
    qp_machine machine;
    int issue;               /* index into CLI_ISSUE_ORDERS */
    uint32_t regular_points; /* of a regular patch */
    size_t n_work;
    qp_patch_work *work;
    uint64_t with_points, points, samples; /* patches that have control points; sums */
    double weights;
    uint64_t largest_bytes, worst_case_bytes;
    uint64_t at_once;        /* slots, or patches with points where they are fewer */
    uint64_t estimate_bytes; /* as the paper estimates: at_once x mean points x bytes */
    uint32_t histogram_width,
        histogram_bins; /* patches by control points: bin i has those of [i, i + 1) x width */
    uint64_t histogram[RING_HISTOGRAM_MOST];
    qp_pipeline_result scratch, at_smallest;
    uint64_t smallest_bytes; /* with 99 percent of scratch's throughput */
    size_t n_rows;
    ring_row *rows;
    size_t n_validation; /* 0: not asked for */
    ring_validation validation[RING_VALIDATION_MOST];
    unsigned validation_slots;
    double validation_hull_ns, validation_domain_ns, validation_patch_ns; /* a weight, a vertex, a patch */
} ring_run;

/* ring_out.c; of a ring_run */
void ring_write_table(const void *run, FILE *file);
void ring_write_json(const void *run, FILE *file);
void ring_write_csv(const void *run, FILE *file);

/* ring_validate.c: runs the fused kernel on the host and the model beside it. */
qp_status ring_validate(ring_run *run, const cli_views *views, qp_error *err);

#endif
