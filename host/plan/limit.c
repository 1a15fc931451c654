/* Limit stencils at a vertex.
 *
 * Once no semi-sharp feature is left around a vertex its rules repeat at every level, so its limit is a left
 * eigenvector of the local subdivision matrix: eigenvalue 1 for the position, the two next ones for the
 * tangents. Smooth (Halstead, Kass, DeRose 1993): with valence n, position weights n^2, 4, 1 over n(n+5);
 * tangents, with t = 2 pi j / n, A = 1 + cos(2 pi/n) + cos(pi/n) sqrt(18 + 2 cos(2 pi/n)):  edges A cos t,
 * faces cos t + cos(t + 2 pi/n), and the same with sin. Crease of m faces, theta = pi/m: along
 * it e_0 - e_m (eigenvalue 1/2); across it the sine mode of the sector. With x on the crease's ends, A sin(j theta) on edge j
 * and sin(j theta) + sin((j+1) theta) on face j, the face rows of w S = lambda w give lambda = A/16 + 1/4, the edge rows
 * A = 1 + cos theta + cos(theta/2) sqrt(18 + 2 cos theta), and the end rows with sum(w) = 0
 * x = (sin theta (A + 4) - 2 cot(theta/2) (A + 2))/A. For m = 2 this is the B-spline's cross tangent. (Biermann, Levin, Zorin
 * 2000 and OpenSubdiv have A = 4 for every m, which holds for their modified rules only.) From m = 4 on a further mode
 * is as strong as the crease's own tangent: there is no tangent plane, and these two vectors are a choice.
 * A dart (one
 * infinitely sharp spoke) has no closed form: its edge point is a midpoint, which changes the eigenvectors;
 * they are found by power iteration below (OpenSubdiv uses the smooth masks there). */
#include "host/plan/local.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* From long double, so that the last bit does not depend on the C library's version or on what the processor can do. */
static double cosine(double x) {
    return (double)cosl((long double)x);
}
static double sine(double x) {
    return (double)sinl((long double)x);
}

static const double pi = 3.14159265358979323846;

/* Masks over the vertex, its spokes, its diagonals and the ends of a crease through it: [mask_size()]. */
typedef struct masks {
    double *p, *t1, *t2;
    bool has_tangents;
} masks;

static uint32_t mask_size(const qp_fan *fan) {
    return 1 + qp_fan_spokes(fan) + fan->faces + (fan->through ? 2 : 0);
}

/* Angles are counted from spoke `first`. */
static void smooth_masks(uint32_t n, uint32_t first, masks *m) {
    double *e1 = m->t1 + 1, *f1 = e1 + n, *e2 = m->t2 + 1, *f2 = e2 + n;
    double d = n;
    m->p[0] = d / (d + 5.0);
    for (uint32_t j = 0; j < n; ++j) {
        m->p[1 + j] = 4.0 / (d * (d + 5.0));
        m->p[1 + n + j] = 1.0 / (d * (d + 5.0));
    }
    m->has_tangents = true;
    if (n == 2) {
        /* Both modes have eigenvalue 1/4; the general sine mask vanishes, the mode lives on the faces alone. */
        e1[first] = f2[first] = 1.0;
        e1[1 - first] = f2[1 - first] = -1.0;
        return;
    }
    double step = 2.0 * pi / d;
    double a = 1.0 + cosine(step) + cosine(pi / d) * sqrt(18.0 + 2.0 * cosine(step));
    for (uint32_t j = 0; j < n; ++j) {
        double t = step * ((double)j - first), next = step * ((double)j + 1.0 - first);
        e1[j] = a * cosine(t), e2[j] = a * sine(t);
        f1[j] = cosine(t) + cosine(next), f2[j] = sine(t) + sine(next);
    }
}

/* One step w <- w S of the dart's subdivision matrix S over (v, e_0.., f_0..). */
static void dart_step(uint32_t n, uint32_t dart, const double *w, double *out) {
    double d = n, share = 1.0 / (d * d);
    const double *we = w + 1, *wf = we + n;
    double *oe = out + 1, *of = oe + n;
    /* v' = (n-2)/n v + sum(e)/n^2 + sum(F)/n^2 with F_j = (v + e_j + e_j+1 + f_j)/4 */
    out[0] = w[0] * ((d - 2.0) / d + share * d * 0.25);
    for (uint32_t j = 0; j < n; ++j) {
        oe[j] = w[0] * share * 1.5;
        of[j] = w[0] * share * 0.25;
    }
    for (uint32_t j = 0; j < n; ++j) {
        uint32_t next = j + 1 == n ? 0 : j + 1, prev = j == 0 ? n - 1 : j - 1;
        /* f_j' = F_j */
        out[0] += 0.25 * wf[j];
        oe[j] += 0.25 * wf[j], oe[next] += 0.25 * wf[j];
        of[j] += 0.25 * wf[j];
        if (j == dart) {
            out[0] += 0.5 * we[j];
            oe[j] += 0.5 * we[j];
            continue;
        }
        /* e_j' = (v + e_j + F_j + F_j-1)/4 */
        out[0] += 0.375 * we[j];
        oe[j] += 0.375 * we[j];
        oe[next] += 0.0625 * we[j], oe[prev] += 0.0625 * we[j];
        of[j] += 0.0625 * we[j], of[prev] += 0.0625 * we[j];
    }
}

