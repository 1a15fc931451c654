/* quadplan: exact evaluation of Catmull-Clark subdivision surfaces by adaptive quadtrees.
 *
 * The method is that of Brainerd, Foley, Kraemer, Moreton and Niessner, "Efficient GPU Rendering of
 * Subdivision Surfaces Using Adaptive Quadtrees" (ACM TOG 35(4), SIGGRAPH 2016); section numbers below are
 * that paper's.
 *
 * How a program uses it:
 *   qp_mesh_read_obj / qp_mesh_create   a base mesh, with tags, checked and analysed
 *   qp_surface_create                   its patches and their subdivision plans
 *   qp_device_open                      an OpenCL device, or the host itself
 *   qp_frame_create, qp_frame_eval      the vertex stream for given tessellation factors
 *
 * Conventions: every function that can fail returns a qp_status and, on failure, fills *err (which may be
 * NULL) with one line of text. Handles are owned by the caller and freed by the matching _free, which accepts
 * NULL. Right-handed coordinates in the units of the mesh; faces counter-clockwise seen from outside. A
 * handle may be used by one thread at a time; different handles are independent. */
#ifndef QUADPLAN_H
#define QUADPLAN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define QP_API __attribute__((visibility("default")))
#else
#define QP_API
#endif

#define QP_VERSION_MAJOR 0
#define QP_VERSION_MINOR 1
#define QP_VERSION_PATCH 0

/* Also the exit codes of the program. */
typedef enum qp_status {
    QP_OK = 0,
    QP_CHECK_FAILED = 1, /* a comparison did not hold */
    QP_BAD_INPUT = 2,    /* usage, file content, or an argument out of range */
    QP_SYSTEM = 3        /* memory, files that cannot be written, OpenCL, GL */
} qp_status;

typedef struct qp_error {
    qp_status status;
    char message[480]; /* one line, without a newline */
} qp_error;

/* ---- Base mesh -------------------------------------------------------------------------------------------
 */

/* Sharpness at or above this is infinite (OpenSubdiv's constant). */
#define QP_SHARPNESS_INFINITE 10.0f
/* "no element" in every index array. */
#define QP_NONE UINT32_MAX

typedef enum qp_boundary { /* numbered as OpenSubdiv's interpolateboundary tag */
                           QP_BOUNDARY_NONE = 0,
                           QP_BOUNDARY_EDGE_AND_CORNER = 1,
                           QP_BOUNDARY_EDGE_ONLY = 2
} qp_boundary;
typedef enum qp_crease_method { QP_CREASE_UNIFORM = 0, QP_CREASE_CHAIKIN = 1 } qp_crease_method;
typedef enum qp_triangle_rule { QP_TRIANGLE_CATMARK = 0, QP_TRIANGLE_SMOOTH = 1 } qp_triangle_rule;

/* Zero-initialise for "as the file says, else the defaults" (edge-only, uniform, catmark). */
typedef struct qp_mesh_options {
    int override_boundary; /* 1: use .boundary whatever the file says; likewise below */
    qp_boundary boundary;
    int override_crease_method;
    qp_crease_method crease_method;
    int override_triangle_rule;
    qp_triangle_rule triangle_rule;
    /* Called once per warning with one line of text; NULL: warnings are dropped. */
    void (*warn)(void *context, const char *line);
    void *warn_context;
} qp_mesh_options;

typedef struct qp_mesh qp_mesh;

/* Reads a Wavefront OBJ file with OpenSubdiv's tag lines ("t crease 2/1/0 a b s" ...).
 * Refuses with QP_BAD_INPUT, naming file and line, what is not a mesh. */
QP_API qp_status qp_mesh_read_obj(const char *path, const qp_mesh_options *options, qp_mesh **mesh,
                                  qp_error *err);

/* The same from memory; name is what messages call it. text need not end in a NUL. */
QP_API qp_status qp_mesh_parse_obj(const char *name, const char *text, size_t length,
                                   const qp_mesh_options *options, qp_mesh **mesh, qp_error *err);

/* Topology and tags as arrays; all are copied. Vertices of face f are face_vertices[sum of face_sizes before
 * f ...]. */
