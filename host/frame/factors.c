/* Factors without cracks: both sides of every edge have samples at the same places of it.
 *
 * Between quads an edge's own factor will do, as the tessellator places points symmetrically. The children of an n-gon, though, each
 * span half of a base edge, so that one of its edges has a vertex in the middle and the quad beyond it must have one too (the 2k / 4k
 * rule). Of an edge of factor f that an n-gon touches, each half gets m segments:
 *
 * - equal, fractional_even: m = f / 2 rounded up to a power of two (at least 2 for fractional_even), and a quad takes 2m. Other
 *   numbers would not do, for the tessellator rounds i / m and i / 2m to 16 bits after the point, each on its own.
 * - fractional_odd: m = f / 2. No odd number of segments is twice another, and so a quad beside an n-gon is tessellated as its four
 *   quarters, each of whose edges is a half too; and so are the quads beside that one, and on. The lines between quarters get the
 *   largest m of the quad's edges.
 *
 * The spokes of an n-gon, from the middles of its edges to its centre, get the largest m of its edges. Inside a part both
 * directions get the larger of the factors of their two edges; but with one factor for the whole mesh, just that factor.
 *
 * With equal or fractional_even a uniform f that is a power of two, 4 or more, thus gives quads f along every edge and children f / 2. */
#include "host/frame/factors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FACTORS = 6 };

typedef struct factor_work {
    const qp_surface *surface;
    const qp_tessellation *tess;
    uint8_t *by_ngon;   /* [n_edges] an n-gon with a surface touches this edge */
    uint8_t *quartered; /* [n_faces] */
} factor_work;

static bool is_quad(const qp_mesh *mesh, uint32_t face) {
    return qp_face_size(mesh, face) == 4;
}
static bool has_surface(const qp_surface *surface, uint32_t face) {
    return surface->patch_plan[surface->mesh->patch_offsets[face]] != QP_NONE;
}

static float edge_factor(const factor_work *w, uint32_t edge) {
    return w->tess->edge_factors != NULL ? w->tess->edge_factors[edge] : w->tess->factor;
}

/* Segments of half an edge, see above. */
static float half_factor(const factor_work *w, uint32_t edge) {
    const float f = edge_factor(w, edge);
    if (w->tess->spacing == QP_FRACTIONAL_ODD) return f > 2 ? f / 2 : 1;
    float m = w->tess->spacing == QP_FRACTIONAL_EVEN ? 2 : 1;
    while (m < f / 2) m *= 2;
    return m;
}

/* ---- Which quads are quartered ---- */

static uint32_t find_root(uint32_t *parent, uint32_t face) {
    while (parent[face] != face) face = parent[face] = parent[parent[face]];
    return face;
}

/* Quads that share an edge form groups (union-find); a group is quartered when an n-gon touches any of its edges. */
static qp_status mark_quarters(factor_work *w, qp_error *err) {
    const qp_mesh *mesh = w->surface->mesh;
    uint32_t *parent = qp_alloc(mesh->n_faces, sizeof *parent, false);
    uint32_t *first = qp_alloc(mesh->n_edges, sizeof *first, false);
    qp_status status = QP_OK;
    if (parent == NULL || first == NULL) {
        status = qp_fail_memory(err, mesh->n_faces * sizeof *parent, "tessellation factors");
    } else {
        for (uint32_t f = 0; f < mesh->n_faces; ++f) parent[f] = f;
        for (uint32_t e = 0; e < mesh->n_edges; ++e) first[e] = QP_NONE;
        for (uint32_t h = 0; h < mesh->n_corners; ++h) {
            const uint32_t face = mesh->corner_face[h], edge = mesh->corner_edge[h];
            if (!is_quad(mesh, face) || !has_surface(w->surface, face)) continue;
            if (first[edge] == QP_NONE) first[edge] = face;
            parent[find_root(parent, face)] = find_root(parent, first[edge]);
        }
        for (uint32_t e = 0; e < mesh->n_edges; ++e)
            if (w->by_ngon[e] && first[e] != QP_NONE) w->quartered[find_root(parent, first[e])] = 1;
        for (uint32_t f = 0; f < mesh->n_faces; ++f)
            w->quartered[f] = is_quad(mesh, f) && w->quartered[find_root(parent, f)];
    }
    free(parent);
    free(first);
    return status;
}

