/* Embree's interpolation of subdivision geometry, one sample at a time or many. It builds a patch's data when the
 * patch is first met after a commit and keeps it in a cache, so there are two kinds of frame: with the positions as
 * they were, all patches in the cache; and with positions that moved, which needs a commit. */
#include "host/peer/peer.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_SIDES = 15,   /* of a face, as its manual says */
    MOST_VALENCE = 64, /* faces a ring; a larger one overruns its arrays */
    BLOCK = 1024,      /* samples of one call of rtcInterpolateN */
    VERTEX_REALS = 4
};
_Static_assert(QP_PEER_BLOCK % BLOCK == 0, "the last block must fit what QP_PEER_OUT_BYTES leaves");

enum { SINGLE, MANY, MANY_MOVED };

typedef struct evaluator {
    qp_peer peer;
    RTCDevice device;
    RTCGeometry geometry;
    float *vertices;    /* Embree's buffer */
    float *given;       /* [VERTEX_REALS * n_vertices] */
    uint32_t *faces;    /* [count + 3] of each sample */
    float *u, *v;       /* [count + 3] in Embree's coordinates of the face */
    uint8_t *apart;     /* [count] */
    atomic_llong bytes; /* that Embree has asked for */
} evaluator;

static void free_evaluator(qp_peer *peer) {
    evaluator *e = (evaluator *)peer;
    if (e == NULL) return;
    if (e->geometry != NULL) rtcReleaseGeometry(e->geometry);
    if (e->device != NULL) rtcReleaseDevice(e->device);
    free(e->given);
    free(e->faces);
    free(e->u);
    free(e->v);
    free(e->apart);
    free(e);
}

/* Meshes that Embree cannot hold, or of which it makes another surface all over. */
static qp_status check_mesh(const qp_mesh *mesh, qp_error *err) {
    const qp_status bad = QP_BAD_INPUT;
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        if (qp_face_size(mesh, f) > MOST_SIDES)
            return qp_fail(err, bad, "Embree takes faces of at most %d sides, not %u", MOST_SIDES,
                           qp_face_size(mesh, f));
        if (mesh->face_flags[f] & QP_FACE_HOLE)
            return qp_fail(err, bad,
                           "Embree cuts holes out of the mesh, which moves the surface around them");
        if (mesh->triangle_rule == QP_TRIANGLE_SMOOTH && qp_face_size(mesh, f) == 3)
            return qp_fail(err, bad, "Embree has no smooth triangle rule");
    }
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        const uint32_t valence = mesh->vertex_offsets[v + 1] - mesh->vertex_offsets[v];
        if (valence > MOST_VALENCE)
            return qp_fail(err, bad, "Embree overruns its arrays at a vertex of %u faces; it has room for %d",
                           valence, MOST_VALENCE);
        if (mesh->vertex_flags[v] & QP_VERTEX_NONMANIFOLD)
            return qp_fail(err, bad, "Embree has its own rule for non-manifold meshes");
    }
    if (mesh->crease_method == QP_CREASE_CHAIKIN && mesh->n_creases > 0)
        return qp_fail(err, bad, "Embree has no Chaikin creases");
    return QP_OK;
}

/* Sharp edges at a vertex. */
typedef struct edges_at {
    uint32_t count;
    float low, high; /* their sharpness */
} edges_at;

/* Has Embree the rule of OpenSubdiv here? Its own are: where two sharp edges meet, their sharpness decays by Chaikin's
 * rule, which is the uniform one if both are the same; where more meet, the vertex stays in its place until all but two
 * have gone, without a blend between the rules; a vertex's own sharpness blends with the smooth rule, whatever edges
 * meet there; and a boundary's vertex of one face, which it takes for regular, is left to the spline's end. */
static bool same_rule(const qp_mesh *mesh, uint32_t v, const edges_at *edges) {
    const float sharpness = mesh->vertex_sharpness[v];
    const bool boundary = mesh->vertex_flags[v] & QP_VERTEX_BOUNDARY;
    const uint32_t faces = mesh->vertex_offsets[v + 1] - mesh->vertex_offsets[v];
    if (faces == 2 && !boundary) return false;
    if (sharpness >= QP_SHARPNESS_INFINITE) return true;
    if (faces == 1) return false;
    if (sharpness > 0) return edges->count < 2;
    if (edges->count < 2) return true;
    if (edges->low != edges->high) return false;
    return edges->count == 2 || edges->low >= QP_SHARPNESS_INFINITE || edges->low == floorf(edges->low);
}