typedef struct qp_mesh_desc {
    uint32_t n_vertices, n_faces;
    const double *positions;       /* 3 a vertex */
    const uint32_t *face_sizes;    /* n_faces */
    const uint32_t *face_vertices; /* sum of face_sizes, counter-clockwise */
    uint32_t n_creases;
    const uint32_t *crease_vertices; /* 2 a crease: the edge's end points */
    const float *crease_sharpness;
    uint32_t n_corners;
    const uint32_t *corner_vertices;
    const float *corner_sharpness;
    uint32_t n_holes;
    const uint32_t *hole_faces;
    qp_boundary boundary;
    qp_crease_method crease_method;
    qp_triangle_rule triangle_rule;
} qp_mesh_desc;
QP_API qp_status qp_mesh_create(const qp_mesh_desc *desc, qp_mesh **mesh, qp_error *err);

QP_API void qp_mesh_free(qp_mesh *mesh);
QP_API uint32_t qp_mesh_vertex_count(const qp_mesh *mesh);
QP_API uint32_t qp_mesh_face_count(const qp_mesh *mesh);
/* Patches in ptex order: one for a quad, n for an n-gon; faces that are holes included. */
QP_API uint32_t qp_mesh_patch_count(const qp_mesh *mesh);
/* 3 doubles a vertex, owned by the mesh. */
QP_API const double *qp_mesh_positions(const qp_mesh *mesh);
/* Edges, numbered by the mesh; the two vertices of each, lower index first: 2 an edge, owned by the mesh. */
QP_API uint32_t qp_mesh_edge_count(const qp_mesh *mesh);
QP_API const uint32_t *qp_mesh_edge_vertices(const qp_mesh *mesh);

/* ---- Surfaces: patches and their subdivision plans
 * --------------------------------------------------------- */

/* Deepest level that plans store. Below it the rings around a corner shrink by one ratio to working precision. */
#define QP_DEPTH_LIMIT 60

/* Zero-initialise for the defaults. */
typedef struct qp_surface_options {
    uint32_t
        depth; /* deepest subdivision level a plan stores, 1..QP_DEPTH_LIMIT; 0: 10. The paper's is 6 (factor 64). Frames make
                  deeper plans by themselves for the patches whose samples lie below, so this is about time and memory only. */
    int no_crease_nodes;   /* subdivide along single semi-sharp creases instead (for comparison) */
    int no_terminal_nodes; /* internal nodes instead of terminal ones (for comparison) */
} qp_surface_options;

typedef struct qp_surface qp_surface;

/* Builds the plan of every configuration in the mesh, in parallel. The surface keeps a pointer to the mesh,
 * which must outlive it, and reads topology and tags only: positions are read when a frame is evaluated. */
QP_API qp_status qp_surface_create(const qp_mesh *mesh, const qp_surface_options *options,
                                   qp_surface **surface, qp_error *err);
QP_API void qp_surface_free(qp_surface *surface);

#define QP_INFO_LEVELS 7
typedef struct qp_surface_info {
    uint64_t vertices, faces, patches, regular_faces, irregular_faces, irregular_patches;
    uint64_t plans;    /* the regular one counts as one when it is used */
    uint64_t nodes;    /* quadtree nodes over all plans */
    uint64_t stencils; /* stencil rows over all plans */
    uint64_t quadtree_bytes, stencil_bytes;
    uint64_t control_points[QP_INFO_LEVELS]; /* per level 0..6: padded to 4 a patch, summed over irregular
                                                patches */
    uint64_t unique_control_points[QP_INFO_LEVELS]; /* de-duplicated over the mesh */
    uint64_t scratch_bytes; /* worst-case scratch at the deepest level, 16 bytes a point */
    double build_ms;        /* building of plans, wall clock */
} qp_surface_info;
QP_API qp_status qp_surface_get_info(const qp_surface *surface, qp_surface_info *info, qp_error *err);

/* ---- Devices
 * ------------------------------------------------------------------------------------------------ */

typedef enum qp_precision { QP_FLOAT = 0, QP_DOUBLE = 1 } qp_precision;

typedef struct qp_device qp_device;

/* which: NULL or "" for the default (environment variable QUADPLAN_DEVICE; else PoCL's CPU device; else the first
 * that has double and rounds correctly; else the first), "host" for the kernels compiled as C into the library, a
 * number "P.D" (platform.device), or part of a device's name. */
QP_API qp_status qp_device_open(const char *which, qp_device **device, qp_error *err);
QP_API void qp_device_free(qp_device *device);
/* Name, owned by the device. */
QP_API const char *qp_device_name(const qp_device *device);
QP_API int qp_device_has_double(const qp_device *device);

/* ---- Where control points live between hull and domain (sections 4 and 8 of the paper)
 * -------------------------------------------------------------------------------------------------- */

