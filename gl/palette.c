#include "gl/palette.h"
#include "host/frame/classify.h"
#include "host/frame/frame.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* By QP_NODE_*; internal nodes evaluate nothing. */
static const float kind_colours[8][3] = {
    [QP_NODE_INTERNAL] = {0.5f, 0.5f, 0.5f},         [QP_NODE_REGULAR] = {0.20f, 0.45f, 0.80f},
    [QP_NODE_CREASE] = {0.95f, 0.60f, 0.08f},        [QP_NODE_TERMINAL] = {0.80f, 0.12f, 0.07f},
    [QP_NODE_EXTRAORDINARY] = {0.40f, 0.06f, 0.50f}, [QP_NODE_IRREGULAR] = {0.05f, 0.35f, 0.12f},
};

static void of_hue(double hue, double saturation, double value, float colour[3]) {
    for (int k = 0; k < 3; k++) {
        double x = fmod(hue * 6 + (5 - 2 * k), 6);
        double rise = fmin(fmax(fmin(x, 4 - x), 0), 1); /* the channel drops out around its opposite hue */
        colour[k] = (float)(value * (1 - saturation * rise));
    }
}

/* Neighbouring numbers get hues far apart. */
static void of_index(uint32_t index, float colour[3]) {
    uint64_t h = qp_hash(&index, sizeof index, 7);
    double turn = index * 0.6180339887498949;
    of_hue(turn - floor(turn), 0.45 + 0.3 * (double)(h & 255) / 255,
           0.55 + 0.35 * (double)(h >> 8 & 255) / 255, colour);
}

/* Blue at level 0 to red at level 6, then on to white. */
static void of_level(uint32_t level, float colour[3]) {
    if (level <= 6) {
        of_hue(0.62 * (1 - level / 6.0), 0.85, 0.85, colour);
    } else {
        for (int k = 0; k < 3; k++) colour[k] = fminf(0.4f + 0.1f * (float)(level - 6), 0.95f);
    }
}

static qp_leaf leaf_of(const qp_surface *surface, const qp_stream *stream, const uint32_t triangle[3],
                       uint32_t patch) {
    /* The middle of a triangle lies in the node that evaluates its inside; its corners may lie between two. */
    float u = 0, v = 0;
    for (int k = 0; k < 3; k++) {
        u += stream->uv[2 * (size_t)triangle[k]] / 3;
        v += stream->uv[2 * (size_t)triangle[k] + 1] / 3;
    }
    double x = qp_signed_coordinate((double)u, QP_FLOAT), y = qp_signed_coordinate((double)v, QP_FLOAT);
    qp_rotate_uv(surface->patch_rotation[patch], &x, &y);
    return qp_classify(surface->plans[surface->patch_plan[patch]], x, y);
}

static uint32_t root_of(uint32_t *parent, uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

qp_status qp_patch_components(const qp_mesh *mesh, uint32_t **component, qp_error *err) {
    uint32_t *parent = qp_alloc(mesh->n_vertices, sizeof *parent, false); /* vertices joined by a face */
    uint32_t *number = qp_alloc(mesh->n_vertices, sizeof *number, false);
    *component = qp_alloc(mesh->n_patches, sizeof **component, false);
    if (parent == NULL || number == NULL || *component == NULL) {
        free(parent);
        free(number);
        free(*component);
        *component = NULL;
        return qp_fail_memory(err, 4 * ((size_t)mesh->n_patches + 2 * (size_t)mesh->n_vertices),
                              "components");
    }
    for (uint32_t v = 0; v < mesh->n_vertices; v++) parent[v] = v, number[v] = QP_NONE;
    for (uint32_t c = 0; c < mesh->n_corners; c++) {
        uint32_t a = root_of(parent, mesh->face_vertices[c]);
        uint32_t b = root_of(parent, mesh->face_vertices[qp_corner_next(mesh, c)]);
        parent[a] = b;
    }
    uint32_t count = 0;
    for (uint32_t f = 0; f < mesh->n_faces; f++) {
        uint32_t root = root_of(parent, mesh->face_vertices[mesh->face_offsets[f]]);
        if (number[root] == QP_NONE) number[root] = count++;
        for (uint32_t p = mesh->patch_offsets[f]; p < mesh->patch_offsets[f + 1]; p++)
            (*component)[p] = number[root];
    }
    free(parent);
    free(number);
    return QP_OK;
}

/* The colour of a whole patch, unless the scene asks for something that changes within it. */
static void patch_colour(const qp_scene *scene, const qp_surface *surface, const uint32_t *component,
                         uint32_t patch, float colour[3]) {
    const bool planned = surface->patch_plan[patch] != QP_NONE;
    for (int k = 0; k < 3; k++) colour[k] = (float)scene->colour[k];
    if (scene->colour_by == QP_COLOUR_COMPONENT) {
        const double *own = scene->palette[component[patch] % scene->palette_count];
        for (int k = 0; k < 3; k++) colour[k] = (float)own[k];
    } else if (scene->colour_by == QP_COLOUR_PATCH) {
        of_index(patch, colour);
    } else if (scene->colour_by == QP_COLOUR_PLAN && planned) {
        if (surface->patch_plan[patch] == surface->regular_plan)
            memcpy(colour, (const float[3]){0.6f, 0.6f, 0.6f}, 3 * sizeof(float));
        else
            of_index(surface->patch_plan[patch], colour);
    }
}

void qp_triangle_colour(const qp_scene *scene, const qp_surface *surface, const uint32_t *component,
                        const qp_stream *stream, const uint32_t triangle[3], float colour[3]) {
    uint32_t patch = stream->sample_patch[triangle[0]];
    bool planned = surface->patch_plan[patch] != QP_NONE;
    patch_colour(scene, surface, component, patch, colour);
    if (scene->colour_by == QP_COLOUR_KIND && planned) {
        qp_leaf leaf = leaf_of(surface, stream, triangle, patch);
        /* Paler with depth, so that nested nodes of one kind tell apart. */
        float pale = 1 - powf(0.82f, (float)leaf.level);
        for (int k = 0; k < 3; k++)
            colour[k] = kind_colours[leaf.kind & 7u][k] * (1 - 0.75f * pale) + 0.6f * pale;
    } else if (scene->colour_by == QP_COLOUR_LEVEL && planned) {
        of_level(leaf_of(surface, stream, triangle, patch).level, colour);
    }
}

qp_status qp_patch_colours(const qp_scene *scene, const qp_surface *surface, const uint32_t *component,
                           float **colours, qp_error *err) {
    const uint32_t n = surface->mesh->n_patches;
    *colours = NULL;
    if (scene->colour_by == QP_COLOUR_KIND || scene->colour_by == QP_COLOUR_LEVEL)
        return qp_fail(err, QP_BAD_INPUT, "colours by the kind or level of nodes need the back end `stream`");
    *colours = qp_alloc(n, 3 * sizeof(float), false);
    if (*colours == NULL) return qp_fail_memory(err, n * 3 * sizeof(float), "colours");
    for (uint32_t p = 0; p < n; p++) patch_colour(scene, surface, component, p, *colours + 3 * (size_t)p);
    return QP_OK;
}
