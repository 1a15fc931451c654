/* Lists of copies from owners' samples, and the copying. */
#include "host/frame/share.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Signed coordinates (kernels/frame_layout.h), in double ---- */

static double signed_of(double x) {
    return x <= 0.5 ? x : -(1.0 - x);
}
static double mirrored(double s) {
    return s == 0.5 ? s : -s;
}
/* 2x - upper. */
static double in_half(double s, bool upper) {
    const double d = 2.0 * fabs(s), lower = d <= 0.5 ? d : -(1.0 - d);
    return upper ? mirrored(lower) : lower;
}

/* Place t along an edge of a patch. */
static qp_ghost ghost_on_edge(qp_side side, double t) {
    switch (side.index) {
    case 0:
        return (qp_ghost){side.patch, t, 0.0};
    case 1:
        return (qp_ghost){side.patch, -0.0, t};
    case 2:
        return (qp_ghost){side.patch, mirrored(t), -0.0};
    default:
        return (qp_ghost){side.patch, 0.0, mirrored(t)};
    }
}
static qp_ghost ghost_at_corner(qp_side side) {
    return ghost_on_edge(side, 0.0); /* edge k starts at corner k */
}

/* ---- What is found goes to a list, or is counted first ---- */

typedef struct sink {
    qp_copy *copies;  /* NULL: count only */
    qp_ghost *ghosts; /* likewise */
    size_t n_copies, n_ghosts;
    qp_copy open; /* the run at hand; count 0: none */
} sink;

static void close_run(sink *s) {
    if (s->open.count == 0) return;
    if (s->copies != NULL) s->copies[s->n_copies] = s->open;
    ++s->n_copies;
    s->open.count = 0;
}

static void add_copy(sink *s, uint64_t to, uint64_t from, uint8_t fields) {
    qp_copy *run = &s->open;
    /* Copies from ghosts stay single: their places are not known yet. */
    if (run->count != 0 && run->fields == fields && to == run->to + run->count && from < QP_SHARE_GHOST) {
        if (run->count == 1 && (from == run->from + 1 || from + 1 == run->from)) {
            run->step = from > run->from ? 1 : -1;
            run->count = 2;
            return;
        }
        if (run->count > 1 && from == run->from + (uint64_t)((int64_t)run->count * run->step)) {
            ++run->count;
            return;
        }
    }
    close_run(s);
    *run = (qp_copy){.to = to, .from = from, .count = 1, .step = 1, .fields = fields};
}

/* Number of a new ghost, as a source; in the list, ghosts of this sink begin at `first`. */
static uint64_t add_ghost(sink *s, size_t first, qp_ghost ghost) {
    if (s->ghosts != NULL) s->ghosts[s->n_ghosts] = ghost;
    return QP_SHARE_GHOST + first + s->n_ghosts++;
}

/* ---- Tessellations ---- */

typedef struct share_job {
    const qp_share *share;
    const uint64_t *first_part;
    const qp_share_part *parts;
    /* [n_faces + 1]: counted by face, then summed up to what lies before each. */
    size_t *first_copy, *first_ghost;
    qp_copy *copies; /* NULL while counting */
    qp_ghost *ghosts;
} share_job;

/* Samples along one edge of a patch, in its direction; both ends included, and the middle twice when the patch is quartered. */
typedef struct run {
    const qp_share_part *part[2];
    uint32_t count[2], edge;
} run;

/* Quarters along each edge. */
static const uint8_t quarters[4][2] = {{0, 1}, {1, 3}, {3, 2}, {2, 0}};

static run open_run(const share_job *job, qp_side side) {
    const uint64_t first = job->first_part[side.patch], n = job->first_part[side.patch + 1] - first;
    run r = {.edge = side.index};
    for (uint32_t i = 0; i < 2 && i < n; ++i) {
        if (n == 1 && i == 1) break;
        const qp_share_part *part = &job->parts[n == 1 ? first : first + quarters[side.index][i]];
        const qp_rim *rim = part->rim;
        const uint32_t begin = rim->corner[side.index], end = rim->corner[(side.index + 1) & 3u];
        r.part[i] = part;
        r.count[i] = (end > begin ? end - begin : end + rim->count - begin) + 1;
    }
    return r;
}