/* All kinds give the same bits. */
typedef enum qp_supports_kind {
    QP_SUPPORTS_SCRATCH =
        0, /* a place of its own for every patch of a launch: the worst case (section 4.3) */
    QP_SUPPORTS_RING =
        1, /* a ring buffer, allocated by the hull stage and released by the domain stage (section 8.1) */
    QP_SUPPORTS_CACHE =
        2 /* scratch, filled from a cache of control points that is kept between evaluations (section 8.2) */
} qp_supports_kind;

typedef enum qp_schedule {
    QP_SCHEDULE_FUSED = 0, /* a patch's work-group runs hull and then domain */
    QP_SCHEDULE_STREAMED =
        1 /* launches of the hull stage fill the ring, launches of the domain stage drain it, overlapped */
} qp_schedule;

typedef enum qp_retirement {
    QP_RETIRE_IN_ORDER =
        0, /* a patch keeps its place, and its work-group, until all patches issued before it are done */
    QP_RETIRE_OUT_OF_ORDER =
        1 /* a patch ends when it is done; its part of the ring is free once all older parts are */
} qp_retirement;

typedef enum qp_issue_order {
    QP_ISSUE_BY_PLAN = 0, /* patches of one plan follow each other, whose stencils then stay in caches */
    QP_ISSUE_BY_PATCH = 1 /* in the order of the mesh, as a rasterizer that keeps order has it */
} qp_issue_order;

typedef enum qp_cache_policy {
    QP_CACHE_ALL =
        0, /* the paper's: a place for every distinct control point, and a valid bit each; cache_bytes is not used */
    QP_CACHE_DIRECT = 1, /* bounded, direct-mapped */
    QP_CACHE_CLOCK = 2,  /* bounded, set-associative, second chance (clock) within a set */
    QP_CACHE_SHARED =
        3 /* clock, but a point stays until as many patches have asked for it as share it, and one of a single patch drives none out */
} qp_cache_policy;

/* Zero-initialise for scratch. */
typedef struct qp_supports_options {
    qp_supports_kind kind;
    uint64_t
        ring_bytes; /* of QP_SUPPORTS_RING: at least what the largest patch of an evaluation needs, else QP_BAD_INPUT says how much
                            that is; no ring is needed where no patch needs one */
    qp_schedule schedule;
    qp_retirement retirement;
    qp_issue_order issue_order;
    uint64_t cache_bytes; /* of QP_SUPPORTS_CACHE, with the bounded policies: points and tags together */
    qp_cache_policy cache_policy;
    int canaries; /* a pattern around the ring and between its allocations is checked; an overrun ends in QP_CHECK_FAILED */
    int trace; /* the stream gets a trace */
} qp_supports_options;

/* What happened to the control points of one evaluation, counted by the kernels. Bytes are of control points (4 reals each) unless
 * said otherwise. */
typedef struct qp_supports_report {
    qp_supports_kind kind;
    uint64_t capacity_bytes;   /* of the scratch, the ring or the cache */
    uint64_t worst_case_bytes; /* scratch for all patches of the evaluation at once */
    uint64_t largest_bytes;    /* of one patch */
    uint64_t
        peak_bytes; /* most that were allocated and not yet released at one time; of a cache, that were valid */
    uint64_t allocations, allocated_bytes;
    /* Ring. */
    uint64_t
        stalls; /* allocations that had to wait for room; in the streamed schedule launches of the hull stage that had to */
    double
        stall_ms; /* how long they waited, all together; 0 where the device has no clock that kernels can read */
    uint64_t wraps;        /* times the ring began anew at its start */
    uint64_t wasted_bytes; /* skipped at its end, all together (fragmentation) */
    uint64_t in_flight;    /* most patches at one time */
    /* Cache, in control points. */
    uint64_t points_needed;   /* asked for by patches */
    uint64_t points_computed; /* hulls of scratch and ring compute all they need */
    uint64_t hits, misses_cold, misses_capacity, misses_conflict;
    uint64_t duplicates;  /* of points_computed: by two work-groups at the same time */
    uint64_t invalidated; /* points that positions which have moved made invalid, before this evaluation */
    uint64_t index_bytes; /* of the cache's tables, apart from capacity_bytes */
} qp_supports_report;

/* Ticks of a patch on its way; .. of the clock that qp_trace names. */
typedef struct qp_trace_patch {
    uint32_t patch; /* in ptex order */
    uint32_t
        slot; /* lowest warp slot that was free when it began; in the streamed schedule of the hull's slots */
    uint32_t points, samples;
    uint64_t start, allocated, hulled, done, retired;
} qp_trace_patch;

