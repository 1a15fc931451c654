/* One frame, inside: what is to be evaluated (layout), and how it is cut up for the device (batches). */
#ifndef QP_FRAME_FRAME_H
#define QP_FRAME_FRAME_H

#include "host/device/device.h"
#include "host/frame/cache.h"
#include "host/frame/ring_buffer.h"
#include "host/frame/layout.h"
#include "host/frame/tolerance.h"
#include "host/plan/plan.h"

#include <float.h>
#include <math.h>

/* A run of items whose samples fit a buffer of the device, and whose control points fit the scratch buffer.
 */
typedef struct qp_frame_batch {
    uint64_t first_sample, n_samples;
    uint32_t first_general, n_general, first_regular, n_regular; /* entries */
    uint64_t points;                                             /* control points, all held at once */
    qp_buffer vertices, flags, derivatives;
} qp_frame_batch;

/* Steps of depth in which plans deeper than the surface's are made on demand (plans.c). */
enum { QP_DEEP_STEPS = 4 };
/* All steps: behind those, shallower ones, for points with a tolerance (light.c). */
enum { QP_PLAN_STEPS = QP_DEEP_STEPS + 5, QP_LIGHT_NONE = 255 };

struct qp_frame {
    qp_device *device;
    const qp_surface *surface;
    qp_frame_options options;
    size_t real_size;
    qp_program program;
    bool built;          /* program is, for plans with plan_flags */
    uint32_t plan_flags; /* QP_PLAN_* */
    qp_buffer heads, trees, reals, rings, positions; /* of the surfaces */
    bool plans_uploaded;
    qp_surface *deep[QP_PLAN_STEPS]; /* deeper (and shallower) plans, for the patches that ever needed them; NULL: none */
    uint8_t *patch_step;             /* [n_patches] of the layout: 0 the surface's plans, s those of deep[s - 1]; NULL: all 0 */
    uint32_t n_plans, first_plan[1 + QP_PLAN_STEPS]; /* on the device; those of each step */
    uint64_t first_ring[1 + QP_PLAN_STEPS];
    uint8_t *light;     /* [n_patches] step within the tolerance of options, QP_LIGHT_NONE: none is; NULL: not yet chosen */
    double light_bound; /* of their errors, of the diagonal */
    qp_buffer entries, grid_u, grid_v, support;      /* of the layout */
    qp_ring_buffer ring;                             /* in place of support, where the frame is fused */
    qp_cache cache;                                  /* with supports of that kind */

    qp_frame_layout layout;
    bool tessellated; /* layout is of the tessellation below, and everything is uploaded */
    qp_tessellation tessellation;
    float *patch_factors; /* copy, or NULL */
    float *edge_factors;  /* likewise; not those from a tolerance */
    qp_tolerance_report tolerance; /* of the tessellation, where it has a tolerance */
    qp_share *share;      /* NULL with no_sharing */
    size_t n_batches;
    qp_frame_batch *batches;
    uint64_t peak_points; /* of the batch with most of them */
    uint64_t all_points, largest_points, peak_patches; /* of all batches, of one patch; patches of the fullest batch that have points */
    double processor_ms; /* of all threads, in what the last stream's frame_ms covers; for benchmarks */

    void *vertices; /* the stream's, page-aligned; grows only */
    size_t vertex_bytes;
    uint8_t *flags;
    size_t flag_bytes;
    void *derivatives;
    size_t derivative_bytes;
    void *ordered; /* vertices, derivatives and flags in the caller's order, where that differs */
    size_t ordered_bytes;
};

/* clang-format off */
/* What the arguments of every kernel for general patches begin with: plans, base vertices, entries. */
#define QP_ARGS_PLANS(frame)                                                                                 \
    {&(frame)->heads, 0}, {&(frame)->trees, 0}, {&(frame)->reals, 0}, {&(frame)->rings, 0},                  \
    {&(frame)->positions, 0}, {&(frame)->entries, 0}
/* What those of every kernel that makes samples end with: grids, and where a batch's samples go. Any buffer will do for derivatives
 * that are not written. */
#define QP_ARGS_SAMPLES(frame, batch)                                                                        \
    {&(frame)->grid_u, 0}, {&(frame)->grid_v, 0}, {&(batch)->vertices, 0}, {&(batch)->flags, 0},             \
    {(frame)->options.want_derivatives ? &(batch)->derivatives : &(batch)->vertices, 0},                     \
    {NULL, (frame)->options.want_derivatives != 0}
/* clang-format on */

/* How a patch of the layout is evaluated: its plan, its index in heads, and where its 1-ring begins in rings. */
typedef struct qp_frame_plan {
    const qp_plan *plan;
    uint32_t index;
    uint8_t rotation;
    uint64_t ring;             /* first word in rings on the device */
    const qp_surface *surface; /* whose plan it is */
} qp_frame_plan;
qp_frame_plan qp_frame_plan_of(const qp_frame *frame, uint32_t patch);
/* Control points that an item's samples need, of the general kernels. */
static inline uint32_t qp_frame_rows(const qp_frame *frame, const qp_frame_item *item) {
    return qp_item_rows(qp_frame_plan_of(frame, item->patch).plan, item);
}

