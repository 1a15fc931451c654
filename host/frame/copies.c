/* Lists of copies from owners' samples, and the copying. */
#include "host/frame/coordinate.h"
#include "host/frame/share.h"

#include <stdlib.h>
#include <string.h>

/* ---- Signed coordinates (kernels/frame_layout.h), in double ---- */

static double signed_of(double x) {
    return x <= 0.5 ? x : -(1.0 - x);
}

/* Place t along an edge of a patch. */
static qp_ghost ghost_on_edge(qp_side side, double t) {
    switch (side.index) {
    case 0:
        return (qp_ghost){side.patch, QP_LEVELS - 1, t, 0.0};
    case 1:
        return (qp_ghost){side.patch, QP_LEVELS - 1, -0.0, t};
    case 2:
        return (qp_ghost){side.patch, QP_LEVELS - 1, qp_coordinate_mirrored(t), -0.0};
    default:
        return (qp_ghost){side.patch, QP_LEVELS - 1, 0.0, qp_coordinate_mirrored(t)};
    }
}
static qp_ghost ghost_at_corner(qp_side side) {
    return ghost_on_edge(side, 0.0); /* edge k starts at corner k */
}

/* ---- What is found goes to a list ---- */

/* The copies and ghosts of some faces. Sources that are ghosts are numbered from QP_SHARE_GHOST on in each sink. */
typedef struct sink {
    qp_copies copies;
    qp_ghosts ghosts;
    bool failed; /* memory is out */
} sink;

