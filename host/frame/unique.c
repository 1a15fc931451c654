#include "host/frame/unique.h"
#include "host/frame/frame.h"
#include "kernels/frame_layout.h"

#include <stdlib.h>
#include <string.h>

/* ---- a patch's points as the hull sees them ---- */

typedef struct view {
    const uint32_t *ring, *order, *anchors, *anchored; /* anchored: 4 bits a point, or NULL */
    const char *weights;
    size_t points;
    uint32_t ring_size, base;
    bool shares, wide; /* wide: doubles */
} view;

static view view_of(const qp_unique *u, uint64_t patch) {
    const uint32_t *head = u->pack.heads + u->head_of[patch];
    const bool wide = u->precision == QP_DOUBLE;
    view v = {.ring = u->rings + u->ring_of[patch],
              .weights = (const char *)u->pack.reals + (size_t)head[QP_HEAD_REALS] * (wide ? 8u : 4u),
              .points = head[QP_HEAD_POINTS],
              .ring_size = head[QP_HEAD_RING],
              .base = head[QP_HEAD_BASE],
              .shares = (head[QP_HEAD_FLAGS] & QP_PLAN_MODES) != 0,
              .wide = wide};
    v.order = v.ring + v.ring_size;
    v.anchors = v.order + v.ring_size;
    if ((head[QP_HEAD_FLAGS] & QP_PLAN_ANCHORS) != 0)
        v.anchored = u->pack.tree + head[QP_HEAD_TREE] + head[QP_HEAD_ANCHORS];
    return v;
}

/* Bits of element `at` of the weights, 0 for zeros of either sign. */
static uint64_t bits_at(const view *v, size_t at) {
    if (v->wide) {
        uint64_t bits;
        memcpy(&bits, v->weights + 8 * at, sizeof bits);
        return bits << 1 != 0 ? bits : 0;
    }
    uint32_t bits;
    memcpy(&bits, v->weights + 4 * at, sizeof bits);
    return bits << 1 != 0 ? bits : 0;
}

static uint64_t weight_bits(const view *v, uint32_t place, size_t point) {
    return bits_at(v, place * v->points + point);
}

static uint64_t share_bits(const view *v, size_t point) {
    return v->shares ? bits_at(v, v->ring_size * v->points + point) : 0;
}

static uint32_t anchor_of(const view *v, size_t point) {
    const uint32_t corner = v->anchored != NULL ? v->anchored[point >> 3] >> (point % 8 * 4) & 3u : v->base;
    return v->anchors[corner];
}

/* The next term of a point from the k-th of the order on; k is ring_size when there is none. */
static uint32_t next_term(const view *v, size_t point, uint32_t k) {
    while (k < v->ring_size && weight_bits(v, QP_RING_PLACE(v->order[k]), point) == 0) ++k;
    return k;
}

static bool same_point(const view *a, size_t i, const view *b, size_t j) {
    if (anchor_of(a, i) != anchor_of(b, j) || share_bits(a, i) != share_bits(b, j)) return false;
    for (uint32_t k = 0, l = 0;; ++k, ++l) {
        k = next_term(a, i, k);
        l = next_term(b, j, l);
        if (k == a->ring_size || l == b->ring_size) return k == a->ring_size && l == b->ring_size;
        const uint32_t x = QP_RING_PLACE(a->order[k]), y = QP_RING_PLACE(b->order[l]);
        if (a->ring[x] != b->ring[y] || weight_bits(a, x, i) != weight_bits(b, y, j)) return false;
    }
}

/* ---- hashes, in parallel ---- */

static uint64_t mixed(uint64_t hash, uint64_t word) {
    hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
}

typedef struct hash_job {
    const qp_unique *unique;
    uint64_t *hashes; /* [n_needed] */
} hash_job;

