/* The quad domain tessellator.
 *
 * What a GPU does here is fixed by the Direct3D 11.3 functional specification (chapter "Tessellator"), which
 * GL implementations follow: coordinates in 16.16 fixed point, each edge laid out symmetrically about its
 * middle, points added in the order of a ruler function as a factor grows, and the interior as concentric
 * rings, the outermost of which is stitched to the four edges. Where the specification leaves details open (which point
 * splits, how odd and even rows are stitched, which way a diagonal runs) this follows the behaviour of Microsoft's
 * reference tessellator (MIT licence), which Mesa's software drivers contain. Names here:
 *
 *   axis     one edge or one inner direction: its factor, parity and how its points lie in [0,1]
 *   lattice  the inner axes' grid; point (i,j), 1 <= i <= count_u - 2, belongs to ring min distance to the rim
 *   row      the points along one side of a ring, in the direction in which rings are walked: down u=0, along
 *            v=0, up u=1, back along v=1
 */
#include "host/frame/tessellator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ONE 0x10000u
#define HALF 0x8000u
#define ROW_MAX 65u /* points on an axis of factor 64 */

typedef struct axis {
    bool odd;          /* an odd number of segments: no point at the middle */
    uint32_t factor;   /* 16.16 */
    uint32_t count;    /* points, both ends included */
    uint32_t half;     /* points in the first half, without the middle of an even axis */
    uint32_t split;    /* the point of the first half that is being split off as the factor grows */
    uint32_t fraction; /* 16.16: how far it has moved, 0 up to 1 */
    uint32_t step_floor, step_ceil; /* 1 / segments before and after the split */
} axis;

typedef struct row {
    uint32_t count;
    uint32_t index[ROW_MAX + 1];
} row;

typedef struct tessellator {
    axis outer[4], inner[2];
    bool single_quad; /* all factors 1 */
    uint32_t rim;     /* points on the four edges */
    uint32_t edge_start[4];
    uint32_t lattice[ROW_MAX][ROW_MAX]; /* [j][i] point index */
    qp_tess_grid *grid;
} tessellator;

/* ---- Factors and axes ---- */

static uint32_t ceil_fixed(uint32_t x) {
    return (x + ONE - 1) & ~(ONE - 1);
}

static uint32_t to_fixed(float x) {
    double scaled = (double)x * ONE, whole = floor(scaled), rest = scaled - whole;
    uint32_t r = (uint32_t)whole;
    return r + (rest > 0.5 || (rest == 0.5 && (r & 1u))); /* ties to even */
}

/* NaN becomes low. */
static float clamp_factor(float f, float low, float high) {
    return f > low ? (f < high ? f : high) : low;
}

static uint32_t without_top_bit(uint32_t x) {
    uint32_t top = 1;
    while (top <= x / 2) top *= 2;
    return x ? x - top : 0;
}

/* 16.16 reciprocal, to nearest. */
static uint32_t reciprocal(uint32_t n) {
    return (2 * ONE + n) / (2 * n);
}

static axis make_axis(float factor, bool odd) {
    axis a = {.odd = odd, .factor = to_fixed(factor)};
    uint32_t half_factor = (a.factor + 1) / 2;
    a.count = odd ? (ceil_fixed(HALF + half_factor) * 2) >> 16 : ((ceil_fixed(half_factor) * 2) >> 16) + 1;
    /* Half an odd axis is counted with half of its middle segment. An even axis of factor 1 is an inner one
     * that stands for a degenerate ring: it has the points of factor 2. */
    if (odd || half_factor == HALF) half_factor += HALF;
    uint32_t low = half_factor >> 16, high = ceil_fixed(half_factor) >> 16;
    a.fraction = half_factor & (ONE - 1);
    a.half = high;
    if (low == high)
        a.split = high + 1; /* nothing moves */
    else if (odd)
        a.split = low == 1 ? 0 : 2 * without_top_bit(low - 1) + 1;
    else
        a.split = 2 * without_top_bit(low) + 1;
    a.step_floor = reciprocal(2 * low - odd);
    a.step_ceil = reciprocal(2 * high - odd);
    return a;
}

/* 16.16 location of a point. The second half mirrors the first, so that 1 - (1 - x) == x exactly. */
static uint32_t place(const axis *a, uint32_t point) {
    bool mirrored = point >= a->half;
    if (mirrored) point = 2 * a->half - point - a->odd;
    if (point == a->half) return HALF;
    uint32_t before = (point > a->split ? point - 1 : point) * a->step_floor;
    uint32_t after = point * a->step_ceil;
    /* both <= 1/2, so the sum stays below 2^32 */
    uint32_t at = (before * (ONE - a->fraction) + after * a->fraction + HALF) >> 16;
    return mirrored ? ONE - at : at;
}