static void add_copy(sink *s, uint64_t to, uint64_t from, uint8_t fields) {
    qp_copy *run = s->copies.count != 0 ? &s->copies.list[s->copies.count - 1] : NULL;
    /* Copies from ghosts stay single: their places are not known yet. */
    if (run != NULL && run->fields == fields && to == run->to + run->count && from < QP_SHARE_GHOST) {
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
    if (!qp_grow((void **)&s->copies.list, &s->copies.capacity, s->copies.count + 1,
                 sizeof *s->copies.list)) {
        s->failed = true;
        return;
    }
    s->copies.list[s->copies.count++] =
        (qp_copy){.to = to, .from = from, .count = 1, .step = 1, .fields = fields};
}

/* Number of a new ghost, as a source. */
static uint64_t add_ghost(sink *s, qp_ghost ghost) {
    if (!qp_grow((void **)&s->ghosts.list, &s->ghosts.capacity, s->ghosts.count + 1,
                 sizeof *s->ghosts.list)) {
        s->failed = true;
        return QP_SHARE_GHOST;
    }
    s->ghosts.list[s->ghosts.count] = ghost;
    return QP_SHARE_GHOST + s->ghosts.count++;
}

/* ---- Tessellations ---- */

typedef struct share_job {
    const qp_share *share;
    const qp_share_parts *parts;
    uint32_t block; /* patches a sink */
    sink *sinks;    /* one a block */
} share_job;

/* Samples of other patches have numbers of their own: this bit, the part, and which one of it. */
#define OUTSIDE (UINT64_C(1) << 62)
enum { OUTSIDE_SHIFT = 16 }; /* no rim has so many */

/* The parts of a patch, and how many there are. */
static const qp_share_part *find_parts(const qp_share_parts *all, uint32_t patch, size_t *n) {
    const size_t *place;
    if (patch >= all->first && patch < all->end) {
        place = all->first_part + (patch - all->first);
    } else {
        size_t low = 0, high = all->n_others;
        while (low < high) {
            const size_t middle = low + (high - low) / 2;
            if (all->others[middle] < patch)
                low = middle + 1;
            else
                high = middle;
        }
        place = all->others_part + low;
    }
    *n = place[1] - place[0];
    return all->parts + place[0];
}

/* Number of a sample of a part. */
static uint64_t part_sample(const share_job *job, const qp_share_part *part, uint32_t at) {
    if (part->patch >= job->parts->first && part->patch < job->parts->end) return part->out + at;
    return OUTSIDE | (uint64_t)(part - job->parts->parts) << OUTSIDE_SHIFT | at;
}

/* A sample to copy from: one of the stream as it is, another one as a ghost. */
static uint64_t source_of(const share_job *job, sink *s, uint64_t sample) {
    if ((sample & OUTSIDE) == 0) return sample;
    const qp_share_part *part = &job->parts->parts[(sample & ~OUTSIDE) >> OUTSIDE_SHIFT];
    const float *uv = part->uv + 2 * (size_t)(sample & ((1u << OUTSIDE_SHIFT) - 1));
    return add_ghost(s, (qp_ghost){part->patch, part->level, (double)uv[0], (double)uv[1]});
}

/* Samples along one edge of a patch, in its direction; both ends included, and the middle twice when the patch is quartered. */
typedef struct run {
    const qp_share_part *part[2];
    uint32_t count[2], edge;
} run;

/* Quarters along each edge. */
static const uint8_t quarters[4][2] = {{0, 1}, {1, 3}, {3, 2}, {2, 0}};

static run open_run(const share_job *job, qp_side side) {
    size_t n;
    const qp_share_part *parts = find_parts(job->parts, side.patch, &n);
    run r = {.edge = side.index};
    for (uint32_t i = 0; i < 2 && i < n; ++i) {
        if (n == 1 && i == 1) break;
        const qp_share_part *part = &parts[n == 1 ? 0 : quarters[side.index][i]];
        const qp_rim *rim = part->rim;
        const uint32_t begin = rim->corner[side.index], end = rim->corner[(side.index + 1) & 3u];
        r.part[i] = part;
        r.count[i] = (end > begin ? end - begin : end + rim->count - begin) + 1;
    }
    return r;
}

/* Sample j of a run, and the place it has along the edge. */
static uint64_t run_sample(const share_job *job, const run *r, uint32_t j, float *t) {
    const uint32_t i = j >= r->count[0], k = j - (i ? r->count[0] : 0);
    const qp_share_part *part = r->part[i];
    uint32_t at = part->rim->corner[r->edge] + k;
    if (at >= part->rim->count) at -= part->rim->count;
    const float *uv = part->uv + 2 * (size_t)at, x = (r->edge & 1u) ? uv[1] : uv[0];
    *t = r->edge < 2 ? x : 1.0f - x;
    return part_sample(job, part, at);
}

/* The sample of a run that lies exactly at t; *near: where to begin to look, and where it was. */
static bool find_sample(const share_job *job, const run *r, float t, uint32_t *near, uint64_t *sample) {
    const uint32_t count = r->count[0] + r->count[1];
    uint32_t j = *near < count ? *near : count - 1;
    float at;
    if (count == 0) return false;
    *sample = run_sample(job, r, j, &at);
    while (at < t && j + 1 < count) *sample = run_sample(job, r, ++j, &at);
    while (at > t && j > 0) *sample = run_sample(job, r, --j, &at);
    *near = j;
    return at == t;
}

static void share_edge(const share_job *job, sink *s, qp_side side, const qp_edge_owner *owner) {
    const run mine = open_run(job, side);
    const uint32_t count = mine.count[0] + mine.count[1];
    run theirs[2];
    theirs[0] = theirs[1] = open_run(job, owner->side[0]);
    if (owner->split) theirs[1] = open_run(job, owner->side[1]);
    uint32_t near[2] = {owner->reversed ? UINT32_MAX : 0, owner->reversed ? UINT32_MAX : 0};
    const uint8_t fields = QP_SHARE_POSITION | (owner->normal ? QP_SHARE_NORMAL : QP_SHARE_DEPTH);
    for (uint32_t j = 1; j + 1 < count; ++j) {
        float t;
        const uint64_t to = run_sample(job, &mine, j, &t);
        uint32_t half = 0;
        if (owner->reversed) t = 1.0f - t;
        if (owner->split) {
            half = t > 0.5f;
            t = half ? 2.0f * t - 1.0f : 2.0f * t;
        }
        uint64_t from;
        if (find_sample(job, &theirs[half], t, &near[half], &from))
            from = source_of(job, s, from);
        else
            from = add_ghost(s, ghost_on_edge(owner->side[half], signed_of((double)t)));
        add_copy(s, to, from, fields);
    }
}

/* The sample at a corner of a patch; false when the patch has none. */
static bool corner_sample(const share_job *job, qp_side side, uint64_t *sample) {
    size_t n;
    const qp_share_part *parts = find_parts(job->parts, side.patch, &n);
    if (n == 0) return false;
    const qp_share_part *part = &parts[n == 1 ? 0 : quarters[side.index][0]];
    *sample = part_sample(job, part, part->rim->corner[side.index]);
    return true;
}

static void share_corner(const share_job *job, sink *s, qp_side side, const qp_corner_owner *owner) {
    const qp_side from[2] = {owner->position, owner->normal};
    const bool both = from[0].patch == from[1].patch;
    uint64_t to, source;
    if (!corner_sample(job, side, &to)) return;
    for (int i = 0; i < (both ? 1 : 2); ++i) {
        if (from[i].patch == QP_NONE || from[i].patch == side.patch) continue;
        if (corner_sample(job, from[i], &source))
            source = source_of(job, s, source);
        else
            source = add_ghost(s, ghost_at_corner(from[i]));
        add_copy(s, to, source,
                 (uint8_t)(both     ? QP_SHARE_POSITION | QP_SHARE_NORMAL
                           : i == 0 ? QP_SHARE_POSITION
                                    : QP_SHARE_NORMAL));
    }
}

/* A patch, with its face and place in it. */
typedef struct patch_place {
    uint32_t patch, face, child;
} patch_place;

static patch_place place_of(const qp_mesh *mesh, uint32_t patch) {
    patch_place at = {.patch = patch};
    at.face = qp_patch_face(mesh, patch, &at.child);
    return at;
}
static void go_on(const qp_mesh *mesh, patch_place *at) {
    ++at->patch;
    ++at->child;
    while (at->face + 1 < mesh->n_faces && mesh->patch_offsets[at->face + 1] <= at->patch) {
        ++at->face;
        at->child = 0;
    }
}

static void share_patch(const share_job *job, const patch_place *at, sink *s) {
    for (uint32_t k = 0; k < 4; ++k) {
        const qp_side side = {at->patch, k};
        const qp_corner_owner corner = qp_share_corner(job->share, at->face, at->child, k);
        share_corner(job, s, side, &corner);
        const qp_edge_owner edge = qp_share_edge(job->share, at->face, at->child, k);
        if (!edge.own) share_edge(job, s, side, &edge);
    }
}

static void share_blocks(void *context, size_t begin, size_t end, unsigned worker) {
    const share_job *job = context;
    const qp_share_parts *parts = job->parts;
    const qp_mesh *mesh = job->share->surface->mesh;
    (void)worker;
    for (size_t b = begin; b < end; ++b) {
        const uint32_t first = (uint32_t)b * job->block, left = parts->end - parts->first - first;
        patch_place at = place_of(mesh, parts->first + first);
        for (uint32_t i = 0; i < (left < job->block ? left : job->block); ++i, go_on(mesh, &at)) {
            if (parts->first_part[first + i] != parts->first_part[first + i + 1])
                share_patch(job, &at, &job->sinks[b]);
        }
    }
}

/* Joins the sinks, ghosts numbered anew. */
static qp_status join_sinks(const sink *sinks, size_t n_sinks, qp_copies *copies, qp_ghosts *ghosts,
                            qp_error *err) {
    bool failed = false;
    for (size_t b = 0; b < n_sinks; ++b) {
        copies->capacity += sinks[b].copies.count;
        ghosts->capacity += sinks[b].ghosts.count;
        failed = failed || sinks[b].failed;
    }
    copies->list = qp_alloc(copies->capacity, sizeof *copies->list, false);
    ghosts->list = qp_alloc(ghosts->capacity, sizeof *ghosts->list, false);
    if (failed || copies->list == NULL || ghosts->list == NULL) {
        const size_t bytes = copies->capacity * sizeof *copies->list;
        free(copies->list);
        free(ghosts->list);
        *copies = (qp_copies){0};
        *ghosts = (qp_ghosts){0};
        return qp_fail_memory(err, bytes, "shared samples");
    }
    for (size_t b = 0; b < n_sinks; ++b) {
        for (size_t i = 0; i < sinks[b].copies.count; ++i) {
            qp_copy copy = sinks[b].copies.list[i];
            if (copy.from >= QP_SHARE_GHOST) copy.from += ghosts->count;
            copies->list[copies->count++] = copy;
        }
        for (size_t i = 0; i < sinks[b].ghosts.count; ++i)
            ghosts->list[ghosts->count++] = sinks[b].ghosts.list[i];
    }
    return QP_OK;
}

qp_status qp_share_tessellation(const qp_share *share, const qp_share_parts *parts, qp_copies *copies,
                                qp_ghosts *ghosts, qp_error *err) {
    const uint32_t n = parts->end - parts->first;
    /* Few patches go to all threads as well. */
    share_job job = {share, parts, n > 4096 ? 256 : n / 16 + 1, NULL};
    const size_t n_sinks = ((size_t)n + job.block - 1) / job.block;
    *copies = (qp_copies){0};
    *ghosts = (qp_ghosts){0};
    job.sinks = qp_alloc(n_sinks, sizeof *job.sinks, true);
    if (job.sinks == NULL) return qp_fail_memory(err, n_sinks * sizeof *job.sinks, "shared samples");
    qp_parallel(n_sinks, 1, share_blocks, &job);
    qp_status status = join_sinks(job.sinks, n_sinks, copies, ghosts, err);
    for (size_t b = 0; b < n_sinks; ++b) {
        free(job.sinks[b].copies.list);
        free(job.sinks[b].ghosts.list);
    }
    free(job.sinks);
    return status;
}

/* ---- Owners outside ---- */

static bool add_other(qp_patch_list *others, uint32_t first, uint32_t end, uint32_t patch) {
    if (patch == QP_NONE || (patch >= first && patch < end)) return true;
    /* Most of them come several times in a row. */
    for (size_t i = others->count; i > 0 && i + 4 > others->count; --i)
        if (others->list[i - 1] == patch) return true;
    if (!qp_grow((void **)&others->list, &others->capacity, others->count + 1, sizeof *others->list))
        return false;
    others->list[others->count++] = patch;
    return true;
}

static int by_number(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

qp_status qp_share_others(const qp_share *share, uint32_t first, uint32_t end, qp_patch_list *others, qp_error *err) {
    const qp_surface *surface = share->surface;
    bool good = true;
    others->count = 0;
    if (first == 0 && end == surface->mesh->n_patches) return QP_OK;
    for (patch_place at = place_of(surface->mesh, first); at.patch < end && good; go_on(surface->mesh, &at)) {
        if (surface->patch_plan[at.patch] == QP_NONE) continue;
        for (uint32_t k = 0; k < 4 && good; ++k) {
            const qp_corner_owner corner = qp_share_corner(share, at.face, at.child, k);
            const qp_edge_owner edge = qp_share_edge(share, at.face, at.child, k);
            good = add_other(others, first, end, corner.position.patch) &&
                   add_other(others, first, end, corner.normal.patch) &&
                   add_other(others, first, end, edge.side[0].patch) &&
                   (!edge.split || add_other(others, first, end, edge.side[1].patch));
        }
    }
    if (!good) return qp_fail_memory(err, (others->count + 1) * sizeof *others->list, "shared samples");
    if (others->count != 0) qsort(others->list, others->count, sizeof *others->list, by_number);
    size_t kept = 0;
    for (size_t i = 0; i < others->count; ++i)
        if (i == 0 || others->list[i] != others->list[i - 1]) others->list[kept++] = others->list[i];
    others->count = kept;
    return QP_OK;
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
    if (edge >= 2) t = qp_coordinate_mirrored(t);
    if (owner.reversed) t = qp_coordinate_mirrored(t);
    uint32_t half = 0;
    if (owner.split) {
        half = signbit(t) != 0;
        t = qp_coordinate_in_half(t, half != 0);
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

/* The `bytes` from `skip` on of the samples of one run; inlined with constants, so that each move is a few instructions. */
static inline void copy_run(const qp_copy *c, char *vertices, size_t stride, size_t skip, size_t bytes) {
    char *to = vertices + c->to * stride + skip;
    const char *from = vertices + c->from * stride + skip;
    const ptrdiff_t step = c->step * (ptrdiff_t)stride;
    for (uint32_t k = 0; k < c->count; ++k, to += stride, from += step) memcpy(to, from, bytes);
}

static inline void copy_reals(const qp_copy *c, char *vertices, size_t real_size) {
    const size_t half = 3 * real_size;
    switch (c->fields & (QP_SHARE_POSITION | QP_SHARE_NORMAL)) {
    case QP_SHARE_POSITION:
        copy_run(c, vertices, 2 * half, 0, half);
        break;
    case QP_SHARE_NORMAL:
        copy_run(c, vertices, 2 * half, half, half);
        break;
    default:
        copy_run(c, vertices, 2 * half, 0, 2 * half);
    }
}

static void copy_flags(const qp_copy *c, uint8_t *flags) {
    const uint8_t *from = flags + c->from;
    uint8_t *to = flags + c->to;
    if ((c->fields & (QP_SHARE_NORMAL | QP_SHARE_DEPTH)) == 0) return;
    const uint8_t keep = c->fields & QP_SHARE_NORMAL ? QP_SAMPLE_LIMIT_FRAME : 0xff;
    const uint8_t take = c->fields & QP_SHARE_NORMAL ? (uint8_t)~QP_SAMPLE_LIMIT_FRAME : QP_SAMPLE_PAST_DEPTH;
    for (uint32_t k = 0; k < c->count; ++k, ++to, from += c->step)
        *to = (uint8_t)((*to & keep) | (*from & take));
}

enum { AHEAD = 6 };

/* Asks for a run's memory some runs before its turn: runs are short and far apart, so that most of the time would go into waiting. */
static void fetch_run(const copy_job *job, const qp_copy *c) {
    const size_t stride = 6 * job->real_size, bytes = c->count * stride;
    const uint64_t first = c->step > 0 ? c->from : c->from - (c->count - 1);
    const char *to = job->vertices + c->to * stride, *from = job->vertices + first * stride;
    __builtin_prefetch(job->flags + c->to, 1);
    __builtin_prefetch(job->flags + first, 0);
    for (size_t at = 0; at < bytes; at += 64) {
        __builtin_prefetch(to + at, 1);
        __builtin_prefetch(from + at, 0);
    }
}

static void copy_some(void *context, size_t begin, size_t end, unsigned worker) {
    const copy_job *job = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        if (i + AHEAD < end) fetch_run(job, &job->list[i + AHEAD]);
        if (job->real_size == sizeof(float))
            copy_reals(&job->list[i], job->vertices, sizeof(float));
        else
            copy_reals(&job->list[i], job->vertices, sizeof(double));
        copy_flags(&job->list[i], job->flags);
    }
}

void qp_copies_apply(const qp_copies *copies, size_t real_size, void *vertices, uint8_t *flags) {
    copy_job job = {copies->list, real_size, vertices, flags};
    qp_parallel(copies->count, 512, copy_some, &job);
}
