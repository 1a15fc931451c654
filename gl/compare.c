#include "gl/compare.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Least sine of the tangents' angle at which normals are compared: below it the rounding of float alone turns them by more than a
 * hundredth of a degree. */
static const float least_sine = 0.02f;

typedef struct comparison {
    const qp_frame *frame;
    const qp_stream *stream;
    qp_gl_difference *d;
    double ulp;
    uint8_t *seen;   /* [n_samples] */
    uint32_t *table; /* of the samples of one part, by the bits of (u,v) */
    uint32_t table_size, part;
} comparison;

static uint64_t key_of(const float uv[2]) {
    uint32_t bits[2];
    const float plain[2] = {uv[0] + 0.0f, uv[1] + 0.0f}; /* -0 is 0 */
    memcpy(bits, plain, sizeof bits);
    return (uint64_t)bits[0] << 32 | bits[1];
}

static uint32_t slot_of(const comparison *c, uint64_t key) {
    return (uint32_t)((key * UINT64_C(0x9e3779b97f4a7c15)) >> 32) & (c->table_size - 1);
}

/* Fills the table with the samples of a part. */
static bool take_part(comparison *c, uint32_t part) {
    const qp_frame_item *item = &c->frame->layout.items[part];
    uint32_t size = 64;
    while (size < 2 * item->samples) size *= 2;
    if (size > c->table_size) {
        free(c->table);
        c->table = qp_alloc(size, sizeof *c->table, false);
        if (c->table == NULL) return false;
    }
    c->table_size = size;
    c->part = part;
    memset(c->table, 0xff, size * sizeof *c->table);
    for (uint32_t i = 0; i < item->samples; ++i) {
        uint32_t slot = slot_of(c, key_of(c->stream->uv + 2 * (item->out + i)));
        while (c->table[slot] != QP_NONE) slot = (slot + 1) & (size - 1);
        c->table[slot] = i;
    }
    return true;
}

/* The sample of a part at (u,v) that has not been seen yet, or UINT64_MAX. */
static uint64_t find_sample(const comparison *c, const float uv[2]) {
    const uint64_t first = c->frame->layout.items[c->part].out, key = key_of(uv);
    for (uint32_t slot = slot_of(c, key); c->table[slot] != QP_NONE;
         slot = (slot + 1) & (c->table_size - 1)) {
        const uint64_t sample = first + c->table[slot];
        if (!c->seen[sample] && key_of(c->stream->uv + 2 * sample) == key) return sample;
    }
    return UINT64_MAX;
}

static double angle(const float a[3], const float b[3]) {
    const double cross[3] = {(double)a[1] * b[2] - (double)a[2] * b[1],
                             (double)a[2] * b[0] - (double)a[0] * b[2],
                             (double)a[0] * b[1] - (double)a[1] * b[0]};
    const double dot = (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
    return atan2(sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]), dot) *
           57.29577951308232;
}

static void compare_vertex(comparison *c, const qp_gl_vertex *v, uint64_t sample) {
    qp_gl_difference *d = c->d;
    const float *own = (const float *)c->stream->vertices + 6 * sample;
    const uint32_t patch = c->stream->sample_patch[sample];
    for (int k = 0; k < 3; ++k) {
        const double ulps = fabs((double)v->position[k] - (double)own[k]) / c->ulp;
        if (ulps <= d->position_ulp) continue; /* a NaN goes on */
        d->position_ulp = isfinite(ulps) ? ulps : HUGE_VAL;
        d->worst_patch = patch;
        d->worst_u = (double)v->uv[0];
        d->worst_v = (double)v->uv[1];
    }
    if (c->stream->flags[sample] & QP_SAMPLE_NO_NORMAL || !(v->sine >= least_sine)) {
        ++d->unjudged;
        return;
    }
    ++d->normals;
    const double degrees = angle(v->normal, own + 3);
    if (degrees <= d->normal_max_deg) return;
    d->normal_max_deg = isfinite(degrees) ? degrees : 180;
    d->worst_normal_patch = patch;
    d->worst_normal_u = (double)v->uv[0];
    d->worst_normal_v = (double)v->uv[1];
}

static qp_status take(void *context, const qp_gl_vertex *vertices, size_t count, qp_error *err) {
    comparison *c = context;
    c->d->points += count;
    for (size_t i = 0; i < count; ++i) {
        const qp_gl_vertex *v = &vertices[i];
        const bool known = v->part >= 0 && (size_t)v->part < c->frame->layout.n_items;
        if (known && (uint32_t)v->part != c->part && !take_part(c, (uint32_t)v->part))
            return qp_fail_memory(err, c->table_size * sizeof *c->table, "a comparison");
        const uint64_t sample = known ? find_sample(c, v->uv) : UINT64_MAX;
        if (sample == UINT64_MAX) {
            ++c->d->added;
            continue;
        }
        c->seen[sample] = 1;
        compare_vertex(c, v, sample);
    }
    return QP_OK;
}

/* One unit in the last place of the mesh's largest coordinate. */
static double coordinate_ulp(const qp_mesh *mesh) {
    double most = 0;
    for (int k = 0; k < 3; ++k) most = fmax(most, fmax(fabs(mesh->box_min[k]), fabs(mesh->box_max[k])));
    return most > 0 ? ldexp(1.0, ilogb(most) - 23) : 1;
}

qp_status qp_gl_compare(qp_gl_surface *surface, const qp_frame *frame, const qp_stream *stream,
                        qp_gl_difference *difference, qp_error *err) {
    memset(difference, 0, sizeof *difference);
    comparison c = {.frame = frame,
                    .stream = stream,
                    .d = difference,
                    .ulp = coordinate_ulp(frame->surface->mesh),
                    .seen = qp_alloc((size_t)stream->n_samples, 1, true),
                    .part = QP_NONE};
    if (c.seen == NULL) return qp_fail_memory(err, (size_t)stream->n_samples, "a comparison");
    qp_status status = qp_gl_surface_capture(surface, take, &c, err);
    for (uint64_t i = 0; i < stream->n_samples; ++i) difference->missing += !c.seen[i];
    free(c.seen);
    free(c.table);
    return status;
}
