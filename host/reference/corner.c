/* The limit at a vertex.
 *
 * The vertex's ring is refined until no semi-sharp tag is left and all its faces are quads; from then on the
 * rules repeat and the limit is that of one fixed matrix on the *sector*: the faces between the infinitely
 * sharp edges on either side of the face in question, or the whole fan. With k faces, spoke ends e_0 .. e_k
 * (e_k = e_0 in a fan) and opposite vertices f_0 .. f_(k-1), all relative to the vertex v:
 *   smooth   Halstead, Kass and DeRose 1993, appendix A
 *   crease   the curve's mask; across it the first sine mode of the sector (two or three faces)
 *   corner   v itself; a tangent plane exists only for one face between two creases
 *   dart     no closed form: the fixed matrix is iterated to convergence */
#include "host/reference/corner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void qp_corner_work_free(qp_corner_work *work) {
    qp_piece_free(&work->step[0]);
    qp_piece_free(&work->step[1]);
    free(work->ring);
    free(work->next);
    memset(work, 0, sizeof *work);
}

typedef enum sector_kind { SECTOR_SMOOTH, SECTOR_DART, SECTOR_CREASE, SECTOR_CORNER } sector_kind;

typedef struct sector {
    sector_kind kind;
    uint32_t k;      /* faces */
    uint32_t here;   /* which of them is the one in question */
    bool fan;        /* the faces close around the vertex without a crease */
    qp_quad v[3];    /* the vertex */
    qp_quad ends[3]; /* sum of the far ends of its infinitely sharp edges, relative to v */
    qp_quad *e, *f;  /* 3 (k + 1) and 3 k, relative to v */
    double scale;    /* how often longer the edges of the face in question were before settle() */
} sector;

static const long double pi = 3.14159265358979323846264L;

/* p += w * q */
static void add(qp_quad p[3], qp_quad w, const qp_quad q[3]) {
    for (int c = 0; c < 3; ++c) p[c] += w * q[c];
}

/* Subdominant eigenvalue of Catmull-Clark for the angle between spokes. */
static long double eigenvalue(long double theta) {
    long double c = cosl(theta);
    return (5 + c + cosl(theta / 2) * sqrtl(2 * (9 + c))) / 16;
}

static bool is_stationary(const qp_piece *m, uint32_t vertex) {
    qp_piece_kind kind = qp_piece_vertex_kind(m, vertex);
    return kind.quads && kind.n_semisharp == 0 && !qp_piece_semisharp(m->vertices[vertex].sharpness);
}

static void relative(const qp_piece *m, uint32_t from, uint32_t to, qp_quad out[3]) {
    for (int c = 0; c < 3; ++c) out[c] = m->vertices[to].p[c] - m->vertices[from].p[c];
}

static void sum_infinite_ends(const qp_piece *m, uint32_t vertex, qp_quad sum[3]) {
    sum[0] = sum[1] = sum[2] = 0;
    for (uint32_t i = m->vertex_edge_offsets[vertex]; i < m->vertex_edge_offsets[vertex + 1]; ++i) {
        const qp_piece_edge *e = &m->edges[m->vertex_edges[i]];
        qp_quad end[3];
        if (!qp_piece_infinite(e->sharpness)) continue;
        relative(m, vertex, e->v[e->v[0] == vertex], end);
        for (int c = 0; c < 3; ++c) sum[c] += end[c];
    }
}

/* Walks the sector of `corner`: clockwise (over the edge after the corner) to its first crease or once
 * around, then counter-clockwise, listing. */
