/* Plans of full depth: what a device gets of them are ordinary floats, their rings end in the corner's eigenvalue, and surfaces of some
 * patches hold the plans of all. */
#include "host/plan/plan.h"
#include "tests/check.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

static qp_mesh *generate(const char *kind, uint32_t n, uint64_t seed) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_generate_options options = {.n = {n, 0, 0}, .sharpness = -1.0, .seed = seed, .faces = 40};
    CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err);
    return mesh;
}

static qp_surface *build(const qp_mesh *mesh, uint32_t depth, const uint8_t *mask) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    qp_surface_options options = {.depth = depth};
    CHECK_OK(qp_surface_create_for(mesh, &options, mask, &surface, &err), err);
    return surface;
}

/* Neither denormal numbers, which some devices flush, nor infinities. */
static void check_floats(const qp_surface *surface) {
    qp_plan_pack pack;
    qp_error err = {0};
    if (!CHECK_OK(qp_surface_pack(&surface, 1, QP_FLOAT, &pack, &err), err)) return;
    size_t bad = 0;
    for (size_t i = 0; i < pack.real_count; ++i) {
        const float x = fabsf(((const float *)pack.reals)[i]);
        bad += !(x == 0 || (x >= FLT_MIN && x <= FLT_MAX));
    }
    CHECK(bad == 0);
    free(pack.heads);
    free(pack.tree);
    free(pack.reals);
}

/* lambda of a smooth vertex of valence n, Halstead, Kass, DeRose 1993. */
static double dominant(uint32_t n) {
    const double c = cos(2 * 3.14159265358979323846 / n);
    return n == 2 ? 0.25 : (5 + c + sqrt((c + 9) * (c + 1))) / 16;
}

/* Finds the extraordinary leaf behind the plan's first terminal node, if its root is one. */
static const uint32_t *end_of(const qp_plan *plan) {
    if (QP_NODE_KIND(plan->tree[0]) != QP_NODE_TERMINAL) return NULL;
    const uint32_t *end = plan->tree + plan->tree[2];
    return QP_NODE_KIND(end[0]) == QP_NODE_EXTRAORDINARY ? end : NULL;
}

static void check_ratio(uint32_t valence) {
    qp_mesh *mesh = generate("fan", valence, 0);
    const uint32_t depths[] = {20, QP_DEPTH_LIMIT};
    for (int d = 0; d < 2 && mesh != NULL; ++d) {
        qp_surface *surface = build(mesh, depths[d], NULL);
        unsigned found = 0;
        for (uint32_t p = 0; surface != NULL && p < surface->n_plans; ++p) {
            const qp_plan *plan = surface->plans[p];
            const uint32_t *end = end_of(plan);
            CHECK((plan->flags & QP_PLAN_IRREGULAR) == 0);
            if (end == NULL) continue;
            const double ratio = plan->constants[end[4] - qp_plan_first_constant(plan)];
            CHECK(((end[0] & QP_NODE_EXACT) != 0) == (depths[d] == QP_DEPTH_LIMIT));
            /* The fan's outer vertices have other valences. */
            if (fabs(ratio - dominant(valence)) < (depths[d] == QP_DEPTH_LIMIT ? 1e-7 : 1e-2)) ++found;
        }
        CHECK(found > 0);
        if (surface != NULL) check_floats(surface);
        qp_surface_free(surface);
    }
    qp_mesh_free(mesh);
}

/* Only offsets are scaled, and what they become stays in bounds (for the lower ones see check_floats). */
static void check_scales(const qp_surface *surface) {
    for (uint32_t p = 0; p < surface->n_plans; ++p) {
        const qp_plan *plan = surface->plans[p];
        for (uint32_t i = 0; i < plan->point_count; ++i) {
            if (plan->point_origins[i] == QP_NO_POINT) {
                CHECK(plan->point_scales[i] == 0);
                continue;
            }
            double largest = 0;
            for (uint32_t j = 0; j < plan->ring_size; ++j)
                largest = fmax(largest, fabs(plan->weights[(size_t)i * plan->ring_size + j]));
            largest = ldexp(largest, plan->point_scales[i]);
            CHECK(largest < 1e9); /* high valences shrink by 1.5 a level */
        }
    }
}

/* A surface of some patches: the same plans, bit for bit, as the whole one has for them. */
static void check_mask(const qp_mesh *mesh, uint64_t seed) {
    uint8_t *mask = qp_alloc(mesh->n_patches, 1, true);
    for (uint32_t p = 0; mask != NULL && p < mesh->n_patches; ++p) mask[p] = (p * 7 + seed) % 3 == 0;
    qp_surface *all = build(mesh, 24, NULL), *some = build(mesh, 24, mask);
    for (uint32_t p = 0; CHECK(all != NULL && some != NULL && mask != NULL) && p < mesh->n_patches; ++p) {
        CHECK((some->patch_plan[p] != QP_NONE) == (mask[p] && all->patch_plan[p] != QP_NONE));
        if (some->patch_plan[p] == QP_NONE) continue;
        const qp_plan *a = all->plans[all->patch_plan[p]], *b = some->plans[some->patch_plan[p]];
        CHECK(all->patch_rotation[p] == some->patch_rotation[p]);
        if (!CHECK(a->point_count == b->point_count && a->ring_size == b->ring_size)) continue;
        CHECK(memcmp(a->weights, b->weights, sizeof(double) * a->point_count * a->ring_size) == 0);
        CHECK(memcmp(all->rings + all->patch_ring[p], some->rings + some->patch_ring[p],
                     sizeof(uint32_t) * a->ring_size) == 0);
    }
    qp_surface_free(all);
    qp_surface_free(some);
    free(mask);
}

int main(void) {
    for (uint32_t valence = 3; valence <= 9; ++valence) {
        if (valence != 4) check_ratio(valence);
    }
    for (uint64_t seed = 0; seed < (CHECK_SANITIZED ? 4 : 16); ++seed) {
        qp_mesh *mesh = generate(seed % 2 ? "random-open" : "random-closed", 0, seed);
        qp_surface *surface = mesh == NULL ? NULL : build(mesh, QP_DEPTH_LIMIT, NULL);
        if (CHECK(surface != NULL)) {
            check_floats(surface);
            check_scales(surface);
            check_mask(mesh, seed);
        }
        qp_surface_free(surface);
        qp_mesh_free(mesh);
    }
    return check_report();
}