/* Sample j of a run, and the place it has along the edge. */
static uint64_t run_sample(const run *r, uint32_t j, float *t) {
    const uint32_t i = j >= r->count[0], k = j - (i ? r->count[0] : 0);
    const qp_share_part *part = r->part[i];
    uint32_t at = part->rim->corner[r->edge] + k;
    if (at >= part->rim->count) at -= part->rim->count;
    const float *uv = part->uv + 2 * (size_t)at, x = (r->edge & 1u) ? uv[1] : uv[0];
    *t = r->edge < 2 ? x : 1.0f - x;
    return part->out + at;
}

/* The sample of a run that lies exactly at t; *near: where to begin to look, and where it was. */
static bool find_sample(const run *r, float t, uint32_t *near, uint64_t *sample) {
    const uint32_t count = r->count[0] + r->count[1];
    uint32_t j = *near < count ? *near : count - 1;
    float at;
    if (count == 0) return false;
    *sample = run_sample(r, j, &at);
    while (at < t && j + 1 < count) *sample = run_sample(r, ++j, &at);
    while (at > t && j > 0) *sample = run_sample(r, --j, &at);
    *near = j;
    return at == t;
}

static void share_edge(const share_job *job, sink *s, size_t first_ghost, qp_side side,
                       const qp_edge_owner *owner) {
    const run mine = open_run(job, side);
    const uint32_t count = mine.count[0] + mine.count[1];
    run theirs[2];
    theirs[0] = theirs[1] = open_run(job, owner->side[0]);
    if (owner->split) theirs[1] = open_run(job, owner->side[1]);
    uint32_t near[2] = {owner->reversed ? UINT32_MAX : 0, owner->reversed ? UINT32_MAX : 0};
    const uint8_t fields = QP_SHARE_POSITION | (owner->normal ? QP_SHARE_NORMAL : QP_SHARE_DEPTH);
    for (uint32_t j = 1; j + 1 < count; ++j) {
        float t;
        const uint64_t to = run_sample(&mine, j, &t);
        uint32_t half = 0;
        if (owner->reversed) t = 1.0f - t;
        if (owner->split) {
            half = t > 0.5f;
            t = half ? 2.0f * t - 1.0f : 2.0f * t;
        }
        uint64_t from;
        if (!find_sample(&theirs[half], t, &near[half], &from))
            from = add_ghost(s, first_ghost, ghost_on_edge(owner->side[half], signed_of((double)t)));
        add_copy(s, to, from, fields);
    }
}

/* The sample at a corner of a patch; false when the patch has none. */
static bool corner_sample(const share_job *job, qp_side side, uint64_t *sample) {
    const uint64_t first = job->first_part[side.patch], n = job->first_part[side.patch + 1] - first;
    if (n == 0) return false;
    const qp_share_part *part = &job->parts[n == 1 ? first : first + quarters[side.index][0]];
    *sample = part->out + part->rim->corner[side.index];
    return true;
}

static void share_corner(const share_job *job, sink *s, size_t first_ghost, qp_side side,
                         const qp_corner_owner *owner) {
    const qp_side from[2] = {owner->position, owner->normal};
    const bool both = from[0].patch == from[1].patch;
    uint64_t to, source;
    if (!corner_sample(job, side, &to)) return;
    for (int i = 0; i < (both ? 1 : 2); ++i) {
        if (from[i].patch == QP_NONE || from[i].patch == side.patch) continue;
        if (!corner_sample(job, from[i], &source))
            source = add_ghost(s, first_ghost, ghost_at_corner(from[i]));
        add_copy(s, to, source,
                 (uint8_t)(both     ? QP_SHARE_POSITION | QP_SHARE_NORMAL
                           : i == 0 ? QP_SHARE_POSITION
                                    : QP_SHARE_NORMAL));
    }
}

