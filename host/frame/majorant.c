/* Bounds of the second derivatives of every leaf of a patch's quadtree, and the convex functions made from them.
 *
 * Let T be a triangle of (u,v), x a point in it, x = sum w_i t_i. By Taylor's formula about x along the lines to the corners, with
 * d_i = t_i - x, whose weighted sum is 0,
 *   sum w_i S(t_i) - S(x) = sum w_i int_0^1 (1-s) D2S(x + s d_i)[d_i, d_i] ds.
 * With functions P'' of u alone and Q'' of v alone such that |D2S[d, d]| <= P'' du^2 + Q'' dv^2 everywhere, the norm of this is at most
 * sum w_i P(u_i) - P(u) + sum w_i Q(v_i) - Q(v), and the first part is at most what the chord of P over T's range of u lies above P (P
 * is convex). With P'' constant that is h^2 / 8 times P'', as in the bound of Filip, Magedson and Markot (1986). Unlike theirs it stays
 * finite at extraordinary corners, where second derivatives do not, and small beside semi-sharp creases, where they are large in a
 * narrow strip only.
 *
 * The formula asks for a surface that is C1, and C2 in pieces along lines: true inside patches, the corners apart. P'' and Q'' are
 * constant between the places 2^-k and 3/2 2^-k and their mirror images: leaves get small towards a patch's edges only. */
