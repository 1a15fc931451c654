/* What a ring buffer of some size does to a GPU's tessellation pipeline: a model (section 8.1 of the paper).
 *
 * Patches are issued in order to `sms` processors, each of which has room for `warps` of them. A patch
 *   takes a slot and its place on the ring, as soon as both are free (the next patch is not looked at before),
 *   waits `latency` cycles,
 *   runs its hull: weights / hull_rate cycles of an SM,
 *   has its (u,v) made by a tessellator, one patch after the other as they come: samples / tessellator_rate cycles,
 *   runs its domain stage: samples / domain_rate cycles of an SM,
 *   and retires: its place on the ring is free once all older patches are done as well.
 * In order, a patch keeps its slot until it retires; out of order, until it is done. A patch without control points needs no
 * place and passes all but the tessellator and the domain stage.
 *
 * The ring is that of kernels/ring.h, rule for rule: a patch's points lie in one piece, what is too short for them at the end is skipped
 * and given back with them, and when the ring is empty it begins anew at its start.
 *
 * Slots of an SM share it (processor sharing). It takes `fill` patches at work to use all of it, as one warp waits most of the time: with
 * n of them at work each gets 1 / max(n, fill) of the SM. So a patch that is alone is `fill` times slower than the SM, up to `fill` patches
 * do not disturb each other, and beyond that the SM is full and they share it alike. A warp scheduler that goes round makes just that, for
 * stages that are long against one instruction. With fill = warps, the default and what the paper assumes when it asks for 12 warps an SM,
 * every slot that stands idle costs its full share of the throughput: the hardest case for a ring.
 *
 * The simulation jumps from event to event and is exact up to the rounding of a double; what happens at one time happens in order of
 * issue, so that results are the same on every machine. */
#ifndef QP_FRAME_PIPELINE_H
#define QP_FRAME_PIPELINE_H

#include "host/plan/plan.h"

/* What one patch asks of the pipeline. */
typedef struct qp_patch_work {
    uint32_t patch;   /* in ptex order */
    uint32_t points;  /* control points its hull makes, 0: none */
    uint32_t ring;    /* base vertices each is a sum over */
    uint32_t samples; /* vertices its domain stage evaluates */
} qp_patch_work;

/* The patches of a tessellation, malloced in *work: in order of patches, or, by_plan, of their plans as `eval` issues them. Regular
 * patches, which evaluate their base vertices themselves, get regular_points points (0, or 16 where hardware copies them) of one vertex each.
 * With a tolerance the factors are chosen for it. Errors: as qp_frame_eval. */
qp_status qp_patch_work_list(const qp_surface *surface, const qp_tessellation *tessellation,
                             uint32_t regular_points, bool by_plan, qp_patch_work **work, size_t *count,
                             qp_error *err);

typedef struct qp_machine {
    uint32_t sms, warps;     /* processors; slots of each */
    uint32_t fill;           /* patches at work that use all of an SM; 0: warps */
    uint32_t point_bytes;    /* of a control point */
    double hull_rate;        /* weights (a point times a base vertex) a cycle and SM */
    double tessellator_rate; /* (u,v) a cycle and unit; 0: it takes no time */
    bool tessellator_shared; /* one unit for all, else one an SM */
    double domain_rate;      /* vertices a cycle and SM */
    double latency;          /* cycles */
    bool out_of_order;       /* retirement */
} qp_machine;

/* The paper's: 16 SMs x 12 warps, 16 bytes a point, in order. The rates are those of one SM of that time: 128 lanes, four instructions a
 * weight (load, three fma), some 300 a vertex, and a tessellator that makes a point every other cycle. */
#define QP_MACHINE_PAPER                                                                                     \
    {                                                                                                        \
        .sms = 16, .warps = 12, .point_bytes = 16, .hull_rate = 32, .tessellator_rate = 0.5,                 \
        .domain_rate = 0.4, .latency = 100                                                                   \
    }

enum { QP_LIVE_BINS = 256 };

typedef struct qp_pipeline_result {
    double cycles;       /* until the last patch has retired */
    double stall_cycles; /* in which the next patch had a slot but no room on the ring */
    double occupancy;    /* mean share of the slots with a patch that is not done */
    uint64_t stalls;     /* patches that had to wait for room */
    uint64_t allocations, allocated_bytes;
    uint64_t peak_bytes;   /* allocated and not given back, at most */
    uint64_t wraps;        /* times the ring began anew at its start */
    uint64_t wasted_bytes; /* skipped at its end, all together */
    uint32_t in_flight;    /* most slots that were taken at one time */
    /* Most live bytes in each of live_bins equal intervals. */
    double live_cycles; /* of an interval; a power of two */
    uint32_t live_bins; /* at most QP_LIVE_BINS; the last one may reach beyond the end */
    uint64_t live_bytes[QP_LIVE_BINS];
} qp_pipeline_result;

/* When things happened to a patch, in cycles. */
typedef struct qp_patch_times {
    uint32_t sm;
    double allocated, hulled, tessellated, done, retired;
} qp_patch_times;

/* Largest place that any of the patches takes. */
uint64_t qp_pipeline_largest_bytes(const qp_patch_work *work, size_t count, const qp_machine *machine);

/* Runs the patches through. ring_bytes 0: scratch without limits. times: [count] or NULL. Takes O(count (sms + warps + log count)).
 * Errors: QP_BAD_INPUT for a machine that cannot be (nothing, or a rate that is not a number above 0) and for a ring that cannot hold the
 * largest patch; QP_SYSTEM for memory. */
qp_status qp_pipeline_run(const qp_patch_work *work, size_t count, const qp_machine *machine,
                          uint64_t ring_bytes, qp_pipeline_result *result, qp_patch_times *times,
                          qp_error *err);

/* A ring, a multiple of `step` bytes or as large as all patches together, with at least `share` (0 to 1) of the throughput of unlimited scratch, while one that is a step smaller
 * has less or cannot hold the largest patch. Found by bisection, so that it is the smallest one where throughput grows with the ring; where
 * it wavers (a place that is skipped may come at a better or worse time) there may be smaller ones. 0 where no patch needs a ring. Errors: as qp_pipeline_run. */
qp_status qp_pipeline_smallest_ring(const qp_patch_work *work, size_t count, const qp_machine *machine,
                                    double share, uint64_t step, uint64_t *ring_bytes, qp_error *err);

#endif