/* Marks in vertices[] those whose rule differs. False when memory is out. */
static bool mark_vertices(const qp_mesh *mesh, uint8_t *vertices) {
    edges_at *edges = qp_alloc(mesh->n_vertices, sizeof *edges, true);
    if (edges == NULL) return false;
    for (uint32_t i = 0; i < mesh->n_edges; ++i) {
        const float s = mesh->edge_sharpness[i];
        for (uint32_t end = 0; end < 2 && s > 0; ++end) {
            edges_at *at = &edges[mesh->edge_vertices[2 * (size_t)i + end]];
            at->low = at->count == 0 || s < at->low ? s : at->low;
            at->high = at->count == 0 || s > at->high ? s : at->high;
            ++at->count;
        }
    }
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) vertices[v] = !same_rule(mesh, v, &edges[v]);
    free(edges);
    return true;
}

/* A vertex moves the surface of the faces around it and of those around them. */
static void spread(const qp_mesh *mesh, const uint8_t *from, uint8_t *to) {
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        bool any = false;
        for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1]; ++c)
            any = any || from[mesh->face_vertices[c]];
        for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1] && any; ++c)
            to[mesh->face_vertices[c]] = 1;
    }
}

/* Samples of faces that touch a face with such a vertex. */
static qp_status mark_samples(evaluator *e, qp_error *err) {
    const qp_peer_task *task = e->peer.task;
    const qp_mesh *mesh = task->mesh;
    uint8_t *vertices = qp_alloc(mesh->n_vertices, 1, true), *near = qp_alloc(mesh->n_vertices, 1, true);
    e->apart = qp_alloc((size_t)task->count, 1, true);
    qp_status status = QP_OK;
    if (vertices == NULL || near == NULL || e->apart == NULL || !mark_vertices(mesh, vertices))
        status = qp_fail_memory(err, (size_t)task->count, "marks of samples");
    uint64_t n_apart = 0;
    if (status == QP_OK) {
        spread(mesh, vertices, near);
        for (uint64_t i = 0; i < task->count; ++i) {
            const uint32_t f = e->faces[i];
            for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1]; ++c)
                e->apart[i] |= near[mesh->face_vertices[c]];
            n_apart += e->apart[i];
        }
        if (n_apart > 0) e->peer.apart = e->apart;
    }
    free(vertices);
    free(near);
    if (status == QP_OK && n_apart == task->count)
        return qp_fail(err, QP_BAD_INPUT, "Embree's crease rules make another surface of the whole mesh");
    return status;
}

static qp_status device_status(evaluator *e, qp_error *err) {
    const enum RTCError error = rtcGetDeviceError(e->device);
    if (error == RTC_ERROR_NONE) return QP_OK;
    return qp_fail(err, error == RTC_ERROR_INVALID_ARGUMENT ? QP_BAD_INPUT : QP_SYSTEM, "Embree: error %d",
                   (int)error);
}

static bool count_bytes(void *context, ssize_t bytes, bool post) {
    evaluator *e = context;
    (void)post;
    atomic_fetch_add(&e->bytes, bytes);
    return true;
}

/* A buffer of the geometry with `count` elements; NULL for none or on failure, which device_status tells. */
static void *new_buffer(evaluator *e, enum RTCBufferType type, enum RTCFormat format, size_t size,
                        size_t count) {
    return count == 0 ? NULL : rtcSetNewGeometryBuffer(e->geometry, type, 0, format, size, count);
}

static float weight(float sharpness) {
    return sharpness >= QP_SHARPNESS_INFINITE ? INFINITY : sharpness;
}