/* Chooses the plans for the layout's samples (of points: within the tolerance of the options, if any), makes deeper ones where they are needed, and uploads what is new. To be called for
 * every layout before qp_frame_upload_layout. */
qp_status qp_frame_deepen(qp_frame *frame, bool points, qp_error *err);
/* The same in pieces: begin; add every layout of the evaluation (as frame->layout), none of which is uploaded; end. */
qp_status qp_frame_begin_steps(qp_frame *frame, qp_error *err);
qp_status qp_frame_add_steps(qp_frame *frame, qp_error *err);
qp_status qp_frame_end_steps(qp_frame *frame, qp_error *err);
/* Level to which the plans of a step go, 1 .. QP_PLAN_STEPS. */
uint32_t qp_step_level(uint8_t step);
/* Makes frame->deep[step - 1] hold every patch whose patch_step is `step`; sets *changed when it did not before. */
qp_status qp_frame_grow_step(qp_frame *frame, uint8_t step, bool *changed, qp_error *err);
/* Chooses frame->light for the tolerance of the options, unless it is chosen. Uses patch_step. Errors: QP_SYSTEM for memory. */
qp_status qp_frame_choose_light(qp_frame *frame, bool *changed, qp_error *err);
void qp_frame_drop_deep(qp_frame *frame);
/* rings.c: the 1-rings on the device. */
/* The words go to *words as well, malloced. */
qp_status qp_frame_upload_rings(qp_frame *frame, const qp_surface *const *surfaces, uint32_t n_surfaces,
                                uint32_t **words, qp_error *err);
/* Base vertex that a patch is relative to: what its plan's base is anchored to. */
uint32_t qp_frame_origin(const qp_surface *surface, uint32_t patch);
/* First word of a patch of a surface there, and the words of all (QP_RING_WORDS). */
static inline uint64_t qp_frame_ring_word(const qp_surface *surface, uint32_t patch) {
    return 2 * surface->patch_ring[patch] + 4 * (uint64_t)patch;
}
static inline uint64_t qp_frame_ring_words(const qp_surface *surface) {
    return 2 * surface->ring_entries + 4 * (uint64_t)surface->mesh->n_patches;
}

/* Builds the kernels and uploads the plans of all surfaces. */
qp_status qp_frame_upload_plans(qp_frame *frame, qp_error *err);
/* Room for `bytes` in a buffer, and their copy there. */
qp_status qp_frame_upload(qp_frame *frame, qp_buffer *buffer, const void *from, size_t bytes,
                          const char *what, qp_error *err);

/* Cuts the layout into batches and uploads it. */
qp_status qp_frame_upload_layout(qp_frame *frame, qp_error *err);
/* What is known before the kernels run of an evaluation of the layout that is uploaded, and holds for scratch; of other kinds, those
 * who evaluate them put in what differs. */
qp_supports_report qp_frame_scratch_report(const qp_frame *frame);
/* Evaluates the layout that is uploaded. */
qp_status qp_frame_evaluate(qp_frame *frame, bool want_hash, qp_stream *stream, qp_error *err);
/* The factors of a tolerance in *edges, malloced, and in frame->tolerance what is known of them; NULL without one. */
qp_status qp_frame_factors_within(qp_frame *frame, const qp_tessellation *tessellation, float **edges, qp_error *err);
/* Puts that into a stream. */
void qp_frame_report_tolerance(const qp_frame *frame, qp_stream *stream);
/* Frees the stream's memory; no layout may be uploaded. */
void qp_frame_drop_stream(qp_frame *frame);
/* Frees what qp_frame_upload_layout made, buffers that can be used again apart. */
void qp_frame_drop_layout(qp_frame *frame);

/* A coordinate in [0,1] as the device holds it (kernels/frame_layout.h), in the frame's precision: by the distance to the nearer
 * end, with the sign bit set for 1. One that has the sign bit is signed already. */
static inline double qp_signed_coordinate(double x, qp_precision precision) {
    double s = x <= 0.5 || signbit(x) != 0 ? x : -(1.0 - x);
    if (precision == QP_FLOAT) s = (double)(float)s;
    /* Some devices flush denormal numbers: all take them for the end itself. */
    if (fabs(s) < (precision == QP_FLOAT ? (double)FLT_MIN : DBL_MIN)) s = copysign(0.0, s);
    return s == -0.5 ? 0.5 : s;
}

/* A coordinate of the layout's grids, likewise. */
static inline double qp_frame_coordinate(const qp_frame *frame, double x) {
    return qp_signed_coordinate(x, frame->options.precision);
}

/* Is this patch evaluated by the fast pass? */
static inline bool qp_frame_is_fast(const qp_frame *frame, uint32_t patch) {
    return !frame->options.no_regular_pass &&
           frame->surface->patch_plan[patch] == frame->surface->regular_plan;
}

#endif