static void hash_patches(void *context, size_t begin, size_t end, unsigned worker) {
    const hash_job *job = context;
    (void)worker;
    for (size_t patch = begin; patch < end; ++patch) {
        if (job->unique->first[patch] == UINT64_MAX) continue;
        const view v = view_of(job->unique, patch);
        uint64_t *hashes = job->hashes + job->unique->first[patch];
        for (size_t i = 0; i < v.points; ++i) hashes[i] = mixed(anchor_of(&v, i), share_bits(&v, i));
        for (uint32_t k = 0; k < v.ring_size; ++k) {
            const uint32_t place = QP_RING_PLACE(v.order[k]);
            const uint64_t term = (uint64_t)v.ring[place] * 0xd6e8feb86659fd93u;
            for (size_t i = 0; i < v.points; ++i) {
                const uint64_t bits = weight_bits(&v, place, i);
                if (bits != 0) hashes[i] = mixed(hashes[i], term + bits);
            }
        }
    }
}

/* ---- numbers ---- */

/* The first patch that has a point, and which of its points it is. */
typedef struct holder {
    uint64_t hash;
    uint32_t patch, point;
} holder;

typedef struct numbering {
    qp_unique *unique;
    uint32_t *slots; /* [n_slots], a power of two: number + 1, or 0 */
    size_t n_slots;
    holder *holders;
    size_t capacity, level_capacity, share_capacity;
} numbering;

static bool resize(numbering *n, size_t n_slots) {
    uint32_t *slots = qp_alloc(n_slots, sizeof *slots, true);
    if (slots == NULL) return false;
    for (uint32_t i = 0; i < n->unique->n_points; ++i) {
        size_t s = (size_t)n->holders[i].hash & (n_slots - 1);
        while (slots[s] != 0) s = (s + 1) & (n_slots - 1);
        slots[s] = i + 1;
    }
    free(n->slots);
    n->slots = slots;
    n->n_slots = n_slots;
    return true;
}

/* Number of a point, entered if it is new. QP_NONE when memory is out. */
static uint32_t number_of(numbering *n, const view *v, uint64_t hash, uint32_t patch, uint32_t point) {
    qp_unique *u = n->unique;
    if (2 * ((size_t)u->n_points + 1) > n->n_slots && !resize(n, n->n_slots == 0 ? 4096 : 2 * n->n_slots))
        return QP_NONE;
    size_t s = (size_t)hash & (n->n_slots - 1);
    for (; n->slots[s] != 0; s = (s + 1) & (n->n_slots - 1)) {
        const holder *h = &n->holders[n->slots[s] - 1];
        if (h->hash != hash) continue;
        const view other = view_of(u, h->patch);
        if (same_point(v, point, &other, h->point)) return n->slots[s] - 1;
    }
    const size_t need = (size_t)u->n_points + 1;
    if (need >= QP_NONE || !qp_grow((void **)&n->holders, &n->capacity, need, sizeof *n->holders) ||
        !qp_grow((void **)&u->levels, &n->level_capacity, need, 1) ||
        !qp_grow((void **)&u->shares, &n->share_capacity, need, 1))
        return QP_NONE;
    n->holders[u->n_points] = (holder){hash, patch, point};
    u->levels[u->n_points] = QP_LEVELS;
    u->shares[u->n_points] = 0;
    n->slots[s] = u->n_points + 1;
    return u->n_points++;
}

static bool number_patch(numbering *n, const uint64_t *hashes, uint64_t patch) {
    qp_unique *u = n->unique;
    if (u->first[patch] == UINT64_MAX) return true;
    const view v = view_of(u, patch);
    const uint32_t *rows = u->pack.heads + u->head_of[patch] + QP_HEAD_ROWS;
    uint8_t level = 0;
    for (uint32_t i = 0; i < v.points; ++i) {
        const uint64_t at = u->first[patch] + i;
        const uint32_t number = number_of(n, &v, hashes[at], (uint32_t)patch, i);
        if (number == QP_NONE) return false;
        while (level + 1u < QP_LEVELS && rows[level] <= i) ++level;
        if (level < u->levels[number]) u->levels[number] = level;
        if (u->shares[number] < 255) ++u->shares[number];
        u->numbers[at] = number;
    }
    return true;
}