/* ---- Factors of one patch ---- */

static float larger(float a, float b) {
    return a > b ? a : b;
}
static void set_inner(float f[FACTORS]) {
    f[4] = larger(f[1], f[3]);
    f[5] = larger(f[0], f[2]);
}

/* Edge i of a patch runs from its corner i to the next one: v=0, u=1, v=1, u=0. Where GL's outer factors have it: */
static const uint8_t outer_of_edge[4] = {1, 2, 3, 0};

static void quad_factors(const factor_work *w, uint32_t face, float f[FACTORS]) {
    const qp_mesh *mesh = w->surface->mesh;
    for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t edge = mesh->corner_edge[mesh->face_offsets[face] + i];
        f[outer_of_edge[i]] = w->by_ngon[edge] ? 2 * half_factor(w, edge) : edge_factor(w, edge);
    }
    set_inner(f);
    if (w->tess->edge_factors == NULL) f[4] = f[5] = w->tess->factor;
}

static void quarter_factors(const factor_work *w, uint32_t face, float f[4 * FACTORS]) {
    const qp_mesh *mesh = w->surface->mesh;
    float side[4], middle = 0;
    for (uint32_t i = 0; i < 4; ++i) {
        side[i] = half_factor(w, mesh->corner_edge[mesh->face_offsets[face] + i]);
        middle = larger(middle, side[i]);
    }
    for (uint32_t q = 0; q < 4; ++q, f += FACTORS) {
        const bool right = (q & 1u) != 0, upper = (q & 2u) != 0;
        f[0] = right ? middle : side[3];
        f[1] = upper ? middle : side[0];
        f[2] = right ? side[1] : middle;
        f[3] = upper ? side[2] : middle;
        set_inner(f);
    }
}

/* Of all children of an n-gon, one after the other. */
static void child_factors(const factor_work *w, uint32_t face, float *f) {
    const qp_mesh *mesh = w->surface->mesh;
    const uint32_t first = mesh->face_offsets[face], size = qp_face_size(mesh, face);
    float spoke = 0;
    for (uint32_t i = 0; i < size; ++i) spoke = larger(spoke, half_factor(w, mesh->corner_edge[first + i]));
    for (uint32_t i = 0; i < size; ++i, f += FACTORS) {
        f[0] = half_factor(w, mesh->corner_edge[first + (i + size - 1) % size]);
        f[1] = half_factor(w, mesh->corner_edge[first + i]);
        f[2] = f[3] = spoke;
        set_inner(f);
    }
}

/* ---- All patches ---- */

/* Written so that NaN discards. */
static bool is_kept(const float *f) {
    return f[0] > 0 && f[1] > 0 && f[2] > 0 && f[3] > 0;
}

static qp_status alloc_parts(qp_part_factors *factors, uint32_t n_patches, qp_error *err) {
    uint64_t parts = 0;
    for (uint32_t p = 0; p <= n_patches; ++p) {
        const uint64_t own = p < n_patches ? factors->first[p] : 0;
        factors->first[p] = parts;
        parts += own;
    }
    if (parts > SIZE_MAX / (FACTORS * sizeof(float)))
        return qp_fail_memory(err, SIZE_MAX, "tessellation factors");
    factors->values = qp_alloc((size_t)parts, FACTORS * sizeof(float), false);
    if (factors->values == NULL)
        return qp_fail_memory(err, (size_t)parts * FACTORS * sizeof(float), "tessellation factors");
    return QP_OK;
}

static qp_status from_patches(const qp_surface *surface, const float *given, qp_part_factors *factors,
                              qp_error *err) {
    const uint32_t n = surface->mesh->n_patches;
    for (uint32_t p = 0; p < n; ++p)
        factors->first[p] = surface->patch_plan[p] != QP_NONE && is_kept(given + FACTORS * (size_t)p);
    qp_status status = alloc_parts(factors, n, err);
    for (uint32_t p = 0; p < n && status == QP_OK; ++p) {
        float *f = factors->values + FACTORS * factors->first[p];
        if (factors->first[p + 1] == factors->first[p]) continue;
        memcpy(f, given + FACTORS * (size_t)p, FACTORS * sizeof *f);
        for (int i = 4; i < FACTORS; ++i)
            if (!(f[i] >= 1))
                f[i] = 1; /* as the tessellator clamps; a NaN would equal nothing, not even itself */
    }
    return status;
}

