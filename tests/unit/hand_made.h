/* Plans made by hand, so that kernels are tested apart from host/plan.
 *
 * The ring's vertex 0 is the origin of space and the others are coefficient vectors, so that the weights of a
 * control point may be any numbers: the polynomial tests take ring vertex 1 + 4 j + i as the coefficient of
 * u^i v^j and blossoms as weights. */
#ifndef QP_TESTS_HAND_MADE_H
#define QP_TESTS_HAND_MADE_H

#include "host/plan/plan.h"
#include "tests/check.h"

#include <string.h>

enum { HAND_POINTS = 512, HAND_RING = 400, HAND_WORDS = 512, HAND_CONSTANTS = 256 };

typedef struct hand_plan {
    qp_mesh mesh;
    qp_surface surface;
    qp_plan plan, *plans[1];
    uint32_t patch_plan[4];
    uint8_t rotation[4];
    uint64_t patch_ring[4];
    uint32_t patch_offsets[5], face_offsets[5], face_vertices[16];
    uint32_t ring[4 * HAND_RING], tree[HAND_WORDS];
    double weights[HAND_POINTS * HAND_RING], constants[HAND_CONSTANTS];
    double positions[3 * HAND_RING];
    uint8_t scales[HAND_POINTS];
} hand_plan;

static uint64_t hand_state = 1;
/* In [-1, 1). */
static inline double hand_random(void) {
    hand_state = hand_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(int32_t)(hand_state >> 32) / 2147483648.0;
}
/* A multiple of 2^-24 in [0, 1], often a round one. */
static inline float hand_coordinate(void) {
    uint32_t r = (uint32_t)(int32_t)(hand_random() * 1e9);
    if (r % 4 == 0) return (float)(r / 4 % 33) / 32.0f;
    if (r % 4 == 1) return ldexpf(1.0f, -(int)(r / 4 % 25));
    return (float)(r % (1u << 24)) / (float)(1 << 24);
}

/* Four patches, one for each rotation of one plan; positions random, vertex 0 at zero, rounded to float. */
static inline void hand_begin(hand_plan *h, uint32_t ring_size) {
    memset(h, 0, sizeof *h);
    h->mesh.n_vertices = ring_size;
    h->mesh.n_patches = h->mesh.n_faces = 4;
    h->mesh.patch_offsets = h->patch_offsets;
    h->mesh.face_offsets = h->face_offsets;
    h->mesh.face_vertices = h->face_vertices; /* all are vertex 0, to which points are anchored so */
    h->mesh.positions = h->positions;
    h->surface.mesh = &h->mesh;
    h->surface.n_plans = 1;
    h->plans[0] = &h->plan;
    h->surface.plans = h->plans;
    h->surface.regular_plan = QP_NONE;
    h->surface.patch_plan = h->patch_plan;
    h->surface.patch_rotation = h->rotation;
    h->surface.patch_ring = h->patch_ring;
    h->surface.rings = h->ring;
    h->surface.ring_entries = 4 * ring_size;
    for (uint32_t i = 0; i < 4 * ring_size; ++i) h->ring[i] = i % ring_size;
    for (uint8_t p = 0; p < 4; ++p) {
        h->rotation[p] = p;
        h->patch_ring[p] = p * (uint64_t)ring_size;
    }
    for (uint32_t p = 0; p <= 4; ++p) {
        h->patch_offsets[p] = p;
        h->face_offsets[p] = 4 * p;
    }
    h->plan.ring_size = ring_size;
    h->plan.tree = h->tree;
    h->plan.weights = h->weights;
    h->plan.constants = h->constants;
    h->plan.point_scales = h->scales;
    for (uint32_t i = 3; i < 3 * ring_size; ++i) h->positions[i] = (double)(float)hand_random();
}

/* A new point with zero weights; returns its index and, in *row, its weights. */
static inline uint32_t hand_point(hand_plan *h, double **row) {
    *row = h->weights + (size_t)h->plan.point_count * h->plan.ring_size;
    return h->plan.point_count++;
}

/* Appends a word to the tree. */
static inline void hand_word(hand_plan *h, uint32_t word) {
    h->tree[h->plan.tree_words++] = word;
}
/* Appends indices, two a word. */
static inline void hand_indices(hand_plan *h, const uint32_t *indices, uint32_t count) {
    for (uint32_t i = 0; i < count; i += 2) hand_word(h, indices[i] | indices[i + 1] << 16);
}

static inline void hand_end(hand_plan *h, uint32_t flags) {
    h->plan.flags = flags;
    for (uint32_t n = 0; n < QP_LEVELS; ++n) h->plan.rows[n] = h->plan.point_count;
}

/* Evaluates count points; the caller frees *frame, which owns the stream. */
static inline int hand_eval(qp_device *device, const hand_plan *h, qp_precision precision,
                            int no_regular_pass, uint64_t count, const uint32_t *patch, const double *uv,
                            qp_frame **frame, qp_stream *stream) {
    qp_error err = {0};
    /* Deeper plans and owners of edges could not be made: there is no mesh. */
    qp_frame_options options = {.precision = precision,
                                .want_hash = 1,
                                .no_regular_pass = no_regular_pass,
                                .no_sharing = 1,
                                .no_exact_tail = 1};
    return CHECK_OK(qp_frame_create(device, &h->surface, &options, frame, &err), err) &&
           CHECK_OK(qp_frame_eval_points(*frame, count, patch, uv, stream, &err), err);
}

static inline int hand_same_bits(const qp_stream *a, const qp_stream *b) {
    size_t size = a->precision == QP_DOUBLE ? sizeof(double) : sizeof(float);
    return a->n_samples == b->n_samples && a->precision == b->precision && a->hash == b->hash &&
           memcmp(a->vertices, b->vertices, (size_t)a->n_samples * 6 * size) == 0 &&
           memcmp(a->flags, b->flags, (size_t)a->n_samples) == 0;
}

/* Element k of sample i. */
static inline double hand_value(const qp_stream *s, uint64_t i, int k) {
    return s->precision == QP_DOUBLE ? ((const double *)s->vertices)[6 * i + (uint64_t)k]
                                     : ((const float *)s->vertices)[6 * i + (uint64_t)k];
}

#endif