/* Clamps and rounds the factors as GL does; false where the patch is discarded. */
static bool set_up_axes(tessellator *t, qp_spacing spacing, const float outer[4], const float inner[2]) {
    for (int e = 0; e < 4; e++)
        if (!(outer[e] > 0)) return false;
    float low = spacing == QP_FRACTIONAL_EVEN ? 2.0f : 1.0f;
    float high = spacing == QP_FRACTIONAL_ODD ? 63.0f : 64.0f;
    float factor[6];
    for (int e = 0; e < 4; e++) factor[e] = clamp_factor(outer[e], low, high);
    if (spacing == QP_FRACTIONAL_ODD) {
        /* When anything is subdivided at all, the inside must be a ring of its own, however thin. */
        const float above_one = 1.0f + 0x1p-17f;
        bool any = inner[0] > above_one || inner[1] > above_one;
        for (int e = 0; e < 4; e++) any = any || factor[e] > above_one;
        if (any) low = 1.0f + 0x1p-16f;
    }
    for (int k = 0; k < 2; k++) factor[4 + k] = clamp_factor(inner[k], low, high);
    if (spacing == QP_EQUAL)
        for (int k = 0; k < 6; k++) factor[k] = ceilf(factor[k]);
    t->single_quad = true;
    for (int k = 0; k < 6; k++) {
        bool odd = spacing == QP_FRACTIONAL_ODD;
        /* An inner factor of 1 under equal spacing collapses the ring to a point: even. */
        if (spacing == QP_EQUAL) odd = ((int)factor[k] & 1) && (k < 4 || factor[k] != 1.0f);
        axis a = make_axis(factor[k], odd);
        if (a.factor != ONE) t->single_quad = false;
        if (k < 4) {
            t->outer[k] = a;
        } else {
            uint32_t least = odd ? 4 : 3;
            if (a.count < least) a.count = least;
            t->inner[k - 4] = a;
        }
    }
    return true;
}

/* ---- Points ---- */

static uint32_t add_point(qp_tess_grid *grid, uint32_t u, uint32_t v) {
    uint32_t n = grid->n_points++;
    grid->uv[2 * n] = (float)u / (float)ONE; /* exact */
    grid->uv[2 * n + 1] = (float)v / (float)ONE;
    return n;
}

/* The lattice point at place k of side e of a ring, in walking order. */
static void ring_point(const tessellator *t, uint32_t ring, int e, uint32_t k, uint32_t *i, uint32_t *j) {
    uint32_t last_i = t->inner[0].count - 1 - ring, last_j = t->inner[1].count - 1 - ring;
    *i = e == 0 ? ring : e == 1 ? ring + k : e == 2 ? last_i : last_i - k;
    *j = e == 0 ? last_j - k : e == 1 ? ring : e == 2 ? ring + k : last_j;
}

static void add_lattice_point(tessellator *t, uint32_t i, uint32_t j) {
    t->lattice[j][i] = add_point(t->grid, place(&t->inner[0], i), place(&t->inner[1], j));
}

static void make_points(tessellator *t) {
    for (int e = 0; e < 4; e++) {
        uint32_t last = t->outer[e].count - 1;
        t->edge_start[e] = t->grid->n_points;
        for (uint32_t k = 0; k < last; k++) {
            bool forward = e == 1 || e == 2;
            uint32_t along = place(&t->outer[e], forward ? k : last - k), across = e >= 2 ? ONE : 0;
            add_point(t->grid, e & 1 ? along : across, e & 1 ? across : along);
        }
    }
    t->rim = t->grid->n_points;
    uint32_t nu = t->inner[0].count, nv = t->inner[1].count, i, j;
    uint32_t rings = (nu < nv ? nu : nv) / 2;
    for (uint32_t ring = 1; ring < rings; ring++)
        for (int e = 0; e < 4; e++) {
            uint32_t along = (e & 1 ? nu : nv) - 1 - 2 * ring;
            for (uint32_t k = 0; k < along; k++) {
                ring_point(t, ring, e, k, &i, &j);
                add_lattice_point(t, i, j);
            }
        }
    /* An even shorter axis leaves one row along the longer one. */
    if (nu > nv && !t->inner[1].odd)
        for (i = rings; i <= nu - 1 - rings; i++) add_lattice_point(t, i, rings);
    else if (nv >= nu && !t->inner[0].odd)
        for (j = nv - 1 - rings; j >= rings; j--) add_lattice_point(t, rings, j);
}