static qp_status gather_sector(const qp_piece *m, uint32_t corner, qp_corner_work *work, sector *s,
                               qp_error *err) {
    uint32_t vertex = m->corner_vertex[corner], first = corner;
    qp_piece_kind kind = qp_piece_vertex_kind(m, vertex);
    if (!qp_grow((void **)&work->ring, &work->ring_capacity, 3 * (2 * (size_t)kind.n_faces + 1),
                 sizeof *work->ring))
        return qp_fail_memory(err, kind.n_faces * sizeof *work->ring, "the ring of a vertex");
    s->here = 0;
    while (!qp_piece_infinite(m->edges[m->corner_edge[first]].sharpness)) {
        uint32_t to = qp_piece_across(m, first, m->corner_edge[first]);
        if (to == corner || to == QP_NONE) break;
        first = to;
        s->here++;
    }
    s->fan = !qp_piece_infinite(m->edges[m->corner_edge[first]].sharpness);
    if (s->fan) {
        first = corner;
        s->here = 0;
    }
    s->e = work->ring;
    s->f = work->ring + 3 * ((size_t)kind.n_faces + 1);
    uint32_t at = first, k = 0;
    relative(m, vertex, m->corner_vertex[qp_piece_next(m, at)], s->e);
    for (;;) {
        uint32_t prev = qp_piece_prev(m, at);
        relative(m, vertex, m->corner_vertex[qp_piece_next(m, qp_piece_next(m, at))], s->f + 3 * (size_t)k);
        relative(m, vertex, m->corner_vertex[prev], s->e + 3 * ((size_t)k + 1));
        k++;
        if (qp_piece_infinite(m->edges[m->corner_edge[prev]].sharpness) || k == kind.n_faces) break;
        at = qp_piece_across(m, at, m->corner_edge[prev]);
        if (at == first || at == QP_NONE) break;
    }
    s->k = k;
    memcpy(s->v, m->vertices[vertex].p, sizeof s->v);
    sum_infinite_ends(m, vertex, s->ends);
    if (m->vertices[vertex].sharpness > 0.0f || kind.n_infinite > 2)
        s->kind = SECTOR_CORNER;
    else
        s->kind = kind.n_infinite == 2 ? SECTOR_CREASE : kind.n_infinite == 1 ? SECTOR_DART : SECTOR_SMOOTH;
    return QP_OK;
}

/* Tangents of spokes `here` and `here + 1` in a plane spanned by a, along spoke 0, and b, at a right angle to
 * it in the parameter plane; theta is the angle between spokes. */
static void span_plane(const sector *s, const qp_quad a[3], const qp_quad b[3], long double theta,
                       qp_corner_limit *limit) {
    for (int c = 0; c < 3; ++c) {
        limit->a[c] = (double)a[c];
        limit->b[c] = (double)b[c];
        limit->toward_next[c] = (double)(cosl(s->here * theta) * a[c] + sinl(s->here * theta) * b[c]);
        limit->toward_prev[c] =
            (double)(cosl((s->here + 1) * theta) * a[c] + sinl((s->here + 1) * theta) * b[c]);
    }
    limit->has_plane = true;
}

static void smooth_limit(const sector *s, qp_corner_limit *limit) {
    uint32_t n = s->k;
    qp_quad sum[3] = {0, 0, 0}, a[3] = {0, 0, 0}, b[3] = {0, 0, 0};
    long double theta = 2 * pi / n;
    long double face = 1 / (4 * eigenvalue(theta) - 1), unit = 4.0L / (12 * n) * s->scale;
    for (uint32_t i = 0; i < n; ++i) {
        const qp_quad *e = s->e + 3 * (size_t)i, *f = s->f + 3 * (size_t)i;
        add(sum, 4, e);
        add(sum, 1, f);
        if (n == 2) continue;
        add(a, unit * 4 * cosl(i * theta), e);
        add(b, unit * 4 * sinl(i * theta), e);
        add(a, unit * face * (cosl(i * theta) + cosl((i + 1) * theta)), f);
        add(b, unit * face * (sinl(i * theta) + sinl((i + 1) * theta)), f);
    }
    for (int c = 0; c < 3; ++c) limit->p[c] = s->v[c] + sum[c] / ((qp_quad)n * (n + 5));
    /* Valence 2: its second and third eigenvalues are 1/4 (twice) and -1/4, so the ring flips from side to
     * side of any plane as it shrinks. There is no tangent plane. */
    if (n > 2) span_plane(s, a, b, theta, limit);
}

/* The left eigenvector across a crease of k faces, for the eigenvalue l at angle theta = pi / k. Within the
 * sector it is the smooth one's sine: 4 sin(i theta) at e_i, (sin(i theta) + sin((i+1) theta)) / (4 l - 1) at
 * f_i. With S = sum of sin(i theta) = cot(theta / 2), the columns of e_0 and of v leave, for the weights c of
 * the crease's ends and w of v,
 *   (l - 1/2) c - w / 8 = l sin(theta) / (4 l - 1)       (l - 3/4) w - c = S (1 + 2 l / (4 l - 1)),
 * hence (l - 1)(l - 1/4) w = l sin(theta) / (4 l - 1) + (l - 1/2) S (1 + 2 l / (4 l - 1)).
 * The mask of Biermann, Levin and Zorin 2000, which OpenSubdiv takes, has l = 1/2 here: it belongs to their
 * modified edge rule and is off for k > 2 under the plain one. */
