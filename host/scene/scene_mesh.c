/* From a scene to its mesh and tessellation factors. */
#include "host/scene/scene.h"

#include <math.h>
#include <stdlib.h>

qp_status qp_scene_mesh(const qp_scene *scene, void (*warn)(void *context, const char *line),
                        void *warn_context, qp_mesh **mesh, qp_error *err) {
    *mesh = NULL;
    qp_mesh_options options = scene->mesh_options;
    options.warn = warn;
    options.warn_context = warn_context;
    if (scene->mesh_path != NULL) return qp_mesh_read_obj(scene->mesh_path, &options, mesh, err);
    qp_status status = qp_mesh_generate(scene->generate_kind, &scene->generate, mesh, err);
    /* A generated mesh knows nothing of the scene's rules. */
    if (status == QP_OK) status = qp_mesh_apply_options(mesh, &options, err);
    if (status != QP_OK) {
        qp_mesh_free(*mesh);
        *mesh = NULL;
    }
    return status;
}

/* ---- Factors ----
 *
 * Every edge and every inside has a wish W: the uniform factor, or a random integer. Children of n-gons see
 * half edges, whose factor is H, about W / 2; a quad beside an n-gon takes 2 H on that edge, so that both
 * sides have the same points (under equal spacing; under fractional_even H must be even for that). */

typedef struct wishes {
    const qp_scene *scene;
    const qp_mesh *mesh;
} wishes;

static double wish(const wishes *w, uint64_t kind, uint64_t index) {
    const qp_scene *s = w->scene;
    if (!s->random_factors) return s->factor;
    const uint64_t words[2] = {kind, index};
    uint64_t span = (uint64_t)s->factor_max - s->factor_min + 1;
    return (double)(s->factor_min + qp_hash(words, sizeof words, s->factor_seed) % span);
}

static double half_of(const wishes *w, double whole) {
    double half = fmax(1, whole / 2);
    if (w->scene->spacing == QP_EQUAL) return ceil(half);
    if (w->scene->spacing == QP_FRACTIONAL_EVEN) return 2 * ceil(half / 2);
    return half;
}

enum { OF_EDGE, OF_SPOKE, OF_INSIDE_U, OF_INSIDE_V };

static double half_edge_factor(const wishes *w, uint32_t edge) {
    return half_of(w, wish(w, OF_EDGE, edge));
}

/* Of an edge as its quads see it. */
static double whole_edge_factor(const wishes *w, uint32_t edge, const bool *beside_ngon) {
    return beside_ngon[edge] ? 2 * half_edge_factor(w, edge) : wish(w, OF_EDGE, edge);
}

static void quad_factors(const wishes *w, uint32_t face, const bool *beside_ngon, float *out) {
    const qp_mesh *m = w->mesh;
    /* Edges 0..3 of the face lie at v=0, u=1, v=1, u=0; GL's levels are for u=0, v=0, u=1, v=1. */
    for (uint32_t k = 0; k < 4; k++)
        out[(k + 1) % 4] =
            (float)whole_edge_factor(w, m->corner_edge[m->face_offsets[face] + k], beside_ngon);
    uint32_t patch = m->patch_offsets[face];
    out[4] = (float)wish(w, OF_INSIDE_U, patch);
    out[5] = (float)wish(w, OF_INSIDE_V, patch);
}

/* Child k: from its corner u runs along half the edge after it, v along half the edge before it; the other two
 * sides are spokes from the middles of these edges to the middle of the face. */
static void ngon_factors(const wishes *w, uint32_t face, float *out) {
    const qp_mesh *m = w->mesh;
    uint32_t first = m->face_offsets[face], n = qp_face_size(m, face);
    for (uint32_t k = 0; k < n; k++, out += 6) {
        uint32_t after = first + k, before = first + (k + n - 1) % n, patch = m->patch_offsets[face] + k;
        out[0] = (float)half_edge_factor(w, m->corner_edge[before]);
        out[1] = (float)half_edge_factor(w, m->corner_edge[after]);
        out[2] = (float)half_of(w, wish(w, OF_SPOKE, after));
        out[3] = (float)half_of(w, wish(w, OF_SPOKE, before));
        out[4] = (float)half_of(w, wish(w, OF_INSIDE_U, patch));
        out[5] = (float)half_of(w, wish(w, OF_INSIDE_V, patch));
    }
}

qp_status qp_scene_tessellation(const qp_scene *scene, const qp_mesh *mesh, qp_tessellation *tessellation,
                                float **factors, qp_error *err) {
    *factors = NULL;
    *tessellation = (qp_tessellation){.spacing = scene->spacing, .factor = (float)scene->factor};
    tessellation->tolerance = scene->tolerance;
    if (scene->tolerance != 0) return QP_OK;
    bool ngons = mesh->n_patches != mesh->n_faces;
    if (!scene->random_factors && !(ngons && scene->halve_ngons)) return QP_OK;
    bool *beside_ngon = qp_alloc(mesh->n_edges, sizeof *beside_ngon, true);
    float *all = qp_alloc(mesh->n_patches, 6 * sizeof *all, false);
    if (beside_ngon == NULL || all == NULL) {
        free(beside_ngon);
        free(all);
        return qp_fail_memory(err, mesh->n_patches * 6 * sizeof *all + mesh->n_edges, "factors");
    }
    for (uint32_t c = 0; c < mesh->n_corners; c++)
        if (qp_face_size(mesh, mesh->corner_face[c]) != 4) beside_ngon[mesh->corner_edge[c]] = true;
    const wishes w = {scene, mesh};
    for (uint32_t f = 0; f < mesh->n_faces; f++) {
        float *out = all + 6 * (size_t)mesh->patch_offsets[f];
        if (qp_face_size(mesh, f) == 4)
            quad_factors(&w, f, beside_ngon, out);
        else
            ngon_factors(&w, f, out);
    }
    free(beside_ngon);
    tessellation->patch_factors = all;
    *factors = all;
    return QP_OK;
}
