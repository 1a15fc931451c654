/* Descent of a patch's quadtree of cells, down to regular ones, with all its samples at once. */
#include "host/reference/eval.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "host/reference/patch.h"

void qp_reference_work_free(qp_reference_work *work) {
    for (size_t i = 0; i < sizeof work->levels / sizeof *work->levels; ++i) qp_piece_free(&work->levels[i]);
    qp_corner_work_free(&work->corner);
    free(work->uv);
    free(work->order);
    memset(work, 0, sizeof *work);
}

typedef struct visit {
    qp_reference_work *work;
    qp_reference_sample *samples;
    qp_error *err;
} visit;

/* A cell: a quad of a level's mesh, its samples order[begin..end). Each mesh is relative to an origin of its own, a vertex
 * of it, so that its points keep their digits however small the cells are and however far from 0. */
typedef struct cell {
    uint32_t level, mesh, face;
    uint32_t begin, end;
    qp_quad origin[3];
} cell;

/* Moves the origin of a mesh to its vertex 0; *origin was its origin and becomes the new one. */
static void recenter(qp_piece *mesh, qp_quad origin[3]) {
    qp_quad by[3];
    memcpy(by, mesh->vertices[0].p, sizeof by);
    for (uint32_t v = 0; v < mesh->n_vertices; ++v)
        for (int c = 0; c < 3; ++c) mesh->vertices[v].p[c] -= by[c];
    for (int c = 0; c < 3; ++c) origin[c] += by[c];
}