static void crease_limit(const sector *s, qp_corner_limit *limit) {
    uint32_t k = s->k;
    const qp_quad *first = s->e, *last = s->e + 3 * (size_t)k;
    qp_quad along[3], across[3] = {0, 0, 0};
    for (int c = 0; c < 3; ++c) {
        limit->p[c] = s->v[c] + s->ends[c] / 6;
        along[c] = (first[c] - last[c]) * 0.5 * s->scale;
    }
    /* One face: both its edges follow the same smooth curve, so its tangents there are parallel. A whole fan
     * beside the crease (non-manifold) moves with a vertex that ignores it, as at a sharp apex. */
    if (k == 1 || s->fan) return;
    long double theta = pi / k, l = eigenvalue(theta), face = 1 / (4 * l - 1);
    long double unit = s->scale / (k * (3 + cosl(theta))); /* k = 2: the derivative across the edge */
    long double total = (1 + 2 * l * face) / tanl(theta / 2);
    long double w = (l * face * sinl(theta) + (l - 0.5L) * total) / ((l - 1) * (l - 0.25L));
    long double end = (l - 0.75L) * w - total;
    add(across, unit * end, first);
    add(across, unit * end, last);
    for (uint32_t i = 0; i < k; ++i) {
        if (i > 0) add(across, unit * 4 * sinl(i * theta), s->e + 3 * (size_t)i);
        add(across, unit * face * (sinl(i * theta) + sinl((i + 1) * theta)), s->f + 3 * (size_t)i);
    }
    span_plane(s, along, across, theta, limit);
    /* From five faces on, the sector's second sine (angle 2 theta) decays more slowly than the 1/2 of the
     * curve: normals inside turn toward the plane of the two sines, on the curve toward this one. No tangent
     * plane, unless by chance. At four both are 1/2 and share a Jordan block: one plane, reached like 1 / level.
     */
    limit->has_plane = k <= 4;
}

static void corner_limit(const sector *s, qp_corner_limit *limit) {
    memcpy(limit->p, s->v, sizeof limit->p);
    /* Wider sectors, and fans with a sharp apex, shrink onto one direction: no tangent plane. */
    if (s->k != 1) return;
    for (int c = 0; c < 3; ++c) {
        limit->a[c] = limit->toward_next[c] = (double)(s->e[c] * s->scale);
        limit->b[c] = limit->toward_prev[c] = (double)(s->e[3 + c] * s->scale);
    }
    limit->has_plane = true;
}

static long double norm(const qp_quad p[3]) {
    long double x = (long double)p[0], y = (long double)p[1], z = (long double)p[2];
    return sqrtl(x * x + y * y + z * z);
}

/* One step of a dart's ring, whose crease is spoke 0: e, f of the next level, relative to the next v and
 * doubled, so that the ring keeps its relative precision. Adds v's move to `move`, also relative. */
static void dart_step(uint32_t n, const qp_quad *e, const qp_quad *f, qp_quad *e2, qp_quad *f2,
                      qp_quad move[3]) {
    qp_quad sum[3] = {0, 0, 0};
    for (uint32_t i = 0; i < n; ++i)
        for (int c = 0; c < 3; ++c) {
            f2[3 * i + c] = (e[3 * i + c] + e[3 * ((i + 1) % n) + c] + f[3 * i + c]) * 0.25;
            sum[c] += e[3 * i + c] + f2[3 * i + c];
        }
    for (uint32_t i = 0; i < n; ++i)
        for (int c = 0; c < 3; ++c) {
            qp_quad faces = f2[3 * i + c] + f2[3 * ((i + n - 1) % n) + c];
            e2[3 * i + c] = i ? (e[3 * i + c] + faces) * 0.25 : e[c] * 0.5;
        }
    for (int c = 0; c < 3; ++c) move[c] = sum[c] / ((qp_quad)n * n);
    for (uint32_t i = 0; i < n; ++i)
        for (int c = 0; c < 3; ++c) {
            e2[3 * i + c] = 2 * (e2[3 * i + c] - move[c]);
            f2[3 * i + c] = 2 * (f2[3 * i + c] - move[c]);
        }
}