typedef struct qp_trace {
    uint64_t n_patches;
    const qp_trace_patch *patches; /* in the order they were issued */
    double ticks_per_ms;           /* 0: ticks only count events, in their order */
} qp_trace;

/* ---- Frames
 * ------------------------------------------------------------------------------------------------- */

typedef enum qp_spacing { QP_EQUAL = 0, QP_FRACTIONAL_EVEN = 1, QP_FRACTIONAL_ODD = 2 } qp_spacing;

typedef struct qp_tessellation {
    qp_spacing spacing;
    float factor; /* uniform factor, 1 to 64, used when patch_factors is NULL */
    /* 6 a patch in ptex order: the GL quad domain's outer levels 0..3 (edges u=0, v=0, u=1, v=1), then the
     * inner levels (u, v). A factor <= 0 or NaN discards the patch, as GL does. Whoever gives them sees to it that both sides of
     * an edge get the same. */
    const float *patch_factors;
    /* 1 an edge of the mesh (qp_mesh_edge_vertices), 1 to 64, used when patch_factors is NULL; NULL: .factor everywhere. Patches
     * get factors without cracks from them, n-gons and their neighbours included: on an edge that an n-gon touches, equal and
     * fractional_even round the factor up to a power of two. With fractional_odd, which has no sample in the middle of an edge, quads that
     * an n-gon touches, and the quads connected with them, are tessellated as four quarters, each with half the factor; their samples
     * and triangles follow quarter after quarter: [0,1/2] x [0,1/2], [1/2,1] x [0,1/2], [0,1/2] x [1/2,1], [1/2,1] x [1/2,1]. */
    const float *edge_factors;
    /* 0: none. Otherwise, where both are NULL, the least factors (whole numbers, one an edge) with which no point of a triangle is
     * farther than this, times the diagonal of the mesh's bounding box, from the limit surface at the same (u,v); .factor is then
     * the largest one allowed, 0: 64. Chosen anew when it or the positions change, which takes some 0.1 ms a patch. */
    double tolerance;
} qp_tessellation;

enum {
    QP_SAMPLE_PAST_DEPTH =
        1, /* (u,v) lies below the plan's last level: an approximation was returned (only with
                                 no_exact_tail or within a frame's tolerance) */
    QP_SAMPLE_NO_NORMAL =
        2, /* no tangent plane there: the normal is that of the patch's middle, or z where it has none (or the factor is 1). Where du
                                 and dv are parallel or vanish, the normal is the limit from within the patch, if there is one */
    QP_SAMPLE_LIMIT_FRAME =
        4 /* at an extraordinary or creased corner, where du and dv need not exist: they are tangents from
                                 limit masks, which span the tangent plane with du x dv along the normal; lengths are free */
};

/* What an evaluation made. All arrays belong to the frame and live until its next evaluation or its end. */
typedef struct qp_stream {
    qp_precision precision;
    uint64_t n_samples;
    const void *vertices; /* 6 float or double a sample: position, unit normal (right-handed, du x dv) */
    const void *
        derivatives; /* 6 float or double a sample: dp/du, dp/dv in the patch's own (u,v); NULL unless asked for */
    const uint8_t *flags;         /* n_samples, QP_SAMPLE_* */
    const float *uv;              /* 2 a sample; of points, rounded from what was given */
    const uint32_t *sample_patch; /* n_samples */
    uint64_t n_triangles;
    const uint32_t *triangles; /* 3 sample indices a triangle, counter-clockwise; NULL unless asked for */
    double hull_ms, domain_ms, frame_ms; /* of this evaluation; frame_ms is the whole without set-up */
    uint64_t support_bytes;              /* control points held */
    uint64_t hash;                       /* of the bytes of vertices; 0 unless asked for */
    double
        bound; /* with a tolerance: proven bound of the error of the triangles, or of points, of the diagonal, rounding
                                included; 0 without one */
    uint64_t
        over_tolerance; /* patches whose bound is larger than the tolerance, as not even the largest factor is enough */
    float factor_min, factor_mean, factor_max; /* with a tolerance: of the edges */
    qp_supports_report supports;
    const qp_trace *trace; /* NULL unless asked for */
} qp_stream;