static void share_faces(void *context, size_t begin, size_t end, unsigned worker) {
    share_job *job = context;
    const qp_mesh *mesh = job->share->surface->mesh;
    (void)worker;
    for (size_t f = begin; f < end; ++f) {
        const uint32_t face = (uint32_t)f, first = mesh->patch_offsets[face];
        sink s = {0};
        size_t first_ghost = 0;
        if (job->copies != NULL) {
            s.copies = job->copies + job->first_copy[f];
            s.ghosts = job->ghosts + job->first_ghost[f];
            first_ghost = job->first_ghost[f];
        }
        for (uint32_t p = first; p < mesh->patch_offsets[face + 1]; ++p) {
            if (job->first_part[p] == job->first_part[p + 1]) continue;
            for (uint32_t k = 0; k < 4; ++k) {
                const qp_side side = {p, k};
                const qp_corner_owner corner = qp_share_corner(job->share, face, p - first, k);
                share_corner(job, &s, first_ghost, side, &corner);
                const qp_edge_owner edge = qp_share_edge(job->share, face, p - first, k);
                if (!edge.own) share_edge(job, &s, first_ghost, side, &edge);
            }
        }
        close_run(&s);
        if (job->copies != NULL) continue;
        job->first_copy[f] = s.n_copies;
        job->first_ghost[f] = s.n_ghosts;
    }
}

/* Makes each count the sum of those before it; returns the sum of all. */
static size_t sum_up(size_t *counts, uint32_t n) {
    size_t sum = 0;
    for (uint32_t i = 0; i < n; ++i) {
        const size_t count = counts[i];
        counts[i] = sum;
        sum += count;
    }
    return sum;
}

qp_status qp_share_tessellation(const qp_share *share, const uint64_t *first_part, const qp_share_part *parts,
                                qp_copies *copies, qp_ghosts *ghosts, qp_error *err) {
    const uint32_t n_faces = share->surface->mesh->n_faces;
    share_job job = {.share = share, .first_part = first_part, .parts = parts};
    *copies = (qp_copies){0};
    *ghosts = (qp_ghosts){0};
    job.first_copy = qp_alloc(n_faces, sizeof *job.first_copy, true);
    job.first_ghost = qp_alloc(n_faces, sizeof *job.first_ghost, true);
    qp_status status = QP_OK;
    if (job.first_copy != NULL && job.first_ghost != NULL) {
        qp_parallel(n_faces, 64, share_faces, &job);
        copies->count = copies->capacity = sum_up(job.first_copy, n_faces);
        ghosts->count = ghosts->capacity = sum_up(job.first_ghost, n_faces);
        job.copies = copies->list = qp_alloc(copies->count, sizeof *copies->list, false);
        job.ghosts = ghosts->list = qp_alloc(ghosts->count, sizeof *ghosts->list, false);
    }
    if (job.copies == NULL || job.ghosts == NULL) {
        status = qp_fail_memory(err, copies->count * sizeof *copies->list, "shared samples");
        free(copies->list);
        free(ghosts->list);
        *copies = (qp_copies){0};
        *ghosts = (qp_ghosts){0};
    } else {
        qp_parallel(n_faces, 64, share_faces, &job);
    }
    free(job.first_copy);
    free(job.first_ghost);
    return status;
}

/* ---- Points ---- */

static qp_status append(qp_copies *copies, qp_ghosts *ghosts, uint64_t to, qp_ghost ghost, uint8_t fields,
                        qp_error *err) {
    if (!qp_grow((void **)&copies->list, &copies->capacity, copies->count + 1, sizeof *copies->list) ||
        !qp_grow((void **)&ghosts->list, &ghosts->capacity, ghosts->count + 1, sizeof *ghosts->list))
        return qp_fail_memory(err, copies->count * sizeof *copies->list, "shared samples");
    copies->list[copies->count++] = (qp_copy){to, QP_SHARE_GHOST + ghosts->count, 1, 1, fields};
    ghosts->list[ghosts->count++] = ghost;
    return QP_OK;
}

