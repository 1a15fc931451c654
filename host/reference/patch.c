/* Regular cells. */
#include "host/reference/patch.h"

#include <string.h>

typedef struct cell {
    const qp_piece *mesh;
    uint32_t corner[4]; /* the face's corners */
    bool sharp[4];      /* side j, from corner j to corner j + 1, is infinitely sharp */
    qp_quad at[4][3];
    qp_quad outer[4][2][3]; /* beyond side j, at corner j and at corner j + 1 */
    qp_quad diagonal[4][3]; /* beyond corner j */
} cell;

/* Whether the surface near the corner is what extrapolated points reproduce. */
static bool corner_is_regular(const cell *c, uint32_t j) {
    const qp_piece *m = c->mesh;
    uint32_t vertex = m->corner_vertex[c->corner[j]];
    float sharpness = m->vertices[vertex].sharpness;
    bool before = c->sharp[(j + 3) & 3], after = c->sharp[j];
    qp_piece_kind k = qp_piece_vertex_kind(m, vertex);
    bool is_corner = qp_piece_infinite(sharpness) || k.n_infinite > 2;
    if (before && after) return is_corner;
    if (is_corner || sharpness > 0.0f || k.n_semisharp > 0 || !k.quads) return false;
    if (k.n_infinite == 0) return k.n_edges == 4 && k.n_faces == 4;
    if (k.n_infinite != 2 || before == after) return false;
    /* The one other face of a regular crease's side: across the smooth edge, its far edge is the crease. */
    uint32_t smooth = m->corner_edge[after ? qp_piece_prev(m, c->corner[j]) : c->corner[j]];
    uint32_t other = qp_piece_across(m, c->corner[j], smooth);
    if (other == QP_NONE) return false;
    uint32_t next = m->corner_edge[other], prev = m->corner_edge[qp_piece_prev(m, other)];
    uint32_t far = next == smooth ? prev : next;
    /* Two faces may also stand on one non-manifold edge like the pages of an open book: that is no crease of theirs. */
    uint32_t near = m->corner_edge[after ? c->corner[j] : qp_piece_prev(m, c->corner[j])];
    return far != near && qp_piece_infinite(m->edges[far].sharpness);
}

static void extrapolate(const qp_quad at[3], const qp_quad inside[3], qp_quad outside[3]) {
    for (int i = 0; i < 3; ++i) outside[i] = 2 * at[i] - inside[i];
}

static void copy_vertex(const cell *c, uint32_t corner, qp_quad out[3]) {
    memcpy(out, c->mesh->vertices[c->mesh->corner_vertex[corner]].p, 3 * sizeof *out);
}

static void fill_side(cell *c, uint32_t j) {
    const qp_piece *m = c->mesh;
    uint32_t next = (j + 1) & 3;
    if (c->sharp[j]) {
        extrapolate(c->at[j], c->at[(j + 3) & 3], c->outer[j][0]);
        extrapolate(c->at[next], c->at[(j + 2) & 3], c->outer[j][1]);
        return;
    }
    /* The neighbour runs the edge the other way: corner j, and after it its point beyond the side. */
    uint32_t across = qp_piece_across(m, c->corner[j], m->corner_edge[c->corner[j]]);
    uint32_t beyond = qp_piece_next(m, across);
    copy_vertex(c, beyond, c->outer[j][0]);
    copy_vertex(c, qp_piece_next(m, beyond), c->outer[j][1]);
}

static void fill_diagonal(cell *c, uint32_t j) {
    const qp_piece *m = c->mesh;
    uint32_t before = (j + 3) & 3;
    if (c->sharp[j]) {
        extrapolate(c->outer[before][1], c->outer[before][0], c->diagonal[j]);
    } else if (c->sharp[before]) {
        extrapolate(c->outer[j][0], c->outer[j][1], c->diagonal[j]);
    } else {
        uint32_t side = qp_piece_across(m, c->corner[j], m->corner_edge[c->corner[j]]);
        uint32_t opposite = qp_piece_across(m, side, m->corner_edge[side]);
        copy_vertex(c, qp_piece_next(m, qp_piece_next(m, opposite)), c->diagonal[j]);
    }
}