typedef struct qp_frame_options {
    qp_precision precision;
    int want_triangles, want_hash;
    int want_derivatives;
    int no_regular_pass; /* evaluate regular patches through the general kernels too (for comparison) */
    int no_sharing; /* every patch evaluates its own edges, which leaves cracks of an ulp or so (for comparison) */
    /* 0: none. Otherwise qp_frame_eval_points takes, patch by patch, the shallowest plans whose positions are proven to err by no more
     * than this times the diagonal; stream.bound is what they err by at most, rounding included. Normals have no bound. */
    double tolerance;
    int no_exact_tail; /* samples below the depth of the surface's plans are approximated and flagged (for comparison) */
    qp_supports_options supports;
} qp_frame_options;

typedef struct qp_frame qp_frame;
/* Uploads plans and positions and builds the kernels that this surface needs. Both handles must outlive the
 * frame. */
QP_API qp_status qp_frame_create(qp_device *device, const qp_surface *surface,
                                 const qp_frame_options *options, qp_frame **frame, qp_error *err);
QP_API void qp_frame_free(qp_frame *frame);
/* Reads the mesh's positions anew (after they were changed in place). */
QP_API qp_status qp_frame_update_positions(qp_frame *frame, qp_error *err);
/* The vertex stream at the tessellator's points. */
QP_API qp_status qp_frame_eval(qp_frame *frame, const qp_tessellation *tessellation, qp_stream *stream,
                               qp_error *err);
/* The same at any points, in the order given: patch[i], uv[2 * i], any numbers in [0, 1]. On the device a coordinate is the
 * distance to the nearer end of [0, 1], rounded to the frame's precision, so that it keeps its digits close to either. */
QP_API qp_status qp_frame_eval_points(qp_frame *frame, uint64_t count, const uint32_t *patch,
                                      const double *uv, qp_stream *stream, qp_error *err);

/* A piece of a vertex stream: the samples of some patches that follow each other. */
typedef struct qp_chunk {
    uint64_t first_sample, first_triangle; /* of the whole stream */
    uint32_t first_patch, n_patches;
    qp_stream
        stream; /* the piece; triangles count its samples from 0; it has no hash. Its arrays live until the consumer returns */
} qp_chunk;

/* Takes one piece; anything but QP_OK ends the evaluation with that status, and with the message in *err, if it is filled in. */
typedef qp_status (*qp_chunk_consumer)(void *context, const qp_chunk *chunk, qp_error *err);

/* What an evaluation in pieces came to. */
typedef struct qp_chunks {
    qp_stream
        stream; /* sums over the pieces (of what is held at one time, the most), the hash of the whole where asked for, no arrays */
    uint64_t n_chunks;
    uint64_t n_ghosts; /* samples of patches of other pieces that were evaluated once more, all together */
    uint64_t peak_vertex_bytes; /* most that one piece had, ghosts included, derivatives apart */
    double set_up_ms;           /* laying out all pieces, factors and deeper plans included */
    double consumer_ms;         /* the consumer and the hash */
} qp_chunks;

/* qp_frame_eval for streams that need not be held whole: the same samples in the same order and with the same bits, handed to the
 * consumer (NULL: to none) in pieces of whole patches, of at most chunk_bytes of vertices each. At any time there is one piece: its
 * vertices, ghosts (those of a piece's perimeter that other patches own) and, for each of its samples, 13 bytes, with triangles and
 * derivatives some 24 more each; its supports as the frame's options have them; and, beside mesh and surface, few bytes a face and edge.
 * What qp_frame_eval made before is freed. *sum, which may be NULL, is filled in as far as the evaluation came, also on failure. Errors:
 * as qp_frame_eval; QP_BAD_INPUT, before any piece is made, where a patch alone has more than chunk_bytes. */
QP_API qp_status qp_frame_eval_chunks(qp_frame *frame, const qp_tessellation *tessellation,
                                      uint64_t chunk_bytes, qp_chunk_consumer consumer, void *context,
                                      qp_chunks *sum, qp_error *err);

/* Hash of a vertex stream that comes in pieces, each a number of bytes of vertices: what qp_stream.hash has of the whole. Takes
 * 1 MiB, and 8 bytes more for each MiB it was given. */
typedef struct qp_stream_hasher qp_stream_hasher;
QP_API qp_status qp_stream_hasher_create(qp_stream_hasher **hasher, qp_error *err);
QP_API void qp_stream_hasher_free(qp_stream_hasher *hasher);
/* Errors: QP_SYSTEM for memory; nothing was added then. */
QP_API qp_status qp_stream_hasher_add(qp_stream_hasher *hasher, const void *bytes, size_t length,
                                      qp_error *err);
/* Of what was added so far. */
QP_API uint64_t qp_stream_hasher_value(const qp_stream_hasher *hasher);

#ifdef __cplusplus
}
#endif
#endif