/* Across the crease the dart's ring behaves as a smooth one: in modes odd about the crease, spoke 0 rests at
 * the vertex under either rule. Along it, the direction of spoke 0 converges to the even mode's tangent. */
static qp_status dart_limit(sector *s, qp_corner_work *work, qp_corner_limit *limit, qp_error *err) {
    enum { STEPS = 6000 };
    uint32_t n = s->k;
    size_t size = 3 * (2 * (size_t)n);
    if (!qp_grow((void **)&work->next, &work->next_capacity, size, sizeof *work->next))
        return qp_fail_memory(err, size * sizeof *work->next, "the ring of a vertex");
    qp_quad across[3] = {0, 0, 0};
    long double theta = 2 * pi / n, face = 1 / (4 * eigenvalue(theta) - 1);
    for (uint32_t i = 0; i < n; ++i) {
        add(across, 4 * sinl(i * theta), s->e + 3 * (size_t)i);
        add(across, face * (sinl(i * theta) + sinl((i + 1) * theta)), s->f + 3 * (size_t)i);
    }
    qp_quad *e = s->e, *f = s->f, *e2 = work->next, *f2 = work->next + 3 * (size_t)n;
    qp_quad along[3] = {0, 0, 0}, unit = 1, move[3];
    memcpy(limit->p, s->v, sizeof limit->p);
    for (int step = 0; step < STEPS; ++step) {
        dart_step(n, e, f, e2, f2, move);
        add(limit->p, unit, move);
        unit *= 0.5;
        qp_quad *swap = e;
        e = e2, e2 = swap, swap = f, f = f2, f2 = swap;
        long double length = norm(e), change = 0;
        for (int c = 0; c < 3 && length > 0; ++c) {
            qp_quad direction = e[c] / length;
            change = fmaxl(change, fabsl((long double)(direction - along[c])));
            along[c] = direction;
        }
        /* 130 halvings outlast the slowest ring's share in the position (0.655 a step against 2^-53), and
         * the direction's error is its change over one minus the ratio of the two leading modes. */
        if (step > 130 && change < 1e-17L) break;
    }
    if (n > 2) span_plane(s, along, across, theta, limit);
    /* `along` is a mere direction: the condition is that of directions. */
    const long double length = norm(across);
    for (int c = 0; c < 3 && length > 0; ++c) limit->b[c] /= (double)length;
    return QP_OK;
}

/* Refines the vertex's ring until its rules repeat; *corner is followed. */
static qp_status settle(qp_piece **mesh, uint32_t *corner, qp_corner_work *work, double *scale,
                        qp_error *err) {
    int turn = 0;
    while (!is_stationary(*mesh, (*mesh)->corner_vertex[*corner])) {
        uint32_t center = (*mesh)->corner_vertex[*corner];
        qp_piece *parent = *mesh, *child = &work->step[turn];
        uint32_t place = *corner - parent->face_offsets[parent->corner_face[*corner]];
        bool quad = qp_piece_face_size(parent, parent->corner_face[*corner]) == 4;
        qp_status status = qp_piece_refine(parent, &center, 1, child, err);
        if (status) return status;
        *corner = child->face_offsets[parent->corner_child[*corner]] + (quad ? place : 0);
        *mesh = child;
        *scale *= 2;
        turn ^= 1;
    }
    return QP_OK;
}

qp_status qp_corner_eval(qp_piece *mesh, uint32_t corner, qp_corner_work *work, qp_corner_limit *limit,
                         qp_error *err) {
    sector s = {.scale = 1};
    memset(limit, 0, sizeof *limit);
    qp_status status = settle(&mesh, &corner, work, &s.scale, err);
    if (!status) status = gather_sector(mesh, corner, work, &s, err);
    if (status) return status;
    switch (s.kind) {
    case SECTOR_SMOOTH:
        smooth_limit(&s, limit);
        break;
    case SECTOR_CREASE:
        crease_limit(&s, limit);
        break;
    case SECTOR_CORNER:
        corner_limit(&s, limit);
        break;
    case SECTOR_DART:
        return dart_limit(&s, work, limit, err);
    }
    return QP_OK;
}
