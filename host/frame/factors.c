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

typedef struct qp_factors {
    const qp_surface *surface;
    qp_tessellation tess;
    uint8_t *by_ngon;    /* [n_edges] an n-gon with a surface touches this edge; NULL with factors of patches */
    uint8_t *quartered;  /* [n_faces], likewise */
    uint32_t spoke_face; /* n-gon whose spokes have the factor below, or QP_NONE */
    float spoke;
} factor_work;

static bool is_quad(const qp_mesh *mesh, uint32_t face) {
    return qp_face_size(mesh, face) == 4;
}
static bool has_surface(const qp_surface *surface, uint32_t face) {
    return surface->patch_plan[surface->mesh->patch_offsets[face]] != QP_NONE;
}

static float edge_factor(const factor_work *w, uint32_t edge) {
    return w->tess.edge_factors != NULL ? w->tess.edge_factors[edge] : w->tess.factor;
}

/* Segments of half an edge, see above. */
static float half_factor(const factor_work *w, uint32_t edge) {
    const float f = edge_factor(w, edge);
    if (w->tess.spacing == QP_FRACTIONAL_ODD) return f > 2 ? f / 2 : 1;
    float m = w->tess.spacing == QP_FRACTIONAL_EVEN ? 2 : 1;
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
    if (w->tess.edge_factors == NULL) f[4] = f[5] = w->tess.factor;
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

static float spoke_factor(factor_work *w, uint32_t face) {
    const qp_mesh *mesh = w->surface->mesh;
    const uint32_t first = mesh->face_offsets[face], size = qp_face_size(mesh, face);
    if (face == w->spoke_face) return w->spoke;
    w->spoke_face = face;
    w->spoke = 0;
    for (uint32_t i = 0; i < size; ++i)
        w->spoke = larger(w->spoke, half_factor(w, mesh->corner_edge[first + i]));
    return w->spoke;
}

static void child_factors(factor_work *w, uint32_t face, uint32_t child, float f[FACTORS]) {
    const qp_mesh *mesh = w->surface->mesh;
    const uint32_t first = mesh->face_offsets[face], size = qp_face_size(mesh, face);
    f[0] = half_factor(w, mesh->corner_edge[first + (child + size - 1) % size]);
    f[1] = half_factor(w, mesh->corner_edge[first + child]);
    f[2] = f[3] = spoke_factor(w, face);
    set_inner(f);
}

/* Written so that NaN discards. */
static bool is_kept(const float *f) {
    return f[0] > 0 && f[1] > 0 && f[2] > 0 && f[3] > 0;
}

uint32_t qp_factors_of(qp_factors *w, uint32_t patch, float values[QP_FACTORS_MOST]) {
    if (w->surface->patch_plan[patch] == QP_NONE) return 0;
    if (w->tess.patch_factors != NULL) {
        const float *given = w->tess.patch_factors + FACTORS * (size_t)patch;
        if (!is_kept(given)) return 0;
        memcpy(values, given, FACTORS * sizeof *values);
        for (int i = 4; i < FACTORS; ++i)
            if (!(values[i] >= 1))
                values[i] = 1; /* as the tessellator clamps; a NaN would equal nothing, not even itself */
        return 1;
    }
    uint32_t child;
    const uint32_t face = qp_patch_face(w->surface->mesh, patch, &child);
    if (!is_quad(w->surface->mesh, face)) {
        child_factors(w, face, child, values);
    } else if (w->quartered[face]) {
        quarter_factors(w, face, values);
        return 4;
    } else {
        quad_factors(w, face, values);
    }
    return 1;
}

/* What factors of edges depend on. */
static qp_status mark_edges(factor_work *w, qp_error *err) {
    const qp_mesh *mesh = w->surface->mesh;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        const uint32_t face = mesh->corner_face[h];
        if (!is_quad(mesh, face) && has_surface(w->surface, face)) w->by_ngon[mesh->corner_edge[h]] = 1;
    }
    return w->tess.spacing == QP_FRACTIONAL_ODD ? mark_quarters(w, err) : QP_OK;
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

qp_status qp_factors_open(const qp_surface *surface, const qp_tessellation *tess, qp_factors **factors,
                          qp_error *err) {
    const qp_mesh *mesh = surface->mesh;
    *factors = NULL;
    qp_status status = check_tessellation(mesh, tess, err);
    if (status != QP_OK) return status;
    factor_work *w = qp_alloc(1, sizeof *w, true);
    if (w == NULL) return qp_fail_memory(err, sizeof *w, "tessellation factors");
    *w = (factor_work){.surface = surface, .tess = *tess, .spoke_face = QP_NONE};
    if (tess->patch_factors == NULL) {
        w->by_ngon = qp_alloc(mesh->n_edges, 1, true);
        w->quartered = qp_alloc(mesh->n_faces, 1, true);
        if (w->by_ngon == NULL || w->quartered == NULL)
            status = qp_fail_memory(err, (size_t)mesh->n_edges + mesh->n_faces, "tessellation factors");
        else
            status = mark_edges(w, err);
    }
    if (status == QP_OK)
        *factors = w;
    else
        qp_factors_close(w);
    return status;
}

void qp_factors_close(qp_factors *factors) {
    if (factors == NULL) return;
    free(factors->by_ngon);
    free(factors->quartered);
    free(factors);
}

static qp_status make_all(qp_factors *w, qp_part_factors *factors, qp_error *err) {
    const uint32_t n = w->surface->mesh->n_patches;
    float values[QP_FACTORS_MOST];
    uint64_t parts = 0;
    for (uint32_t p = 0; p < n; ++p) {
        factors->first[p] = parts;
        parts += qp_factors_of(w, p, values);
    }
    factors->first[n] = parts;
    if (parts > SIZE_MAX / (FACTORS * sizeof(float)))
        return qp_fail_memory(err, SIZE_MAX, "tessellation factors");
    factors->values = qp_alloc((size_t)parts, FACTORS * sizeof(float), false);
    if (factors->values == NULL)
        return qp_fail_memory(err, (size_t)parts * FACTORS * sizeof(float), "tessellation factors");
    for (uint32_t p = 0; p < n; ++p) {
        const uint32_t own = qp_factors_of(w, p, values);
        memcpy(factors->values + FACTORS * factors->first[p], values, own * FACTORS * sizeof *values);
    }
    return QP_OK;
}

qp_status qp_factors_make(const qp_surface *surface, const qp_tessellation *tess, qp_part_factors *factors,
                          qp_error *err) {
    const size_t count = (size_t)surface->mesh->n_patches + 1;
    qp_factors *w;
    *factors = (qp_part_factors){0};
    qp_status status = qp_factors_open(surface, tess, &w, err);
    if (status != QP_OK) return status;
    factors->first = qp_alloc(count, sizeof *factors->first, false);
    if (factors->first == NULL)
        status = qp_fail_memory(err, count * sizeof *factors->first, "tessellation factors");
    else
        status = make_all(w, factors, err);
    qp_factors_close(w);
    if (status != QP_OK) qp_factors_free(factors);
    return status;
}

void qp_factors_free(qp_part_factors *factors) {
    free(factors->first);
    free(factors->values);
    *factors = (qp_part_factors){0};
}
