/* What a surface is made of, in the paper's terms (tables 1 and 2, section 9). */
#include "host/plan/build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- distinct points of a mesh ----
 * Two control points of different patches are one point of the refined mesh when their stencils, written over the vertices of the
 * mesh, are equal. Instead of comparing stencils, they are applied to random positions in general position: equal stencils
 * give the same value up to rounding (1e-15), different ones differ by far more with probability 1. A tangent pair is
 * known by its limit point and its plane, since every face around a smooth vertex has its own pair of the same plane. */

typedef struct signature {
    uint8_t kind, need;
    double a, b;
} signature;

static double random_coordinate(uint32_t vertex, uint32_t axis) {
    uint64_t words[2] = {vertex, axis};
    return (double)(qp_hash(words, sizeof words, 0x51a9) >> 11) * 0x1p-53;
}

/* Applies row i of a plan to the random positions of a ring, made absolute. */
static void apply_row(const qp_plan *plan, const double *positions, uint32_t i, double out[3]) {
    const double *row = plan->weights + (size_t)i * plan->ring_size;
    out[0] = out[1] = out[2] = 0.0;
    for (uint32_t j = 0; j < plan->ring_size; ++j) {
        for (int k = 0; k < 3; ++k) out[k] += row[j] * positions[3 * (size_t)j + k];
    }
    if (plan->point_origins[i] == QP_NO_POINT) return;
    double origin[3];
    apply_row(plan, positions, plan->point_origins[i], origin);
    for (int k = 0; k < 3; ++k) out[k] += origin[k];
}

static uint8_t row_need(const qp_plan *plan, uint32_t i) {
    uint8_t n = 0;
    while (plan->rows[n] <= i) ++n;
    return n;
}

/* Signatures of a patch's points, one each. Tangents come in pairs behind their limit point in the order of the rows. */
static void patch_signatures(const qp_plan *plan, const double *positions, signature *out) {
    double limit = 0.0, first[3] = {0};
    bool second = false;
    for (uint32_t i = 0; i < plan->point_count; ++i) {
        double p[3];
        apply_row(plan, positions, i, p);
        out[i] = (signature){.kind = plan->point_kinds[i], .need = row_need(plan, i), .a = p[0], .b = p[1]};
        uint32_t kind = plan->point_kinds[i] & 3u;
        if (kind == QP_POINT_LIMIT) {
            limit = p[0];
            second = false;
        } else if (kind == QP_POINT_TANGENT && !second) {
            memcpy(first, p, sizeof first);
            second = true;
        } else if (kind == QP_POINT_TANGENT) {
            double n[3] = {first[1] * p[2] - first[2] * p[1], first[2] * p[0] - first[0] * p[2],
                           first[0] * p[1] - first[1] * p[0]};
            double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            /* Both tangents of the pair share limit and plane; adding 4 and 8 keeps the two apart. */
            out[i].a = limit + 8.0;
            out[i - 1].a = limit + 4.0;
            out[i].b = out[i - 1].b = length > 0.0 ? n[0] / length : 0.0;
            second = false;
        }
        /* Depth is no part of a limit point's identity. */
        if (kind != QP_POINT_REFINED) out[i].kind = (uint8_t)kind;
    }
}

static int compare_signatures(const void *x, const void *y) {
    const signature *a = x, *b = y;
    if (a->kind != b->kind) return a->kind < b->kind ? -1 : 1;
    return a->a < b->a ? -1 : a->a > b->a;
}

/* Counts distinct signatures per level. Equal ones lie within 1e-11 of each other in both coordinates; a run of near `a` is short,
 * so its members are compared pairwise. */
static void count_distinct(signature *all, size_t count, uint64_t unique[QP_INFO_LEVELS]) {
    qsort(all, count, sizeof *all, compare_signatures);
    for (size_t i = 0; i < count; ++i) {
        bool known = false;
        for (size_t j = i; j-- > 0 && !known;) {
            if (all[j].kind != all[i].kind || all[i].a - all[j].a > 1e-11) break;
            if (all[j].need == 255 || fabs(all[i].b - all[j].b) > 1e-9) continue;
            known = true;
            /* The earlier one stands for both. */
            if (all[i].need < all[j].need) {
                for (uint32_t n = all[i].need; n < all[j].need && n < QP_INFO_LEVELS; ++n) ++unique[n];
                all[j].need = all[i].need;
            }
            all[i].need = 255;
        }
        for (uint32_t n = all[i].need; n < QP_INFO_LEVELS && !known; ++n) ++unique[n];
    }
}

static bool unique_points(const qp_surface *s, uint64_t total, uint32_t widest,
                          uint64_t unique[QP_INFO_LEVELS]) {
    signature *all = qp_alloc(total, sizeof *all, false);
    double *positions = qp_alloc(3 * (size_t)widest, sizeof *positions, false);
    if (all == NULL || positions == NULL) {
        free(all);
        free(positions);
        return false;
    }
    size_t count = 0;
    for (uint32_t p = 0; p < s->mesh->n_patches; ++p) {
        uint32_t index = s->patch_plan[p];
        if (index == QP_NONE || index == s->regular_plan) continue;
        const qp_plan *plan = s->plans[index];
        for (uint32_t j = 0; j < plan->ring_size; ++j) {
            uint32_t vertex = s->rings[s->patch_ring[p] + j];
            for (uint32_t k = 0; k < 3; ++k) positions[3 * (size_t)j + k] = random_coordinate(vertex, k);
        }
        patch_signatures(plan, positions, all + count);
        count += plan->point_count;
    }
    count_distinct(all, count, unique);
    free(all);
    free(positions);
    return true;
}

static void count_faces(const qp_mesh *mesh, qp_surface_info *info) {
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        if (mesh->face_flags[f] & QP_FACE_HOLE) continue;
        if (qp_face_is_regular(mesh, f)) {
            ++info->regular_faces;
        } else {
            ++info->irregular_faces;
        }
    }
}

qp_status qp_surface_get_info(const qp_surface *s, qp_surface_info *info, qp_error *err) {
    *info = (qp_surface_info){.vertices = s->mesh->n_vertices,
                              .faces = s->mesh->n_faces,
                              .patches = s->mesh->n_patches,
                              .plans = s->n_plans,
                              .build_ms = s->build_ms};
    count_faces(s->mesh, info);
    for (uint32_t i = 0; i < s->n_plans; ++i) {
        const qp_plan *plan = s->plans[i];
        info->nodes += plan->node_count;
        info->stencils += plan->point_count;
        info->quadtree_bytes += sizeof(uint32_t) * (uint64_t)plan->tree_words;
        info->stencil_bytes += sizeof(float) * (uint64_t)plan->point_count * plan->ring_size;
    }
    uint64_t total = 0;
    uint32_t widest = 0;
    for (uint32_t p = 0; p < s->mesh->n_patches; ++p) {
        uint32_t index = s->patch_plan[p];
        if (index == QP_NONE || index == s->regular_plan) continue;
        const qp_plan *plan = s->plans[index];
        ++info->irregular_patches;
        total += plan->point_count;
        if (plan->ring_size > widest) widest = plan->ring_size;
        for (uint32_t n = 0; n < QP_INFO_LEVELS; ++n)
            info->control_points[n] += (plan->rows[n] + 3u) / 4u * 4u;
    }
    info->scratch_bytes = 16 * info->control_points[QP_INFO_LEVELS - 1];
    if (!unique_points(s, total, widest, info->unique_control_points)) {
        return qp_fail_memory(err, total * sizeof(signature), "the points of all patches");
    }
    return QP_OK;
}
