/* Sample sets. */
#include "host/base/random.h"
#include "host/reference/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CORNER_LEVELS = 24, CORNER_SAMPLES = 4 * (1 + 3 * CORNER_LEVELS) };

void qp_sample_set_free(qp_sample_set *set) {
    free(set->patch);
    free(set->uv);
    memset(set, 0, sizeof *set);
}

static qp_status reserve(qp_sample_set *set, uint64_t count, qp_error *err) {
    set->patch = qp_alloc(count, sizeof *set->patch, false);
    set->uv = qp_alloc(count, 2 * sizeof *set->uv, false);
    if (!set->patch || !set->uv) {
        qp_sample_set_free(set);
        return qp_fail_memory(err, count * 20, "a sample set");
    }
    return QP_OK;
}

static void append(qp_sample_set *set, uint32_t patch, double u, double v) {
    set->patch[set->count] = patch;
    set->uv[2 * set->count] = u;
    set->uv[2 * set->count + 1] = v;
    set->count++;
}

/* All patches with a surface, in order. */
static qp_status list_patches(const qp_mesh *mesh, uint32_t **patches, uint32_t *count, qp_error *err) {
    *patches = qp_alloc(mesh->n_patches, sizeof **patches, false);
    if (!*patches) return qp_fail_memory(err, mesh->n_patches * sizeof **patches, "a list of patches");
    *count = 0;
    for (uint32_t f = 0; f < mesh->n_faces; ++f)
        for (uint32_t p = mesh->patch_offsets[f]; p < mesh->patch_offsets[f + 1]; ++p)
            if (!(mesh->face_flags[f] & QP_FACE_HOLE)) (*patches)[(*count)++] = p;
    return QP_OK;
}

static void corner_samples(uint32_t patch, qp_sample_set *set) {
    for (int corner = 0; corner < 4; ++corner) {
        double u = corner == 1 || corner == 2, v = corner > 1;
        append(set, patch, u, v);
        for (int k = 1; k <= CORNER_LEVELS; ++k) {
            double offset = ldexp(1.0, -k), du = u > 0 ? -offset : offset, dv = v > 0 ? -offset : offset;
            append(set, patch, u + du, v);
            append(set, patch, u, v + dv);
            append(set, patch, u + du, v + dv);
        }
    }
}

static void shuffle(uint32_t *list, uint32_t count, qp_random *random) {
    for (uint32_t i = count; i > 1; --i) {
        uint32_t k = qp_random_below(random, i), swap = list[k];
        list[k] = list[i - 1];
        list[i - 1] = swap;
    }
}

/* Every patch gets its turn before any gets its next one, in an order shuffled anew each time; (u,v) is the
 * additive recurrence R2 (Roberts 2018: powers of the inverse of the root of x^3 = x + 1), started at random.
 */
static void random_samples(uint32_t *patches, uint32_t n_patches, uint64_t count, uint64_t seed,
                           qp_sample_set *set) {
    qp_random random = {seed};
    double u = qp_random_unit(&random), v = qp_random_unit(&random);
    for (uint64_t i = 0; i < count; ++i) {
        if (i % n_patches == 0) shuffle(patches, n_patches, &random);
        append(set, patches[i % n_patches], floor(u * 0x1p24) * 0x1p-24, floor(v * 0x1p24) * 0x1p-24);
        u += 0.7548776662466927;
        v += 0.5698402909980532;
        u -= floor(u);
        v -= floor(v);
    }
}

qp_status qp_sample_set_make(const qp_mesh *mesh, const char *kind, uint64_t count, uint64_t seed,
                             qp_sample_set *set, qp_error *err) {
    memset(set, 0, sizeof *set);
    bool corner = strcmp(kind, "corner") == 0;
    if (!corner && strcmp(kind, "random") != 0)
        return qp_fail(err, QP_BAD_INPUT, "unknown sample set \"%s\": corner or random", kind);
    uint32_t *patches, n_patches = 0;
    qp_status status = list_patches(mesh, &patches, &n_patches, err);
    if (status) return status;
    if (corner)
        count = (uint64_t)n_patches * CORNER_SAMPLES;
    else if (n_patches == 0)
        count = 0;
    status = reserve(set, count, err);
    for (uint32_t i = 0; i < n_patches && corner && !status; ++i) corner_samples(patches[i], set);
    if (!corner && !status && count > 0) random_samples(patches, n_patches, count, seed, set);
    free(patches);
    return status;
}