static bool number_all(qp_unique *u) {
    hash_job job = {u, qp_alloc(u->n_needed, sizeof *job.hashes, false)};
    u->numbers = qp_alloc(u->n_needed, sizeof *u->numbers, false);
    numbering n = {.unique = u};
    bool ok = job.hashes != NULL && u->numbers != NULL;
    if (ok) qp_parallel((size_t)u->n_surfaces * u->n_patches, 64, hash_patches, &job);
    for (uint64_t patch = 0; ok && patch < (uint64_t)u->n_surfaces * u->n_patches; ++patch) {
        ok = number_patch(&n, job.hashes, patch);
        if (patch + 1 == u->n_patches) u->n_base = u->n_points;
    }
    free(job.hashes);
    free(n.slots);
    free(n.holders);
    return ok;
}

/* ---- which patches hold a vertex ---- */

static bool list_patches(qp_unique *u) {
    const uint64_t patches = (uint64_t)u->n_surfaces * u->n_patches;
    uint64_t *offsets = u->vertex_offsets = qp_alloc((size_t)u->n_vertices + 2, sizeof *offsets, true);
    if (offsets == NULL) return false;
    /* offsets[v + 1] counts, then is where the next patch of v goes, and in the end where v's list ends. */
    for (uint64_t patch = 0; patch < patches; ++patch) {
        if (u->first[patch] == UINT64_MAX) continue;
        const view v = view_of(u, patch);
        for (uint32_t k = 0; k < v.ring_size; ++k) ++offsets[(size_t)v.ring[k] + 2];
    }
    for (uint32_t v = 0; v < u->n_vertices; ++v) offsets[v + 2] += offsets[v + 1];
    u->vertex_patches = qp_alloc(offsets[u->n_vertices + 1], sizeof *u->vertex_patches, false);
    if (u->vertex_patches == NULL) return false;
    for (uint64_t patch = 0; patch < patches; ++patch) {
        if (u->first[patch] == UINT64_MAX) continue;
        const view v = view_of(u, patch);
        for (uint32_t k = 0; k < v.ring_size; ++k)
            u->vertex_patches[offsets[(size_t)v.ring[k] + 1]++] = (uint32_t)patch;
    }
    return true;
}

/* ---- ---- */

/* Where each patch's plan and ring lie, and where its numbers go. */
static bool place_patches(const qp_frame *frame, qp_unique *u) {
    const size_t patches = (size_t)u->n_surfaces * u->n_patches;
    u->first = qp_alloc(patches, sizeof *u->first, false);
    u->ring_of = qp_alloc(patches, sizeof *u->ring_of, true);
    u->head_of = qp_alloc(patches, sizeof *u->head_of, true);
    if (u->first == NULL || u->ring_of == NULL || u->head_of == NULL) return false;
    size_t at = 0;
    for (uint32_t step = 0; step <= QP_PLAN_STEPS; ++step) {
        const qp_surface *s = step == 0 ? frame->surface : frame->deep[step - 1];
        if (s == NULL) continue;
        for (uint32_t p = 0; p < u->n_patches; ++p, ++at) {
            const uint32_t plan = s->patch_plan[p];
            u->first[at] = UINT64_MAX;
            if (plan == QP_NONE || (s->plans[plan]->flags & QP_PLAN_REGULAR) != 0) continue;
            u->first[at] = u->n_needed;
            u->head_of[at] = (frame->first_plan[step] + plan) * QP_HEAD_WORDS;
            u->ring_of[at] = frame->first_ring[step] + qp_frame_ring_word(s, p);
            u->n_needed += s->plans[plan]->point_count;
        }
    }
    return true;
}