static void edge_row(const tessellator *t, int e, row *r) {
    r->count = t->outer[e].count;
    for (uint32_t k = 0; k < r->count; k++) r->index[k] = (t->edge_start[e] + k) % t->rim;
}

static void ring_row(const tessellator *t, uint32_t ring, int e, row *r) {
    uint32_t i, j;
    r->count = t->inner[e & 1 ? 0 : 1].count - 2 * ring;
    for (uint32_t k = 0; k < r->count; k++) {
        ring_point(t, ring, e, k, &i, &j);
        r->index[k] = t->lattice[j][i];
    }
}

/* ---- Triangles ---- */

static void add_triangle(qp_tess_grid *grid, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = grid->triangles + 3 * (size_t)grid->n_triangles++;
    t[0] = a, t[1] = b, t[2] = c;
}

/* The quad between segment o of the outer row and segment i of the inner one, with the diagonal from the
 * inner row forward to the outer one, or the other. */
static void quad_to_outer(qp_tess_grid *grid, const row *out, const row *in, uint32_t o, uint32_t i) {
    add_triangle(grid, in->index[i], out->index[o], out->index[o + 1]);
    add_triangle(grid, in->index[i], out->index[o + 1], in->index[i + 1]);
}

static void quad_to_inner(qp_tess_grid *grid, const row *out, const row *in, uint32_t o, uint32_t i) {
    add_triangle(grid, out->index[o], in->index[i + 1], in->index[i]);
    add_triangle(grid, out->index[o], out->index[o + 1], in->index[i + 1]);
}

/* A side between two rings of the lattice: the outer row has two points more. Diagonals mirror about the
 * middle. */
static void stitch_ring(qp_tess_grid *grid, const row *out, const row *in) {
    uint32_t n = in->count, k = 0;
    add_triangle(grid, out->index[0], out->index[1], in->index[0]);
    for (; k < n / 2 && k + 1 < n; k++) quad_to_inner(grid, out, in, k + 1, k);
    for (; k + 1 < n; k++) quad_to_outer(grid, out, in, k + 1, k);
    add_triangle(grid, out->index[n], out->index[n + 1], in->index[n - 1]);
}

/* The strip left in the middle when the shorter axis is odd: both rows have the same count. */
static void stitch_centre(qp_tess_grid *grid, const row *out, const row *in, bool flip_middle) {
    for (uint32_t k = 0; k + 1 < in->count; k++) {
        if (!flip_middle) {
            quad_to_outer(grid, out, in, k, k);
        } else if (k == in->count / 2 - 1) {
            quad_to_inner(grid, out, in, k, k);
        } else { /* the diagonal of quad_to_outer, its first triangle started at the outer row */
            add_triangle(grid, out->index[k], out->index[k + 1], in->index[k]);
            add_triangle(grid, in->index[k], out->index[k + 1], in->index[k + 1]);
        }
    }
}

/* When place m (1..31) of a half axis of at most 32 places comes into being as the factor grows: the middle
 * first, then the quarters, the eighths ... For m = odd * 2^k that is 2^(4-k) + (odd - 1) / 2. */
static uint32_t ruler_rank(uint32_t m) {
    uint32_t rank = 32 + m;
    while (!(rank & 1u)) rank >>= 1;
    return rank >> 1;
}

/* A side between an edge and the first ring, whose factors are unrelated. Both rows are walked as if they
 * had all 32 places a half, going on wherever a row has that place. */
static void stitch_edge(qp_tess_grid *grid, const row *out, const axis *outer, const row *in,
                        const axis *inner) {
    uint32_t in_half = inner->half - inner->odd, out_half = outer->half - outer->odd;
    const uint32_t *o = out->index, *i = in->index;
#define QP_STEP_OUT (add_triangle(grid, o[0], o[1], i[0]), o++)
#define QP_STEP_IN (add_triangle(grid, i[0], o[0], i[1]), i++)
    if (out_half > 0) QP_STEP_OUT;
    for (uint32_t m = 1; m < 32; m++) {
        if (ruler_rank(m) < in_half) QP_STEP_IN;
        if (ruler_rank(m) < out_half) QP_STEP_OUT;
    }
    if (inner->odd && outer->odd) {
        add_triangle(grid, i[0], o[0], i[1]);
        add_triangle(grid, i[1], o[0], o[1]);
        i++, o++;
    } else if (outer->odd) {
        add_triangle(grid, i[0], o[0], o[1]);
        o++;
    } else if (inner->odd) {
        QP_STEP_IN;
    }
    for (uint32_t m = 31; m > 0; m--) {
        if (ruler_rank(m) < out_half) QP_STEP_OUT;
        if (ruler_rank(m) < in_half) QP_STEP_IN;
    }
    if (out_half > 0) QP_STEP_OUT;
#undef QP_STEP_OUT
#undef QP_STEP_IN
}