static double sum_of(const double *w, uint32_t count) {
    double s = 0.0;
    for (uint32_t i = 0; i < count; ++i) s += w[i];
    return s;
}

/* The symmetric tangent mode by power iteration, with the constant (the position's eigenvector) deflated; the
 * antisymmetric one vanishes on the sharp spoke and so is that of the smooth vertex. `work` holds 1 + 2n
 * doubles. */
static void dart_masks(uint32_t n, uint32_t dart, masks *m, double *work) {
    uint32_t count = 1 + 2 * n;
    smooth_masks(n, dart, m);
    for (int step = 0; step < 400; ++step) {
        dart_step(n, dart, m->p, work);
        double s = sum_of(work, count);
        for (uint32_t i = 0; i < count; ++i) m->p[i] = work[i] / s;
    }
    for (int step = 0; step < 600; ++step) {
        dart_step(n, dart, m->t1, work);
        double s = sum_of(work, count), largest = 0.0;
        for (uint32_t i = 0; i < count; ++i) {
            work[i] -= s * m->p[i];
            largest = fmax(largest, fabs(work[i]));
        }
        if (largest == 0.0) {
            m->has_tangents = false;
            return;
        }
        for (uint32_t i = 0; i < count; ++i) m->t1[i] = work[i] / largest;
    }
}

/* Tangents of the crease sector that runs counter-clockwise from spoke `begin` over `faces` faces. */
static void crease_masks(const qp_fan *fan, uint32_t begin, uint32_t faces, masks *m) {
    uint32_t spokes = qp_fan_spokes(fan);
    uint32_t end = (begin + faces) % spokes;
    m->p[0] = 2.0 / 3.0;
    m->p[1 + begin] = m->p[1 + end] = 1.0 / 6.0;
    /* One face: both tangents run along the crease curve, there is no plane. */
    m->has_tangents = faces >= 2;
    if (!m->has_tangents) return;
    m->t1[1 + begin] = 1.0;
    m->t1[1 + end] = -1.0;
    double theta = pi / faces,
           a = 1.0 + cosine(theta) + cosine(0.5 * theta) * sqrt(18.0 + 2.0 * cosine(theta));
    double ends = (sine(theta) * (a + 4.0) - 2.0 * cosine(0.5 * theta) / sine(0.5 * theta) * (a + 2.0)) / a,
           sum = 2.0 * ends;
    m->t2[1 + begin] = m->t2[1 + end] = ends;
    for (uint32_t j = 0; j < faces; ++j) {
        uint32_t spoke = (begin + j) % spokes, face = (begin + j) % fan->faces;
        if (j > 0) m->t2[1 + spoke] = a * sine(j * theta);
        m->t2[1 + spokes + face] = sine(j * theta) + sine((j + 1) * theta);
        sum += m->t2[1 + spokes + face] + (j > 0 ? m->t2[1 + spoke] : 0.0);
    }
    m->t2[0] = -sum;
}

/* Masks of a fan without semi-sharp features. */
static void fan_masks(const qp_corner *corner, masks *m, double *work) {
    const qp_fan *fan = corner->fan;
    uint32_t spokes = qp_fan_spokes(fan), sharp, last = 0;
    qp_fan_sharp_edges(fan, &sharp);
    for (uint32_t j = 0; j < spokes; ++j) {
        if (qp_sharp_is_infinite(fan->sharp[j])) last = j;
    }
    if (!qp_sharp_is_infinite(fan->sharpness) && sharp == 0) {
        smooth_masks(fan->faces, 0, m);
    } else if (!qp_sharp_is_infinite(fan->sharpness) && sharp == 1) {
        dart_masks(fan->faces, last, m, work);
    } else if (!qp_sharp_is_infinite(fan->sharpness) && sharp == 2 && fan->beside) {
        /* The fan moves with a vertex that ignores it, as at a sharp apex. */
        m->p[0] = 2.0 / 3.0;
        m->p[1 + spokes + fan->faces] = m->p[2 + spokes + fan->faces] = 1.0 / 6.0;
        m->has_tangents = false;
    } else if (!qp_sharp_is_infinite(fan->sharpness) && sharp == 2) {
        /* The sector of the cell: back to the crease spoke before it, on to the one after it. */
        int back = 0, on = 1;
        while (!qp_sharp_is_infinite(qp_corner_sharp(corner, back))) --back;
        while (!qp_sharp_is_infinite(qp_corner_sharp(corner, on))) ++on;
        crease_masks(fan, qp_corner_spoke(corner, back), (uint32_t)(on - back), m);
    } else {
        m->p[0] = 1.0;
        /* Between two sharp edges the face has both of them as tangents; any smooth edge in the sector bends
         * with the leading eigenvector only, which spans no plane. */
        m->has_tangents = qp_sharp_is_infinite(qp_corner_sharp(corner, 0)) &&
                          qp_sharp_is_infinite(qp_corner_sharp(corner, 1));
        if (!m->has_tangents) return;
        m->t1[0] = m->t2[0] = -1.0;
        m->t1[1 + qp_corner_spoke(corner, 0)] = 1.0;
        m->t2[1 + qp_corner_spoke(corner, 1)] = 1.0;
    }
}