qp_status qp_share_point(const qp_share *share, uint32_t patch, double u, double v, uint64_t to,
                         qp_copies *copies, qp_ghosts *ghosts, qp_error *err) {
    const bool at_u = u == 0.0 || u == 1.0, at_v = v == 0.0 || v == 1.0;
    if (!at_u && !at_v) return QP_OK;
    uint32_t child;
    const uint32_t face = qp_patch_face(share->surface->mesh, patch, &child);
    if (at_u && at_v) {
        const uint32_t corner = v == 0.0 ? (u == 0.0 ? 0 : 1) : (u == 0.0 ? 3 : 2);
        const qp_corner_owner owner = qp_share_corner(share, face, child, corner);
        qp_status status = QP_OK;
        const bool both = owner.position.patch == owner.normal.patch;
        if (owner.position.patch != patch)
            status = append(copies, ghosts, to, ghost_at_corner(owner.position),
                            both ? QP_SHARE_POSITION | QP_SHARE_NORMAL : QP_SHARE_POSITION, err);
        if (status == QP_OK && !both && owner.normal.patch != QP_NONE && owner.normal.patch != patch)
            status = append(copies, ghosts, to, ghost_at_corner(owner.normal), QP_SHARE_NORMAL, err);
        return status;
    }
    const uint32_t edge = at_u ? (u == 0.0 ? 3 : 1) : (v == 0.0 ? 0 : 2);
    const qp_edge_owner owner = qp_share_edge(share, face, child, edge);
    if (owner.own) return QP_OK;
    double t = signed_of(at_u ? v : u);
    if (edge >= 2) t = mirrored(t);
    if (owner.reversed) t = mirrored(t);
    uint32_t half = 0;
    if (owner.split) {
        half = signbit(t) != 0;
        t = in_half(t, half != 0);
    }
    return append(copies, ghosts, to, ghost_on_edge(owner.side[half], t),
                  QP_SHARE_POSITION | (owner.normal ? QP_SHARE_NORMAL : QP_SHARE_DEPTH), err);
}

/* ---- Copying ---- */

typedef struct copy_job {
    const qp_copy *list;
    size_t real_size;
    char *vertices;
    uint8_t *flags;
} copy_job;

static void copy_some(void *context, size_t begin, size_t end, unsigned worker) {
    const copy_job *job = context;
    const size_t half = 3 * job->real_size;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        const qp_copy *c = &job->list[i];
        const bool position = (c->fields & QP_SHARE_POSITION) != 0,
                   normal = (c->fields & QP_SHARE_NORMAL) != 0;
        const uint64_t first = c->step > 0 ? c->from : c->from - (c->count - 1);
        const size_t skip = position ? 0 : half, bytes = position && normal ? 2 * half : half;
        for (uint32_t k = 0; k < c->count; ++k) {
            const uint64_t to = c->to + k, from = first + (c->step > 0 ? k : c->count - 1 - k);
            memcpy(job->vertices + to * 2 * half + skip, job->vertices + from * 2 * half + skip, bytes);
            if (normal)
                job->flags[to] = (uint8_t)((job->flags[to] & QP_SAMPLE_LIMIT_FRAME) |
                                           (job->flags[from] & ~QP_SAMPLE_LIMIT_FRAME));
            else if (c->fields & QP_SHARE_DEPTH)
                job->flags[to] |= job->flags[from] & QP_SAMPLE_PAST_DEPTH;
        }
    }
}

void qp_copies_apply(const qp_copies *copies, size_t real_size, void *vertices, uint8_t *flags) {
    copy_job job = {copies->list, real_size, vertices, flags};
    qp_parallel(copies->count, 512, copy_some, &job);
}