/* Effective sharpness of what is no boundary: boundaries are Embree's own business, and it allows each edge once. */
static qp_status fill_tags(evaluator *e, const qp_mesh *mesh, qp_error *err) {
    size_t n_edges = 0, n_vertices = 0;
    for (uint32_t i = 0; i < mesh->n_edges; ++i)
        n_edges += mesh->edge_sharpness[i] > 0 && !(mesh->edge_flags[i] & QP_EDGE_BOUNDARY);
    for (uint32_t i = 0; i < mesh->n_vertices; ++i) n_vertices += mesh->vertex_sharpness[i] > 0;
    uint32_t *edges =
        new_buffer(e, RTC_BUFFER_TYPE_EDGE_CREASE_INDEX, RTC_FORMAT_UINT2, 2 * sizeof(uint32_t), n_edges);
    float *edge_weights =
        new_buffer(e, RTC_BUFFER_TYPE_EDGE_CREASE_WEIGHT, RTC_FORMAT_FLOAT, sizeof(float), n_edges);
    uint32_t *corners =
        new_buffer(e, RTC_BUFFER_TYPE_VERTEX_CREASE_INDEX, RTC_FORMAT_UINT, sizeof(uint32_t), n_vertices);
    float *corner_weights =
        new_buffer(e, RTC_BUFFER_TYPE_VERTEX_CREASE_WEIGHT, RTC_FORMAT_FLOAT, sizeof(float), n_vertices);
    qp_status status = device_status(e, err);
    if (status != QP_OK) return status;
    for (uint32_t i = 0; i < mesh->n_edges && n_edges > 0; ++i) {
        if (!(mesh->edge_sharpness[i] > 0) || mesh->edge_flags[i] & QP_EDGE_BOUNDARY) continue;
        memcpy(edges, mesh->edge_vertices + 2 * (size_t)i, 2 * sizeof *edges);
        edges += 2;
        *edge_weights++ = weight(mesh->edge_sharpness[i]);
    }
    for (uint32_t i = 0; i < mesh->n_vertices && n_vertices > 0; ++i) {
        if (!(mesh->vertex_sharpness[i] > 0)) continue;
        *corners++ = i;
        *corner_weights++ = weight(mesh->vertex_sharpness[i]);
    }
    return QP_OK;
}

static qp_status fill_geometry(evaluator *e, qp_error *err) {
    const qp_mesh *mesh = e->peer.task->mesh;
    e->geometry = rtcNewGeometry(e->device, RTC_GEOMETRY_TYPE_SUBDIVISION);
    if (e->geometry == NULL) return device_status(e, err);
    uint32_t *sizes = new_buffer(e, RTC_BUFFER_TYPE_FACE, RTC_FORMAT_UINT, sizeof(uint32_t), mesh->n_faces);
    uint32_t *indices =
        new_buffer(e, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, sizeof(uint32_t), mesh->n_corners);
    const size_t vertex_bytes = VERTEX_REALS * sizeof(float);
    e->vertices = new_buffer(e, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertex_bytes, mesh->n_vertices);
    e->given = qp_alloc((size_t)mesh->n_vertices * VERTEX_REALS, sizeof(float), true);
    qp_status status = device_status(e, err);
    if (status != QP_OK) return status;
    if (e->given == NULL || sizes == NULL || indices == NULL || e->vertices == NULL)
        return qp_fail_memory(err, mesh->n_vertices * vertex_bytes, "Embree's positions");
    for (uint32_t f = 0; f < mesh->n_faces; ++f) sizes[f] = qp_face_size(mesh, f);
    memcpy(indices, mesh->face_vertices, mesh->n_corners * sizeof *indices);
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; ++i)
        e->given[i / 3 * VERTEX_REALS + i % 3] = (float)mesh->positions[i];
    memcpy(e->vertices, e->given, mesh->n_vertices * vertex_bytes);
    status = fill_tags(e, mesh, err);
    if (status != QP_OK) return status;
    rtcSetGeometrySubdivisionMode(e->geometry, 0, RTC_SUBDIVISION_MODE_SMOOTH_BOUNDARY);
    rtcCommitGeometry(e->geometry);
    return device_status(e, err);
}

/* A child of an n-gon has its number in the coordinates: an even multiple of 1 in each, and its own between 1/2 and 3/2
 * above that. */
static qp_status locate(evaluator *e, qp_error *err) {
    const qp_peer_task *task = e->peer.task;
    const size_t count = (size_t)task->count + 3;
    e->faces = qp_alloc(count, sizeof *e->faces, false);
    e->u = qp_alloc(count, sizeof *e->u, false);
    e->v = qp_alloc(count, sizeof *e->v, false);
    if (e->faces == NULL || e->u == NULL || e->v == NULL)
        return qp_fail_memory(err, 12 * count, "Embree's samples");
    for (size_t i = 0; i < count; ++i) {
        /* rtcInterpolateN takes samples by four; the last one fills up. */
        const size_t from = i < task->count ? i : (size_t)task->count - 1;
        uint32_t child;
        e->faces[i] = qp_patch_face(task->mesh, task->patch[from], &child);
        e->u[i] = task->uv[2 * from];
        e->v[i] = task->uv[2 * from + 1];
        if (qp_face_size(task->mesh, e->faces[i]) == 4) continue;
        e->u[i] += 0.5f + 2 * (float)(child % 4);
        e->v[i] += 0.5f + 2 * (float)(child / 4);
    }
    return QP_OK;
}