static void set_position(const cell *at, const qp_quad p[3], qp_reference_sample *s) {
    for (int c = 0; c < 3; ++c) {
        qp_quad x = at->origin[c] + p[c];
        s->p[c] = (double)x;
        s->p_rest[c] = (double)(x - s->p[c]);
    }
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double cross(const double a[3], const double b[3], double out[3]) {
    for (int c = 0; c < 3; ++c) out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
    return sqrt(dot(out, out));
}

/* Ratio of the singular values of [a b]: the larger one's square is the larger eigenvalue of the matrix of dot products, and
 * both multiply to |a x b|. */
static double condition(const double a[3], const double b[3]) {
    const double aa = dot(a, a), bb = dot(b, b), ab = dot(a, b);
    double n[3];
    return (aa + bb + hypot(aa - bb, 2 * ab)) / (2 * cross(a, b, n));
}

/* Unit normal from the derivatives, when they are neither vanishing nor parallel. */
static void set_normal(qp_reference_sample *s) {
    double n[3];
    const double nn = cross(s->du, s->dv, n), uu = sqrt(dot(s->du, s->du)), vv = sqrt(dot(s->dv, s->dv));
    /* One that is so much smaller than the other is 0 but for rounding. */
    const bool both = uu > 1e-14 * vv && vv > 1e-14 * uu;
    s->normal_defined = both && nn > 0 && nn >= 1e-6 * uu * vv;
    s->condition = s->normal_defined ? condition(s->du, s->dv) : INFINITY;
    for (int c = 0; c < 3; ++c) s->n[c] = s->normal_defined ? n[c] / nn : 0;
}

static void eval_regular(const visit *t, const cell *at, const qp_leaf *leaf) {
    qp_leaf_real scale = (qp_leaf_real)ldexp(1.0, (int)at->level);
    for (uint32_t i = at->begin; i < at->end; ++i) {
        uint32_t k = t->work->order[i];
        qp_reference_sample *s = &t->samples[k];
        qp_quad p[3];
        qp_leaf_real du[3], dv[3];
        qp_leaf_eval(leaf, t->work->uv[2 * k], t->work->uv[2 * k + 1], p, du, dv);
        set_position(at, p, s);
        for (int c = 0; c < 3; ++c) {
            s->du[c] = (double)(du[c] * scale);
            s->dv[c] = (double)(dv[c] * scale);
        }
        set_normal(s);
    }
}

/* The sample at corner j of the cell. du, dv of corner j in terms of the edges that leave it:
 * 0: next, prev; 1: -prev, next; 2: -next, -prev; 3: prev, -next. */
static qp_status eval_corner(const visit *t, const cell *at, uint32_t j, qp_reference_sample *s) {
    qp_piece *mesh = &t->work->levels[at->mesh];
    qp_corner_limit limit;
    qp_status status =
        qp_corner_eval(mesh, mesh->face_offsets[at->face] + j, &t->work->corner, &limit, t->err);
    if (status) return status;
    double scale = ldexp(1.0, (int)at->level);
    set_position(at, limit.p, s);
    for (int c = 0; c < 3; ++c) {
        double next = limit.toward_next[c] * scale, prev = limit.toward_prev[c] * scale;
        s->du[c] = j == 0 ? next : j == 1 ? -prev : j == 2 ? -next : prev;
        s->dv[c] = j == 0 ? prev : j == 1 ? next : j == 2 ? -prev : -next;
    }
    set_normal(s);
    s->normal_defined = s->normal_defined && limit.has_plane;
    s->condition = s->normal_defined ? condition(limit.a, limit.b) : INFINITY;
    return QP_OK;
}

/* Evaluates samples at the cell's corners and moves them out of the list. */
static qp_status take_corners(const visit *t, cell *at) {
    uint32_t *order = t->work->order, kept = at->begin, first[4] = {QP_NONE, QP_NONE, QP_NONE, QP_NONE};
    bool all = at->level >= QP_REFERENCE_DEPTH;
    for (uint32_t i = at->begin; i < at->end; ++i) {
        uint32_t k = order[i];
        double u = t->work->uv[2 * k], v = t->work->uv[2 * k + 1];
        if (all) {
            u = u >= 0.5;
            v = v >= 0.5;
        }
        if ((u != 0 && u != 1) || (v != 0 && v != 1)) {
            order[kept++] = k;
            continue;
        }
        uint32_t j = v == 0 ? (u == 0 ? 0 : 1) : (u == 0 ? 3 : 2);
        if (first[j] == QP_NONE) {
            qp_status status = eval_corner(t, at, j, &t->samples[k]);
            if (status) return status;
            first[j] = k;
        } else {
            t->samples[k] = t->samples[first[j]];
        }
    }
    at->end = kept;
    return QP_OK;
}

/* Sorts order[begin..end) so that samples with uv[axis] < 0.5 come first; returns where the others begin. */
static uint32_t split(const visit *t, uint32_t begin, uint32_t end, int axis) {
    uint32_t *order = t->work->order, low = begin;
    for (uint32_t i = begin; i < end; ++i) {
        uint32_t k = order[i];
        if (t->work->uv[2 * k + axis] >= 0.5) continue;
        order[i] = order[low];
        order[low++] = k;
    }
    return low;
}

static qp_status descend(const visit *t, cell at) {
    qp_reference_work *work = t->work;
    qp_piece *mesh = &work->levels[at.mesh];
    qp_leaf leaf;
    if (qp_leaf_make(mesh, at.face, &leaf)) {
        eval_regular(t, &at, &leaf);
        return QP_OK;
    }
    qp_status status = take_corners(t, &at);
    if (status || at.begin == at.end) return status;
    const uint32_t *corners = mesh->corner_vertex + mesh->face_offsets[at.face];
    status = qp_piece_refine(mesh, corners, 4, &work->levels[at.mesh + 1], t->err);
    if (status) return status;
    qp_quad origin[3];
    memcpy(origin, at.origin, sizeof origin);
    recenter(&work->levels[at.mesh + 1], origin);
    uint32_t children[4];
    memcpy(children, mesh->corner_child + mesh->face_offsets[at.face], sizeof children);
    uint32_t bounds[5] = {at.begin, 0, split(t, at.begin, at.end, 1), 0, at.end};
    bounds[1] = split(t, bounds[0], bounds[2], 0);
    bounds[3] = split(t, bounds[2], bounds[4], 0);
    static const uint32_t quadrant[4] = {0, 1, 3, 2}; /* child by 2 (v >= 1/2) + (u >= 1/2) */
    for (uint32_t q = 0; q < 4 && !status; ++q) {
        if (bounds[q] == bounds[q + 1]) continue;
        for (uint32_t i = bounds[q]; i < bounds[q + 1]; ++i) {
            double *uv = work->uv + 2 * (size_t)work->order[i];
            uv[0] = 2 * uv[0] - (q & 1); /* exact */
            uv[1] = 2 * uv[1] - (q >> 1);
        }
        cell child = {.level = at.level + 1,
                      .mesh = at.mesh + 1,
                      .face = children[quadrant[q]],
                      .begin = bounds[q],
                      .end = bounds[q + 1]};
        memcpy(child.origin, origin, sizeof origin);
        status = descend(t, child);
    }
    return status;
}

static qp_status check_samples(const qp_mesh *mesh, uint32_t patch, size_t count, const double *uv,
                               qp_error *err) {
    if (patch >= mesh->n_patches)
        return qp_fail(err, QP_BAD_INPUT, "patch %u is out of range: the mesh has %u", patch,
                       mesh->n_patches);
    if (count > UINT32_MAX / 2)
        return qp_fail(err, QP_BAD_INPUT, "%zu samples in one patch are too many", count);
    for (size_t i = 0; i < count; ++i)
        if (!(uv[2 * i] >= 0 && uv[2 * i] <= 1 && uv[2 * i + 1] >= 0 && uv[2 * i + 1] <= 1))
            return qp_fail(err, QP_BAD_INPUT, "sample %zu of patch %u, (%g, %g), lies outside [0,1]^2", i,
                           patch, uv[2 * i], uv[2 * i + 1]);
    return QP_OK;
}

qp_status qp_reference_eval_with(qp_reference_work *work, const qp_mesh *mesh, const double *positions,
                                 uint32_t patch, size_t count, const double *uv, qp_reference_sample *samples,
                                 qp_error *err) {
    qp_status status = check_samples(mesh, patch, count, uv, err);
    if (status) return status;
    uint32_t child, face = qp_patch_face(mesh, patch, &child);
    if (mesh->face_flags[face] & QP_FACE_HOLE)
        return qp_fail(err, QP_BAD_INPUT, "patch %u has no surface: its face %u is a hole", patch, face);
    if (!qp_grow((void **)&work->uv, &work->uv_capacity, 2 * count, sizeof *work->uv) ||
        !qp_grow((void **)&work->order, &work->order_capacity, count, sizeof *work->order))
        return qp_fail_memory(err, count * 3 * sizeof *work->uv, "samples of the reference");
    if (count == 0) return QP_OK;
    memcpy(work->uv, uv, 2 * count * sizeof *uv);
    for (size_t i = 0; i < count; ++i) work->order[i] = (uint32_t)i;

    qp_piece *base = &work->levels[0];
    cell root = {.end = (uint32_t)count};
    status = qp_piece_gather(mesh, positions, face, base, err);
    if (!status) recenter(base, root.origin);
    if (!status && qp_piece_face_size(base, 0) != 4) {
        status =
            qp_piece_refine(base, base->corner_vertex, qp_piece_face_size(base, 0), &work->levels[1], err);
        if (!status) root.mesh = 1, root.face = base->corner_child[child];
    }
    visit t = {work, samples, err};
    return status ? status : descend(&t, root);
}

qp_status qp_reference_eval(const qp_mesh *mesh, const double *positions, uint32_t patch, size_t count,
                            const double *uv, qp_reference_sample *samples, qp_error *err) {
    qp_reference_work work;
    memset(&work, 0, sizeof work);
    qp_status status = qp_reference_eval_with(&work, mesh, positions, patch, count, uv, samples, err);
    qp_reference_work_free(&work);
    return status;
}
