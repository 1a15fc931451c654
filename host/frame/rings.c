/* The 1-rings of patches as the hull reads them (kernels/frame_layout.h): in which order it adds up, and relative to which vertices.
 *
 * Sums of rounded numbers depend on their order, so it is made of what all patches see alike, the numbers of the base vertices: a
 * point that several patches need then has the same bits in all of them (host/plan/anchor.c). Vertices that are not in
 * its stencil have weight 0 and change nothing. Around vertices of valences in the hundreds sums are long, and are made of partial
 * sums: of n terms in parts of about sqrt(n) the error grows with the length of a part and their number. Which vertices make a part must
 * not depend on the patch either: those whose numbers hash alike. Meshes without such vertices have one part. */
#include "host/frame/frame.h"
#include "kernels/frame_layout.h"

#include <stdlib.h>

/* Longest ring that is added up in one part. */
enum { ONE_PART = 64 };

typedef struct term {
    uint32_t part, vertex, place;
} term;

static int in_order(const void *a, const void *b) {
    const term *x = a, *y = b;
    if (x->part != y->part) return x->part < y->part ? -1 : 1;
    if (x->vertex != y->vertex) return x->vertex < y->vertex ? -1 : 1;
    return x->place < y->place ? -1 : x->place > y->place;
}

/* Bits of the part's number for rings of up to `widest` vertices. */
static uint32_t part_bits(const qp_surface *surface) {
    uint32_t widest = 0, bits = 0;
    for (uint32_t p = 0; p < surface->n_plans; ++p)
        if (surface->plans[p]->ring_size > widest) widest = surface->plans[p]->ring_size;
    if (widest <= ONE_PART) return 0;
    while (1u << 2 * bits < widest) ++bits;
    return bits;
}

/* Fibonacci hashing: the highest bits of a multiple of 2^32 over the golden ratio. */
static uint32_t part_of(uint32_t vertex, uint32_t bits) {
    return bits == 0 ? 0 : vertex * 2654435769u >> (32 - bits);
}

static void sort_terms(term *terms, uint32_t n) {
    if (n > 64) {
        qsort(terms, n, sizeof *terms, in_order);
        return;
    }
    for (uint32_t i = 1; i < n; ++i) {
        const term t = terms[i];
        uint32_t k = i;
        for (; k > 0 && in_order(&t, &terms[k - 1]) < 0; --k) terms[k] = terms[k - 1];
        terms[k] = t;
    }
}

static uint32_t lowest(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

/* The vertices that the corners of a patch are anchored to, in the plan's frame: base vertices are their own; in the middle
 * of an edge or of an n-gon it is the lowest one there. */
static void find_anchors(const qp_mesh *mesh, uint32_t face, uint32_t child, uint32_t rotation,
                         uint32_t anchors[4]) {
    const uint32_t *v = mesh->face_vertices + mesh->face_offsets[face], n = qp_face_size(mesh, face);
    if (n == 4) {
        for (uint32_t c = 0; c < 4; ++c) anchors[c] = v[(c + rotation) % 4];
        return;
    }
    const uint32_t next = v[(child + 1) % n], previous = v[(child + n - 1) % n];
    uint32_t least = v[0];
    for (uint32_t i = 1; i < n; ++i) least = lowest(least, v[i]);
    const uint32_t own[4] = {v[child], lowest(v[child], next), least, lowest(v[child], previous)};
    for (uint32_t c = 0; c < 4; ++c) anchors[c] = own[(c + rotation) % 4];
}

typedef struct ring_job {
    const qp_surface *surface;
    uint32_t bits;
    uint32_t *words;
    bool failed; /* memory is out */
} ring_job;

/* terms: scratch, [ring_size]. */
static void write_ring(const ring_job *job, uint32_t face, uint32_t child, uint32_t patch, term *terms) {
    const qp_surface *s = job->surface;
    const uint32_t *ring = s->rings + s->patch_ring[patch];
    const uint32_t n = s->plans[s->patch_plan[patch]]->ring_size;
    uint32_t *out = job->words + qp_frame_ring_word(s, patch);
    for (uint32_t k = 0; k < n; ++k) {
        out[k] = ring[k];
        terms[k] = (term){part_of(ring[k], job->bits), ring[k], k};
    }
    sort_terms(terms, n);
    for (uint32_t k = 0; k < n; ++k)
        out[n + k] = terms[k].place | (k == 0 || terms[k].part != terms[k - 1].part ? QP_RING_PART : 0u);
    find_anchors(s->mesh, face, child, s->patch_rotation[patch], out + 2 * (size_t)n);
}

static void write_faces(void *context, size_t begin, size_t end, unsigned worker) {
    ring_job *job = context;
    const qp_surface *s = job->surface;
    term *terms = NULL;
    size_t capacity = 0;
    (void)worker;
    for (size_t face = begin; face < end; ++face) {
        const uint32_t first = s->mesh->patch_offsets[face], last = s->mesh->patch_offsets[face + 1];
        for (uint32_t p = first; p < last; ++p) {
            if (s->patch_plan[p] == QP_NONE) continue;
            if (!qp_grow((void **)&terms, &capacity, s->plans[s->patch_plan[p]]->ring_size, sizeof *terms)) {
                __atomic_store_n(&job->failed, true, __ATOMIC_RELAXED);
                break;
            }
            write_ring(job, (uint32_t)face, p - first, p, terms);
        }
    }
    free(terms);
}

qp_status qp_frame_upload_rings(qp_frame *frame, const qp_surface *const *surfaces, uint32_t n_surfaces,
                                uint32_t **kept, qp_error *err) {
    uint64_t count = 0, at = 0;
    for (uint32_t s = 0; s < n_surfaces; ++s) count += qp_frame_ring_words(surfaces[s]);
    uint32_t *words = *kept = qp_alloc((size_t)count, sizeof *words, false);
    if (words == NULL) return qp_fail_memory(err, (size_t)count * sizeof *words, "1-rings");
    bool failed = false;
    for (uint32_t s = 0; s < n_surfaces && !failed; at += qp_frame_ring_words(surfaces[s++])) {
        ring_job job = {surfaces[s], part_bits(frame->surface), words + at, false};
        qp_parallel(surfaces[s]->mesh->n_faces, 256, write_faces, &job);
        failed = job.failed;
    }
    qp_status status =
        failed ? qp_fail_memory(err, (size_t)count * sizeof *words, "1-rings")
               : qp_frame_upload(frame, &frame->rings, words, (size_t)count * sizeof *words, "1-rings", err);
    return status;
}

uint32_t qp_frame_origin(const qp_surface *surface, uint32_t patch) {
    const qp_plan *plan = surface->plans[surface->patch_plan[patch]];
    if ((plan->flags & QP_PLAN_REGULAR) != 0) return surface->rings[surface->patch_ring[patch]];
    uint32_t child, anchors[4];
    const uint32_t face = qp_patch_face(surface->mesh, patch, &child);
    find_anchors(surface->mesh, face, child, surface->patch_rotation[patch], anchors);
    return anchors[plan->base];
}