static qp_status create(const qp_peer_series *series, const qp_peer_task *task, unsigned level,
                        qp_peer **peer, qp_error *err) {
    (void)level;
    *peer = NULL;
    qp_status status = check_mesh(task->mesh, err);
    if (status != QP_OK) return status;
    evaluator *e = qp_alloc(1, sizeof *e, true);
    if (e == NULL) return qp_fail_memory(err, sizeof *e, "Embree");
    e->peer.series = series;
    e->peer.task = task;
    atomic_init(&e->bytes, 0);
    const double start = qp_now_ms();
    e->device = rtcNewDevice(NULL);
    if (e->device == NULL) {
        status = qp_fail(err, QP_SYSTEM, "Embree: no device (error %d)", (int)rtcGetDeviceError(NULL));
    } else {
        rtcSetDeviceMemoryMonitorFunction(e->device, count_bytes, e);
        status = fill_geometry(e, err);
    }
    const double made = qp_now_ms();
    if (status == QP_OK) status = locate(e, err);
    const double located = qp_now_ms();
    if (status == QP_OK) status = mark_samples(e, err);
    e->peer.setup_ms = made - start;
    e->peer.locate_ms = located - made;
    const long long bytes = atomic_load(&e->bytes);
    e->peer.bytes = bytes > 0 ? (uint64_t)bytes : 0;
    if (status == QP_OK)
        *peer = &e->peer;
    else
        free_evaluator(&e->peer);
    return status;
}

static void interpolate_single(void *context, uint64_t begin, uint64_t end) {
    const evaluator *e = context;
    float *out = e->peer.task->out;
    /* 12 floats a sample: it writes 16 bytes for each of the three. */
    for (uint64_t i = begin; i < end; ++i)
        rtcInterpolate1(e->geometry, e->faces[i], e->u[i], e->v[i], RTC_BUFFER_TYPE_VERTEX, 0, out + 12 * i,
                        out + 12 * i + 4, out + 12 * i + 8, 3);
}

static uint64_t block_samples(const qp_peer_task *task, uint64_t begin) {
    const uint64_t left = task->count - begin;
    return left < BLOCK ? (left + 3) / 4 * 4 : BLOCK;
}

static void interpolate_many(void *context, uint64_t begin, uint64_t end) {
    const evaluator *e = context;
    for (uint64_t at = begin; at < end; at += BLOCK) {
        const uint64_t n = block_samples(e->peer.task, at);
        float *out = (float *)e->peer.task->out + 9 * at;
        struct RTCInterpolateNArguments arguments = {.geometry = e->geometry,
                                                     .primIDs = e->faces + at,
                                                     .u = e->u + at,
                                                     .v = e->v + at,
                                                     .N = (unsigned)n,
                                                     .bufferType = RTC_BUFFER_TYPE_VERTEX,
                                                     .P = out,
                                                     .dPdu = out + 3 * n,
                                                     .dPdv = out + 6 * n,
                                                     .valueCount = 3};
        rtcInterpolateN(&arguments);
    }
}

static qp_status evaluate(qp_peer *peer, qp_error *err) {
    evaluator *e = (evaluator *)peer;
    const qp_peer_task *task = peer->task;
    if (peer->series->variant == MANY_MOVED) {
        memcpy(e->vertices, e->given, (size_t)task->mesh->n_vertices * VERTEX_REALS * sizeof(float));
        rtcUpdateGeometryBuffer(e->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
        rtcCommitGeometry(e->geometry);
    }
    qp_peer_ranges(task->count, BLOCK, task->threads,
                   peer->series->variant == SINGLE ? interpolate_single : interpolate_many, e);
    return device_status(e, err);
}

static void read_sample(const qp_peer *peer, uint64_t i, double p[3], double du[3], double dv[3]) {
    const float *out = peer->task->out;
    const uint64_t begin = i / BLOCK * BLOCK, n = block_samples(peer->task, begin);
    double *const to[3] = {p, du, dv};
    for (uint64_t c = 0; c < 9; ++c)
        to[c / 3][c % 3] = (double)(peer->series->variant == SINGLE ? out[12 * i + 4 * (c / 3) + c % 3]
                                                                    : out[9 * begin + c * n + (i - begin)]);
}

#define EMBREE "Embree " RTC_VERSION_STRING
static const qp_peer_series series[] = {
    {"embree", EMBREE, 0, 0, true, false, SINGLE, create, evaluate, read_sample, free_evaluator},
    {"embree-n", EMBREE, 0, 0, true, false, MANY, create, evaluate, read_sample, free_evaluator},
    {"embree-n-moved", EMBREE, 0, 0, true, false, MANY_MOVED, create, evaluate, read_sample, free_evaluator},
};

const qp_peer_module qp_peer_module_table = {{{series, sizeof series / sizeof series[0]}, {NULL, 0}}};