static void place(qp_leaf *leaf, int v, int u, const qp_quad p[3]) {
    for (int i = 0; i < 3; ++i) leaf->points[v][u][i] = (qp_leaf_real)(p[i] - leaf->origin[i]);
}

bool qp_leaf_make(const qp_piece *mesh, uint32_t face, qp_leaf *leaf) {
    if (qp_piece_face_size(mesh, face) != 4) return false;
    cell c;
    c.mesh = mesh;
    for (uint32_t j = 0; j < 4; ++j) {
        c.corner[j] = mesh->face_offsets[face] + j;
        float s = mesh->edges[mesh->corner_edge[c.corner[j]]].sharpness;
        if (qp_piece_semisharp(s)) return false;
        c.sharp[j] = qp_piece_infinite(s);
    }
    for (uint32_t j = 0; j < 4; ++j)
        if (!corner_is_regular(&c, j)) return false;
    /* Behind a corner between two creases the neighbours may be anything, but nothing of them is read. */
    for (uint32_t j = 0; j < 4; ++j) copy_vertex(&c, c.corner[j], c.at[j]);
    for (uint32_t j = 0; j < 4; ++j) fill_side(&c, j);
    for (uint32_t j = 0; j < 4; ++j) fill_diagonal(&c, j);
    memcpy(leaf->origin, c.at[0], sizeof leaf->origin);
    static const int corner_at[4][2] = {{1, 1}, {1, 2}, {2, 2}, {2, 1}}; /* v, u */
    static const int outward[4][2] = {{-1, 0}, {0, 1}, {1, 0}, {0, -1}};
    for (int j = 0; j < 4; ++j) {
        int next = (j + 1) & 3, before = (j + 3) & 3;
        place(leaf, corner_at[j][0], corner_at[j][1], c.at[j]);
        place(leaf, corner_at[j][0] + outward[j][0], corner_at[j][1] + outward[j][1], c.outer[j][0]);
        place(leaf, corner_at[next][0] + outward[j][0], corner_at[next][1] + outward[j][1], c.outer[j][1]);
        place(leaf, corner_at[j][0] + outward[j][0] + outward[before][0],
              corner_at[j][1] + outward[j][1] + outward[before][1], c.diagonal[j]);
    }
    return true;
}

static void basis(qp_leaf_real t, qp_leaf_real b[4], qp_leaf_real d[4]) {
    qp_leaf_real s = 1 - t, t2 = t * t, s2 = s * s;
    b[0] = s2 * s / 6;
    b[3] = t2 * t / 6;
    b[1] = (4 + 3 * t2 * (t - 2)) / 6;
    b[2] = (4 + 3 * s2 * (s - 2)) / 6;
    d[0] = -s2 / 2;
    d[3] = t2 / 2;
    d[1] = t * (3 * t - 4) / 2;
    d[2] = -s * (3 * s - 4) / 2;
}

void qp_leaf_eval(const qp_leaf *leaf, double u, double v, qp_quad p[3], qp_leaf_real du[3],
                  qp_leaf_real dv[3]) {
    qp_leaf_real bu[4], cu[4], bv[4], cv[4];
    basis(u, bu, cu);
    basis(v, bv, cv);
    for (int i = 0; i < 3; ++i) {
        qp_leaf_real sum = 0;
        du[i] = dv[i] = 0;
        for (int r = 0; r < 4; ++r) {
            qp_leaf_real along = 0, slope = 0;
            for (int k = 0; k < 4; ++k) {
                along += bu[k] * leaf->points[r][k][i];
                slope += cu[k] * leaf->points[r][k][i];
            }
            sum += bv[r] * along;
            du[i] += bv[r] * slope;
            dv[i] += cv[r] * along;
        }
        p[i] = leaf->origin[i] + sum;
    }
}