static void make_triangles(const tessellator *t) {
    row out, in;
    uint32_t nu = t->inner[0].count, nv = t->inner[1].count;
    uint32_t rings = ((nu < nv ? nu : nv) + 1) / 2;
    for (uint32_t ring = 1; ring < rings; ring++)
        for (int e = 0; e < 4; e++) {
            ring_row(t, ring, e, &in);
            if (ring == 1) {
                edge_row(t, e, &out);
                stitch_edge(t->grid, &out, &t->outer[e], &in, &t->inner[e & 1 ? 0 : 1]);
            } else {
                ring_row(t, ring - 1, e, &out);
                stitch_ring(t->grid, &out, &in);
            }
        }
    bool wide = nu > nv;
    if (!t->inner[wide ? 1 : 0].odd) return; /* the last ring was a row already */
    /* Both rows run the same way: u up for a wide strip, v down for a tall one. */
    out.count = in.count = (wide ? nu : nv) - 2 * (rings - 1);
    for (uint32_t k = 0; k < out.count; k++) {
        uint32_t along = wide ? rings - 1 + k : nv - rings - k;
        out.index[k] = wide ? t->lattice[rings - 1][along] : t->lattice[along][rings - 1];
        in.index[k] = wide ? t->lattice[rings][along] : t->lattice[along][rings];
    }
    stitch_centre(t->grid, &out, &in, !wide && t->inner[1].odd);
}

static qp_status reserve(qp_tess_grid *grid, size_t points, size_t triangles, qp_error *err) {
    void *uv = grid->uv, *tri = grid->triangles;
    bool ok = qp_grow(&uv, &grid->point_capacity, points, 2 * sizeof(float));
    grid->uv = uv;
    ok = ok && qp_grow(&tri, &grid->triangle_capacity, triangles, 3 * sizeof(uint32_t));
    grid->triangles = tri;
    return ok ? QP_OK : qp_fail_memory(err, points * 8 + triangles * 12, "tessellation");
}

qp_status qp_tessellate(qp_spacing spacing, const float outer[4], const float inner[2], qp_tess_grid *grid,
                        qp_error *err) {
    tessellator t;
    t.grid = grid;
    grid->n_points = grid->n_triangles = 0;
    if (!set_up_axes(&t, spacing, outer, inner)) return QP_OK;
    size_t rim = 0, inside = (size_t)(t.inner[0].count - 2) * (t.inner[1].count - 2);
    for (int e = 0; e < 4; e++) rim += t.outer[e].count - 1;
    /* Euler: a disc of P points with R of them on its rim has 2 P - 2 - R triangles. */
    qp_status s = reserve(grid, rim + inside, 2 * inside + rim, err);
    if (s) return s;
    if (t.single_quad) {
        add_point(grid, 0, 0);
        add_point(grid, ONE, 0);
        add_point(grid, ONE, ONE);
        add_point(grid, 0, ONE);
        add_triangle(grid, 0, 1, 3);
        add_triangle(grid, 1, 2, 3);
        return QP_OK;
    }
    make_points(&t);
    make_triangles(&t);
    return QP_OK;
}

void qp_tess_grid_free(qp_tess_grid *grid) {
    if (!grid) return;
    free(grid->uv);
    free(grid->triangles);
    memset(grid, 0, sizeof *grid);
}

uint32_t qp_tess_grid_level(const qp_tess_grid *grid) {
    float nearest = 1.0f;
    for (size_t k = 0; k < 2 * (size_t)grid->n_points; k++) {
        float x = grid->uv[k], from_edge = x < 0.5f ? x : 1.0f - x;
        if (from_edge > 0 && from_edge < nearest) nearest = from_edge;
    }
    uint32_t level = 0;
    while (ldexpf(1.0f, -(int)level) > nearest) level++;
    return level;
}