static void apply_mask(const qp_local *local, const qp_level *level, const qp_fan *fan, const double *mask,
                       double *row) {
    uint32_t width = local->width, spokes = qp_fan_spokes(fan);
    memset(row, 0, width * sizeof *row);
    for (uint32_t i = 0; i < mask_size(fan); ++i) {
        if (mask[i] == 0.0) continue;
        uint32_t point = i == 0                     ? fan->vertex
                         : i <= spokes              ? fan->spoke[i - 1]
                         : i <= spokes + fan->faces ? fan->diagonal[i - 1 - spokes]
                                                    : fan->end[i - 1 - spokes - fan->faces];
        const double *from = qp_level_row(local, level, point);
        for (uint32_t k = 0; k < width; ++k) row[k] += mask[i] * from[k];
    }
    if (fan->faces >= QP_SETTLE_FACES) qp_row_settle(row, width);
}

/* Tangents shrink with the level; only their direction counts, so they are brought to a largest weight of 1.
 */
static void normalise_row(double *row, uint32_t width) {
    double largest = 0.0;
    for (uint32_t k = 0; k < width; ++k) largest = fmax(largest, fabs(row[k]));
    if (largest == 0.0) return;
    for (uint32_t k = 0; k < width; ++k) row[k] /= largest;
}

static bool has_general_face(const qp_fan *fan) {
    for (uint32_t j = 0; j < fan->faces; ++j) {
        if (fan->diagonal[j] == QP_NONE) return true;
    }
    return false;
}

double *qp_limit_mask(const qp_corner *corner) {
    uint32_t count = mask_size(corner->fan);
    double *block = qp_alloc(4 * (size_t)count, sizeof *block, true);
    if (block == NULL) return NULL;
    masks m = {.p = block, .t1 = block + count, .t2 = block + 2 * (size_t)count};
    fan_masks(corner, &m, block + 3 * (size_t)count);
    return block;
}

void qp_limit_apply(const qp_local *local, const qp_level *level, const qp_fan *fan, const double *mask,
                    double *row) {
    apply_mask(local, level, fan, mask, row);
}

void qp_limit_stencils(qp_local *local, const qp_level *from, const qp_corner *corner, double *rows,
                       bool *has_tangents) {
    /* Semi-sharp features, and faces that are no quads, go away by subdividing the vertex's 1-ring on its
     * own, between two levels that hold nothing else. */
    qp_local own = {.width = local->width,
                    .chaikin = local->chaikin,
                    .smooth_triangles = local->smooth_triangles,
                    .ring_faces = local->ring_faces};
    qp_corner c = *corner;
    const qp_level *level = from;
    int turn = 0;
    while ((qp_fan_has_semi_sharp(c.fan) || has_general_face(c.fan)) && !own.failed) {
        qp_level *to = &own.level[turn];
        qp_level_clear(to);
        c.fan = qp_refine_fan(&own, (qp_level *)level, to, c.fan);
        level = to;
        turn ^= 1;
        if (c.fan == NULL) break;
    }
    if (c.fan == NULL || own.failed) {
        local->failed = true;
        qp_local_free(&own);
        return;
    }
    uint32_t count = mask_size(c.fan);
    double *block = qp_alloc(4 * (size_t)count, sizeof *block, true);
    if (block == NULL) {
        local->failed = true;
        qp_local_free(&own);
        return;
    }
    masks m = {.p = block, .t1 = block + count, .t2 = block + 2 * (size_t)count};
    fan_masks(&c, &m, block + 3 * (size_t)count);
    *has_tangents = m.has_tangents;
    uint32_t width = local->width;
    apply_mask(local, level, c.fan, m.p, rows);
    apply_mask(local, level, c.fan, m.t1, rows + width);
    apply_mask(local, level, c.fan, m.t2, rows + 2 * (size_t)width);
    normalise_row(rows + width, width);
    normalise_row(rows + 2 * (size_t)width, width);
    free(block);
    qp_local_free(&own);
}