static qp_status from_edges(factor_work *w, qp_part_factors *factors, qp_error *err) {
    const qp_mesh *mesh = w->surface->mesh;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        const uint32_t face = mesh->corner_face[h];
        if (!is_quad(mesh, face) && has_surface(w->surface, face)) w->by_ngon[mesh->corner_edge[h]] = 1;
    }
    qp_status status = w->tess->spacing == QP_FRACTIONAL_ODD ? mark_quarters(w, err) : QP_OK;
    if (status != QP_OK) return status;
    for (uint32_t face = 0; face < mesh->n_faces; ++face) {
        for (uint32_t p = mesh->patch_offsets[face]; p < mesh->patch_offsets[face + 1]; ++p)
            factors->first[p] = !has_surface(w->surface, face) ? 0 : w->quartered[face] ? 4 : 1;
    }
    status = alloc_parts(factors, mesh->n_patches, err);
    for (uint32_t face = 0; face < mesh->n_faces && status == QP_OK; ++face) {
        float *f = factors->values + FACTORS * factors->first[mesh->patch_offsets[face]];
        if (!has_surface(w->surface, face)) continue;
        if (!is_quad(mesh, face))
            child_factors(w, face, f);
        else if (w->quartered[face])
            quarter_factors(w, face, f);
        else
            quad_factors(w, face, f);
    }
    return status;
}

static qp_status check_tessellation(const qp_mesh *mesh, const qp_tessellation *tess, qp_error *err) {
    if (tess->spacing != QP_EQUAL && tess->spacing != QP_FRACTIONAL_EVEN &&
        tess->spacing != QP_FRACTIONAL_ODD)
        return qp_fail(err, QP_BAD_INPUT, "unknown spacing %d", (int)tess->spacing);
    if (tess->patch_factors != NULL) return QP_OK;
    if (tess->edge_factors == NULL && !(tess->factor >= 1 && tess->factor <= 64))
        return qp_fail(err, QP_BAD_INPUT, "tessellation factor %g is not between 1 and 64",
                       (double)tess->factor);
    for (uint32_t e = 0; tess->edge_factors != NULL && e < mesh->n_edges; ++e) {
        if (!(tess->edge_factors[e] >= 1 && tess->edge_factors[e] <= 64))
            return qp_fail(err, QP_BAD_INPUT, "tessellation factor %g of edge %u is not between 1 and 64",
                           (double)tess->edge_factors[e], e);
    }
    return QP_OK;
}

qp_status qp_factors_make(const qp_surface *surface, const qp_tessellation *tess, qp_part_factors *factors,
                          qp_error *err) {
    const qp_mesh *mesh = surface->mesh;
    *factors = (qp_part_factors){0};
    qp_status status = check_tessellation(mesh, tess, err);
    if (status != QP_OK) return status;
    factor_work w = {.surface = surface, .tess = tess};
    w.by_ngon = qp_alloc(mesh->n_edges, 1, true);
    w.quartered = qp_alloc(mesh->n_faces, 1, true);
    factors->first = qp_alloc((size_t)mesh->n_patches + 1, sizeof *factors->first, true);
    if (w.by_ngon == NULL || w.quartered == NULL || factors->first == NULL)
        status =
            qp_fail_memory(err, (size_t)mesh->n_patches * sizeof *factors->first, "tessellation factors");
    else if (tess->patch_factors != NULL)
        status = from_patches(surface, tess->patch_factors, factors, err);
    else
        status = from_edges(&w, factors, err);
    free(w.by_ngon);
    free(w.quartered);
    if (status != QP_OK) qp_factors_free(factors);
    return status;
}

void qp_factors_free(qp_part_factors *factors) {
    free(factors->first);
    free(factors->values);
    *factors = (qp_part_factors){0};
}
