/* Points of stress cases. */
#include "host/base/status.h"
#include "host/reference/stress.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A coordinate as its distance from the nearer end of [0, 1]. */
typedef struct end_distance {
    float distance; /* in [0, 1/2] */
    bool from_one;
} end_distance;

/* What a frame gets: a float near 0, and near 1 what is left of it in double. */
static double coordinate(end_distance at) {
    if (!at.from_one) return (double)at.distance;
    return 1 - floor((double)at.distance * 0x1p53) * 0x1p-53;
}

static end_distance dyadic(qp_random *random) {
    const int k = 1 + (int)qp_random_below(random, 24);
    return (end_distance){ldexpf(1, -k), qp_random_chance(random, 0.5)};
}

/* Any number below 2^-least, all powers of two down to 2^-most as likely. */
static float any_power(uint32_t least, uint32_t most, qp_random *random) {
    const int k = (int)(least + qp_random_below(random, most - least));
    return ldexpf((float)(0.5 + 0.5 * qp_random_unit(random)), -k);
}

/* A multiple of 2^-k, k to 8, or the float on either side of it. */
static end_distance adjacent(qp_random *random) {
    const int k = 1 + (int)qp_random_below(random, 8);
    float x = ldexpf((float)qp_random_below(random, (1u << (k - 1)) + 1), -k);
    const uint32_t side = qp_random_below(random, 3);
    if (side == 1) x = nextafterf(x, 0.0f);
    if (side == 2 && x < 0.5f) x = nextafterf(x, 1.0f);
    return (end_distance){x, qp_random_chance(random, 0.5)};
}

static end_distance tiny(qp_random *random) {
    static const float values[] = {1e-10f, 1e-30f, FLT_MIN, 0x1p-149f, 0x1p-25f, 0x1p-53f, 3e-8f, 1e-15f};
    const uint32_t n = sizeof values / sizeof values[0], i = qp_random_below(random, 2 * n);
    const float x = i < n ? values[i] : any_power(24, 64, random);
    return (end_distance){x, qp_random_chance(random, 0.3)};
}

static end_distance mixed(qp_random *random) {
    const double share = qp_random_unit(random);
    const bool from_one = qp_random_chance(random, 0.5);
    if (share < 0.45) return (end_distance){(float)(0.5 * qp_random_unit(random)), from_one};
    /* At any power of two's distance. */
    if (share < 0.8) return (end_distance){any_power(1, 24, random), from_one};
    if (share < 0.9) return (end_distance){0, from_one};
    return share < 0.95 ? dyadic(random) : adjacent(random);
}

static end_distance pick(qp_stress_points kind, qp_random *random) {
    if (kind == QP_STRESS_MIXED || qp_random_chance(random, 0.2)) return mixed(random);
    switch (kind) {
    case QP_STRESS_DYADIC:
        return dyadic(random);
    case QP_STRESS_ADJACENT:
        return adjacent(random);
    default:
        return tiny(random);
    }
}

static qp_status make_points(qp_stress_case *made, uint64_t samples, qp_random *random, qp_error *err) {
    const qp_mesh *m = made->mesh;
    uint32_t *faces = qp_alloc(m->n_patches, sizeof *faces, false), count = 0;
    made->patch = qp_alloc(samples, sizeof *made->patch, false);
    made->uv = qp_alloc(samples, 2 * sizeof *made->uv, false);
    if (faces == NULL || made->patch == NULL || made->uv == NULL) {
        free(faces);
        return qp_fail_memory(err, samples * 2 * sizeof *made->uv, "points");
    }
    for (uint32_t f = 0; f < m->n_faces; ++f)
        for (uint32_t p = m->patch_offsets[f]; p < m->patch_offsets[f + 1]; ++p)
            if (!(m->face_flags[f] & QP_FACE_HOLE)) faces[count++] = p;
    if (count > 0) made->count = samples;
    for (uint64_t i = 0; i < made->count; ++i) {
        made->patch[i] = faces[qp_random_below(random, count)];
        /* A quarter of the points lie about a diagonal of the patch, where corners are approached evenly. */
        const end_distance u = pick(made->points, random), v = pick(made->points, random);
        const bool diagonal = qp_random_chance(random, 0.25);
        made->uv[2 * i] = coordinate(u);
        made->uv[2 * i + 1] = coordinate(diagonal ? (end_distance){u.distance, v.from_one} : v);
    }
    free(faces);
    return QP_OK;
}

qp_status qp_stress_case_make(const qp_stress_family *family, uint32_t number, uint64_t seed,
                              uint64_t samples, qp_stress_case *made, qp_error *err) {
    *made = (qp_stress_case){0};
    qp_random random = {qp_hash(family->name, strlen(family->name), seed) + number};
    /* Neighbouring states give shifted streams; a draw parts them. */
    random.state = qp_random_bits(&random);
    qp_status status = family->make(number, &random, made, err);
    if (status == QP_OK) status = make_points(made, samples, &random, err);
    if (status != QP_OK) qp_stress_case_free(made);
    return status;
}

void qp_stress_case_free(qp_stress_case *made) {
    qp_mesh_free(made->mesh);
    free(made->patch);
    free(made->uv);
    *made = (qp_stress_case){0};
}