#include "host/frame/majorant.h"
#include "host/frame/bends.h"
#include "host/frame/patch_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Levels that rings about extraordinary corners are followed to; what they have shrunk to by then is no matter. Their plans' rings are
 * to level 10 at the least (RINGS), and from there on taken to shrink by SHRINK a level: the corner's dominant eigenvalue is at most
 * 0.6545 (that of a smooth vertex of infinite valence, or of a crease's sector of as many faces), and what is left by then of modes
 * that decay faster, and of how they cancel each other, is given the rest. */
enum { LEVELS = 40, RINGS = 10, DEEP = 16, HALF = 2 * LEVELS - 1, PIECES = 2 * HALF, MOST_WORKERS = 65 };
static const double SHRINK = 0.7;

typedef struct box {
    double u0, u1, v0, v1;
} box;

/* A quarter of a leaf, in the plan's (u,v). */
typedef struct leaf {
    box at;
    qp_bend bend;
} leaf;

/* Scratch of one worker. */
typedef struct work {
    qp_patch_points at;
    leaf *leaves;
    size_t n_leaves, leaf_capacity;
    double mean_u, mean_v; /* sums over leaves, by area */
    double ratio;          /* r of bends.h; 0 while the means are summed */
    double rest;
    bool failed;
} work;

typedef struct node_place {
    double u, v, size;
} node_place;

static double norm(const double *d) {
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* ---- Leaves ---- */

/* From the frame turned by `rotation` (plan_layout.h) back to the one it was turned in. */
static box unturned(box b, uint32_t rotation) {
    switch (rotation & 3u) {
    case 1:
        return (box){1 - b.v1, 1 - b.v0, b.u0, b.u1};
    case 2:
        return (box){1 - b.u1, 1 - b.u0, 1 - b.v1, 1 - b.v0};
    case 3:
        return (box){b.v0, b.v1, 1 - b.u1, 1 - b.u0};
    default:
        return b;
    }
}

static bool put_leaf(work *w, box at, qp_bend bend) {
    if (!qp_grow((void **)&w->leaves, &w->leaf_capacity, w->n_leaves + 1, sizeof *w->leaves)) {
        w->failed = true;
        return false;
    }
    w->leaves[w->n_leaves++] = (leaf){at, bend};
    return true;
}

static box placed(node_place node, box b) {
    return (box){node.u + node.size * b.u0, node.u + node.size * b.u1, node.v + node.size * b.v0,
                 node.v + node.size * b.v1};
}

/* A spline of 16 points over the part `at` of a node, in the frame turned by `rotation`, whose unit square is width_u x width_v of the
 * node. Of a strip at[v0, v1] of that the quarters' bounds hold all the same. */
static void add_leaf(work *w, double p[16][3], node_place node, uint32_t rotation, box at, double width_u,
                     double width_v) {
    const double hu = width_u * node.size, hv = width_v * node.size;
    const bool turned = (rotation & 1u) != 0;
    if (w->ratio == 0) {
        const double area = (at.u1 - at.u0) * (at.v1 - at.v0) * node.size * node.size;
        const qp_bend mean = qp_spline_mean_bend(p, hu, hv);
        w->mean_u += area * (turned ? mean.v : mean.u);
        w->mean_v += area * (turned ? mean.u : mean.v);
        return;
    }
    qp_bend bends[4];
    qp_spline_bends(p, hu, hv, turned ? 1 / w->ratio : w->ratio, bends);
    for (int q = 0; q < 4; ++q) {
        const double du = 0.5 * width_u, dv = 0.5 * width_v;
        const double u0 = at.u0 + (q & 1) * du, v0 = width_v * floor(at.v0 / width_v) + (q >> 1) * dv;
        const box quarter = {u0, u0 + du, fmax(v0, at.v0), fmin(v0 + dv, at.v1)};
        if (!(quarter.v0 < quarter.v1)) continue;
        const qp_bend bend = turned ? (qp_bend){bends[q].v, bends[q].u} : bends[q];
        if (!put_leaf(w, placed(node, unturned(quarter, rotation)), bend)) return;
    }
}

static void read_points(const work *w, const uint32_t *words, double p[16][3]) {
    for (uint32_t k = 0; k < 16; ++k) memcpy(p[k], qp_patch_point(&w->at, words, k), sizeof p[k]);
}

/* Each zone of v is a spline of its own: the rows of points times the zone's matrix, over v times its scale. */
static void add_crease(work *w, const uint32_t *node, node_place place) {
    const qp_plan *plan = w->at.plan;
    const double *c = plan->constants + (node[10] - qp_plan_first_constant(plan));
    const double ends[4] = {1, c[0], c[1], 0};
    double p[16][3], q[16][3];
    read_points(w, node + 2, p);
    for (uint32_t zone = 0; zone < 3; ++zone) {
        const double *m = c + 5 + 16 * zone;
        if (!(ends[zone + 1] < ends[zone])) continue;
        for (uint32_t i = 0; i < 4; ++i) {
            for (uint32_t k = 0; k < 4; ++k) {
                for (uint32_t x = 0; x < 3; ++x)
                    q[4 * i + k][x] = m[4 * i] * p[k][x] + m[4 * i + 1] * p[4 + k][x] +
                                      m[4 * i + 2] * p[8 + k][x] + m[4 * i + 3] * p[12 + k][x];
            }
        }
        add_leaf(w, q, place, QP_NODE_ROTATION(node[0]), (box){0, 1, ends[zone + 1], ends[zone]}, 1,
                 1 / c[2 + zone]);
    }
}

static void ring_points(const work *w, const uint32_t *ring, uint32_t cx, uint32_t cy, double p[16][3]) {
    for (uint32_t k = 0; k < 16; ++k) {
        const uint32_t slot = 5 * (cy + k / 4) + cx + k % 4 - 1;
        memcpy(p[k], qp_patch_point(&w->at, ring, slot), sizeof p[k]);
    }
}

static void add_rings(work *w, const uint32_t *node, node_place place) {
    const uint32_t *ring = node + 3;
    double p[16][3], size = 0.5;
    for (uint32_t k = 0; k < QP_NODE_RINGS(node[0]); ++k, ring += 12, size *= 0.5) {
        for (uint32_t part = 1; part < 4; ++part) {
            const uint32_t cx = part & 1u, cy = part >> 1;
            ring_points(w, ring, cx, cy, p);
            add_leaf(w, p, place, QP_NODE_ROTATION(node[0]),
                     (box){cx * size, (cx + 1) * size, cy * size, (cy + 1) * size}, size, size);
        }
    }
}

/* ---- Extraordinary corners ----
 * Of the last cell C at a corner, of size h, second derivatives are unknown (and unbounded). Lines to the corner end in it: what Taylor's
 * formula leaves out there is S(corner) - S(y) - DS(y)(corner - y) at the place y where they enter, no more than |S - S(corner)| +
 * h (|S_u| + |S_v|). No other line meets C when x lies outside the cell of twice its size. For x inside that, S(x) and S(corner) differ
 * by at most `offset`, and so does the triangle at x from the triangle at the place y on the cell's rim that lies on the ray through x,
 * or less; in all `offset` twice. */
static double corner_rest(const work *w, const uint32_t *node, const uint32_t *terminal) {
    const uint32_t rings = QP_NODE_RINGS(terminal[0]), first = rings > 3 ? rings - 3 : 0;
    double offset = 0;
    for (uint32_t r = first; r < rings; ++r) {
        for (uint32_t k = 0; k < 24; ++k) {
            double d[3];
            qp_patch_offset(&w->at, terminal, node, r, k, d);
            offset = fmax(offset, norm(d));
        }
    }
    /* First differences are at most two offsets. */
    return 7 * offset;
}

/* The corner (0,0) of a terminal's frame: rings below its last one, whose leaves are the last 12, and what then remains. */
static void add_corner(work *w, const uint32_t *node, node_place place, const uint32_t *terminal) {
    enum { LAST = 12 };
    const box corner = placed(place, unturned((box){0, 0, 0, 0}, QP_NODE_ROTATION(terminal[0])));
    const int level = -ilogb(place.size);
    if (w->ratio == 0) return;
    if ((corner.u0 != 0 && corner.u0 != 1) || (corner.v0 != 0 && corner.v0 != 1)) {
        w->rest = INFINITY; /* no plan of ours has one elsewhere */
        return;
    }
    /* From the corner, a ring holds [0, 1/2], [1/2, 3/4] and [3/4, 1] of its cell, along u and along v. */
    double most_u[3] = {0}, most_v[3] = {0};
    for (size_t i = w->n_leaves - LAST; i < w->n_leaves; ++i) {
        const leaf *l = &w->leaves[i];
        const double u = (corner.u0 == 0 ? l->at.u1 : 1 - l->at.u0) / place.size;
        const double v = (corner.v0 == 0 ? l->at.v1 : 1 - l->at.v0) / place.size;
        const int part_u = u > 1.5 ? 2 : u > 1, part_v = v > 1.5 ? 2 : v > 1;
        most_u[part_u] = fmax(most_u[part_u], l->bend.u);
        most_v[part_v] = fmax(most_v[part_v], l->bend.v);
    }
    double grown = 1;
    for (int l = level; l < LEVELS; ++l) {
        const double size = ldexp(1.0, -l), ends[4] = {0, 0.5 * size, 0.75 * size, size};
        grown *= 4 * SHRINK;
        for (int part = l + 1 < LEVELS; part < 3; ++part) {
            const double u0 = ends[part], u1 = ends[part + 1];
            const box at = {corner.u0 == 0 ? u0 : 1 - u1, corner.u0 == 0 ? u1 : 1 - u0,
                            corner.v0 == 0 ? u0 : 1 - u1, corner.v0 == 0 ? u1 : 1 - u0};
            /* The ring above reaches here too. */
            const double above = grown / (4 * SHRINK);
            if (!put_leaf(w, at,
                          (qp_bend){fmax(grown * most_u[part], above * most_u[0]),
                                    fmax(grown * most_v[part], above * most_v[0])}))
                return;
        }
    }
    w->rest += corner_rest(w, node, terminal) * pow(SHRINK, LEVELS - level);
}

/* Nothing is known of this leaf's points but that they are averages of the patch's 1-ring, within which the surface and all triangles
 * stay. */
static void add_unknown(work *w) {
    double most = 0;
    for (uint32_t j = 0; j < w->at.plan->ring_size; ++j) most = fmax(most, norm(w->at.ring + 3 * (size_t)j));
    w->rest += 2 * most;
}

static void visit(work *w, uint32_t at, node_place place, const uint32_t *terminal) {
    const uint32_t *node = w->at.plan->tree + at;
    double p[16][3];
    if (w->failed) return;
    switch (QP_NODE_KIND(node[0])) {
    case QP_NODE_INTERNAL:
        for (uint32_t child = 0; child < 4; ++child) {
            const double half = 0.5 * place.size;
            visit(w, node[1 + child],
                  (node_place){place.u + half * (child & 1u), place.v + half * (child >> 1), half}, NULL);
        }
        return;
    case QP_NODE_TERMINAL: {
        add_rings(w, node, place);
        const double left = ldexp(1.0, -(int)QP_NODE_RINGS(node[0]));
        const box b = unturned((box){0, left, 0, left}, QP_NODE_ROTATION(node[0]));
        visit(w, node[2],
              (node_place){place.u + place.size * b.u0, place.v + place.size * b.v0, place.size * left},
              node);
        return;
    }
    case QP_NODE_CREASE:
        add_crease(w, node, place);
        return;
    case QP_NODE_REGULAR:
        read_points(w, node + 2, p);
        add_leaf(w, p, place, 0, (box){0, 1, 0, 1}, 1, 1);
        return;
    case QP_NODE_EXTRAORDINARY:
        if (terminal != NULL && QP_NODE_RINGS(terminal[0]) > 0)
            add_corner(w, node, place, terminal);
        else
            add_unknown(w);
        return;
    default:
        add_unknown(w);
        return;
    }
}

/* ---- Of one patch ---- */

/* 0, 2^-LEVELS, 3/2 2^-LEVELS, 2^-LEVELS+1 ... 1/2 and the mirror images. */
static double piece_begin(uint32_t k) {
    if (k > HALF) return 1 - piece_begin(PIECES - k);
    return k == 0 ? 0 : ldexp(k % 2 == 0 ? 1.5 : 1.0, (int)(k - 1) / 2 - LEVELS);
}

/* Piece in which x lies; of a place between two, the upper one. */
static uint32_t piece_of(const double *begins, double x) {
    uint32_t low = 0, high = PIECES;
    while (high - low > 1) {
        const uint32_t middle = (low + high) / 2;
        if (begins[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void raise_pieces(const double *begins, double *bend, double from, double to, double by) {
    for (uint32_t k = piece_of(begins, from); k < PIECES && begins[k] < to; ++k)
        if (bend[k] < by) bend[k] = by;
}

static bool integrate(const double *begins, const double *bend, qp_majorant *m) {
    uint32_t count = 2;
    for (uint32_t k = 1; k < PIECES; ++k) count += bend[k] != bend[k - 1];
    m->pieces = qp_alloc(count, sizeof *m->pieces, false);
    if (m->pieces == NULL) return false;
    double slope = 0, value = 0;
    for (uint32_t k = 0; k < PIECES; ++k) {
        if (k == 0 || bend[k] != bend[k - 1])
            m->pieces[m->count++] = (struct qp_majorant_piece){begins[k], bend[k], slope, value};
        const double h = begins[k + 1] - begins[k];
        value += h * (slope + 0.5 * h * bend[k]);
        slope += h * bend[k];
    }
    m->pieces[m->count++] = (struct qp_majorant_piece){1, 0, slope, value};
    return true;
}

/* The r that makes the product of both functions' means, and so the number of triangles, least. */
static double best_ratio(const work *w) {
    const double u = w->mean_u, v = w->mean_v;
    return u > 0 && v > 0 ? fmin(fmax(sqrt(u / v), 1.0 / 64), 64) : u > 0 ? 64 : v > 0 ? 1.0 / 64 : 1;
}

static bool make_functions(const work *w, const double *begins, uint32_t rotation, qp_patch_majorant *made) {
    double bend_u[PIECES] = {0}, bend_v[PIECES] = {0};
    for (size_t i = 0; i < w->n_leaves; ++i) {
        const leaf *l = &w->leaves[i];
        const box at = unturned(l->at, rotation);
        const bool turned = (rotation & 1u) != 0;
        raise_pieces(begins, bend_u, at.u0, at.u1, turned ? l->bend.v : l->bend.u);
        raise_pieces(begins, bend_v, at.v0, at.v1, turned ? l->bend.u : l->bend.v);
    }
    made->rest = w->rest;
    return integrate(begins, bend_u, &made->u) && integrate(begins, bend_v, &made->v);
}

static bool make_one(work *w, const double *begins, const qp_surface *surface, uint32_t patch,
                     qp_patch_majorant *made) {
    if (!qp_patch_points_make(surface, patch, &w->at)) return false;
    w->n_leaves = 0;
    w->rest = w->ratio = w->mean_u = w->mean_v = 0;
    visit(w, 0, (node_place){0, 0, 1}, NULL);
    w->ratio = best_ratio(w);
    w->rest = 0;
    visit(w, 0, (node_place){0, 0, 1}, NULL);
    return !w->failed && make_functions(w, begins, surface->patch_rotation[patch], made);
}

/* ---- Of all ---- */

typedef struct make_job {
    const qp_surface *surface, *deep; /* deep: for patches that have a plan there, or NULL */
    qp_patch_majorant *made;
    double begins[PIECES + 1];
    work workers[MOST_WORKERS];
} make_job;

static void make_some(void *context, size_t begin, size_t end, unsigned worker) {
    make_job *job = context;
    work *w = &job->workers[worker];
    for (size_t p = begin; p < end && !w->failed; ++p) {
        const bool deep = job->deep != NULL && job->deep->patch_plan[p] != QP_NONE;
        const qp_surface *surface = deep ? job->deep : job->surface;
        if (surface->patch_plan[p] == QP_NONE) continue;
        if (!make_one(w, job->begins, surface, (uint32_t)p, &job->made[p])) w->failed = true;
    }
}

/* Plans of DEEP levels where the surface's are too shallow; *deep is NULL where none is. */
static qp_status deepen(const qp_surface *surface, qp_surface **deep, qp_error *err) {
    const uint32_t n = surface->mesh->n_patches;
    const qp_surface_options options = {.depth = DEEP};
    bool any = false;
    *deep = NULL;
    uint8_t *mask = qp_alloc(n, 1, true);
    if (mask == NULL) return qp_fail_memory(err, n, "deeper plans");
    for (uint32_t p = 0; p < n; ++p) {
        if (surface->patch_plan[p] == QP_NONE) continue;
        const qp_plan *plan = surface->plans[surface->patch_plan[p]];
        mask[p] = (plan->flags & QP_PLAN_IRREGULAR) != 0 ||
                  ((plan->flags & QP_PLAN_CORNERS) != 0 &&
                   (plan->depth < RINGS || !qp_patch_settles(surface->mesh, p, plan->depth)));
        any = any || mask[p];
    }
    qp_status status = any ? qp_surface_create_for(surface->mesh, &options, mask, deep, err) : QP_OK;
    free(mask);
    return status;
}

qp_status qp_majorants_make(const qp_surface *surface, qp_patch_majorant **majorants, qp_error *err) {
    const uint32_t n = surface->mesh->n_patches;
    qp_surface *deep;
    *majorants = NULL;
    qp_status status = deepen(surface, &deep, err);
    if (status != QP_OK) return status;
    make_job *job = qp_alloc(1, sizeof *job, true);
    qp_patch_majorant *made = qp_alloc(n, sizeof *made, true);
    bool ok = job != NULL && made != NULL;
    if (ok) {
        job->surface = surface;
        job->deep = deep;
        job->made = made;
        for (uint32_t k = 0; k <= PIECES; ++k) job->begins[k] = piece_begin(k);
        qp_parallel(n, 16, make_some, job);
        for (unsigned i = 0; i < MOST_WORKERS; ++i) {
            ok = ok && !job->workers[i].failed;
            qp_patch_points_free(&job->workers[i].at);
            free(job->workers[i].leaves);
        }
    }
    free(job);
    qp_surface_free(deep);
    if (ok) {
        *majorants = made;
        return QP_OK;
    }
    qp_majorants_free(made, n);
    return qp_fail_memory(err, n * sizeof *made, "the bounds of patches");
}

void qp_majorants_free(qp_patch_majorant *majorants, uint32_t n_patches) {
    for (uint32_t p = 0; majorants != NULL && p < n_patches; ++p) {
        free(majorants[p].u.pieces);
        free(majorants[p].v.pieces);
    }
    free(majorants);
}

/* ---- Gaps ---- */

static double value_at(const qp_majorant *m, double x) {
    uint32_t low = 0, high = m->count - 1;
    while (high - low > 1) {
        const uint32_t middle = (low + high) / 2;
        if (m->pieces[middle].at <= x)
            low = middle;
        else
            high = middle;
    }
    const struct qp_majorant_piece *p = &m->pieces[low];
    const double h = x - p->at;
    return p->value + h * (p->slope + 0.5 * h * p->bend);
}

double qp_majorant_gap(const qp_majorant *m, double from, double to) {
    if (!(from < to) || m->count == 0) return 0;
    const double begin = value_at(m, from), slope = (value_at(m, to) - begin) / (to - from);
    /* The gap is largest where the function's slope is the chord's. */
    uint32_t low = 0, high = m->count - 1;
    while (high - low > 1) {
        const uint32_t middle = (low + high) / 2;
        if (m->pieces[middle].slope <= slope)
            low = middle;
        else
            high = middle;
    }
    const struct qp_majorant_piece *p = &m->pieces[low];
    double x = p->bend > 0 ? p->at + (slope - p->slope) / p->bend : p->at;
    x = fmin(fmax(x, from), to);
    return fmax(begin + slope * (x - from) - value_at(m, x), 0);
}