qp_status qp_unique_create(const qp_frame *frame, qp_plan_pack *pack, uint32_t **rings, qp_unique **unique,
                           qp_error *err) {
    *unique = NULL;
    qp_unique *u = qp_alloc(1, sizeof *u, true);
    if (u == NULL) return qp_fail_memory(err, sizeof *u, "the numbers of control points");
    u->n_surfaces = 1;
    for (uint32_t step = 0; step < QP_PLAN_STEPS; ++step) u->n_surfaces += frame->deep[step] != NULL;
    u->n_patches = frame->surface->mesh->n_patches;
    u->n_vertices = frame->surface->mesh->n_vertices;
    u->precision = frame->options.precision;
    u->pack = *pack;
    u->rings = *rings;
    *pack = (qp_plan_pack){0};
    *rings = NULL;
    if ((uint64_t)u->n_surfaces * u->n_patches >= QP_NONE) {
        qp_unique_free(u);
        return qp_fail(err, QP_SYSTEM, "too many patches for a cache of control points");
    }
    if (!place_patches(frame, u) || !number_all(u) || !list_patches(u)) {
        const size_t bytes = (size_t)u->n_needed * 32;
        qp_unique_free(u);
        return qp_fail_memory(err, bytes, "the numbers of control points");
    }
    *unique = u;
    return QP_OK;
}

void qp_unique_free(qp_unique *u) {
    if (u == NULL) return;
    free(u->numbers);
    free(u->first);
    free(u->levels);
    free(u->shares);
    free(u->vertex_offsets);
    free(u->vertex_patches);
    free(u->pack.heads);
    free(u->pack.tree);
    free(u->pack.reals);
    free(u->rings);
    free(u->ring_of);
    free(u->head_of);
    free(u);
}

/* Marks the numbers of a patch's points that depend on a moved vertex. */
static void mark_patch(const qp_unique *u, uint64_t patch, const uint8_t *moved, uint8_t *marks) {
    const view v = view_of(u, patch);
    const uint32_t *numbers = u->numbers + u->first[patch];
    for (size_t i = 0; i < v.points; ++i)
        if (moved[anchor_of(&v, i)]) marks[numbers[i]] = 1;
    for (uint32_t k = 0; k < v.ring_size; ++k) {
        if (!moved[v.ring[k]]) continue;
        for (size_t i = 0; i < v.points; ++i)
            if (weight_bits(&v, k, i) != 0) marks[numbers[i]] = 1;
    }
}

qp_status qp_unique_affected(const qp_unique *u, const uint8_t *moved, uint32_t **list, uint32_t *count,
                             qp_error *err) {
    const size_t patches = (size_t)u->n_surfaces * u->n_patches;
    uint8_t *marks = qp_alloc(u->n_points, 1, true), *seen = qp_alloc(patches, 1, true);
    *list = NULL;
    *count = 0;
    if (marks != NULL && seen != NULL) {
        for (uint32_t v = 0; v < u->n_vertices; ++v) {
            for (uint64_t k = u->vertex_offsets[v]; moved[v] && k < u->vertex_offsets[v + 1]; ++k) {
                const uint32_t patch = u->vertex_patches[k];
                if (!seen[patch]) mark_patch(u, patch, moved, marks);
                seen[patch] = 1;
            }
        }
        for (uint32_t i = 0; i < u->n_points; ++i) *count += marks[i];
        *list = qp_alloc(*count, sizeof **list, false);
    }
    if (*list != NULL) {
        for (uint32_t i = 0, at = 0; i < u->n_points; ++i)
            if (marks[i]) (*list)[at++] = i;
    }
    free(marks);
    free(seen);
    return *list != NULL ? QP_OK : qp_fail_memory(err, u->n_points + patches, "moved control points");
}

uint64_t qp_unique_bytes(const qp_unique *u) {
    const uint64_t patches = (uint64_t)u->n_surfaces * u->n_patches;
    return u->n_needed * sizeof *u->numbers + 2 * (uint64_t)u->n_points +
           patches * (2 * sizeof(uint64_t) + sizeof(uint32_t)) +
           ((uint64_t)u->n_vertices + 2) * sizeof(uint64_t) +
           u->vertex_offsets[u->n_vertices] * sizeof(uint32_t);
}
