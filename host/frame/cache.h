/* The subdivision cache (section 8.2 of the paper): control points kept from patch to patch, from evaluation to evaluation and from
 * frame to frame (kernels/cached_hull.cl). The hull stage takes from it what is there and computes the rest; both go to scratch, from
 * which the domain stage reads as ever. */
#ifndef QP_FRAME_CACHE_H
#define QP_FRAME_CACHE_H

#include "host/device/device.h"
#include "host/frame/unique.h"

struct qp_frame;
struct qp_frame_batch;

/* Of a frame; zero-initialised. */
typedef struct qp_cache {
    qp_unique *unique;           /* the points of the plans that are on the device */
    uint32_t places, sets, ways; /* room for how many points; sets of ways each, with a bounded policy */
    qp_buffer numbers, control, tags, points, seen; /* kernels/cache_layout.h */
    qp_buffer list;                                 /* numbers to forget */
    bool ready;           /* tags and seen hold what they should; else the cache is to begin anew */
    uint32_t now;         /* of the shadow */
    uint64_t valid;       /* points that it holds */
    uint64_t invalidated; /* since the last report */
    void *positions;      /* as they are on the device */
    size_t position_bytes;
} qp_cache;

/* Does the frame have one? */
bool qp_frame_is_cached(const struct qp_frame *frame);

/* The plans on the device are new: numbers their points. What the cache holds of the frame's own surface stays, points of deeper plans go.
 * Takes *pack and *rings as qp_unique_create does. Errors: QP_SYSTEM. */
qp_status qp_cache_number(struct qp_frame *frame, qp_plan_pack *pack, uint32_t **rings, qp_error *err);
/* Where a patch of the layout begins in the table of numbers, UINT64_MAX for nowhere. */
uint64_t qp_cache_first(const struct qp_frame *frame, uint32_t patch);
/* Before the batches of an evaluation. */
qp_status qp_cache_begin(struct qp_frame *frame, qp_error *err);
/* Starts the hull stage of a batch; the time goes to *ms (device.h). */
qp_status qp_cache_launch(struct qp_frame *frame, const struct qp_frame_batch *batch, double *ms,
                          qp_error *err);
/* After all batches are done: what happened, in *report. */
qp_status qp_cache_report(struct qp_frame *frame, qp_supports_report *report, qp_error *err);
/* The device is about to get these positions (kernels/frame_layout.h), `bytes` of them: forgets the points that depend on a vertex
 * which has other bits than before. */
qp_status qp_cache_move(struct qp_frame *frame, const void *positions, size_t bytes, qp_error *err);
/* An evaluation failed: what the cache holds is not to be trusted. */
void qp_cache_distrust(struct qp_frame *frame);
void qp_cache_free(struct qp_frame *frame);

#endif
