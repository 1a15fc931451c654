#include "host/frame/patch_points.h"

#include <stdlib.h>
#include <string.h>

bool qp_patch_points_make(const qp_surface *surface, uint32_t patch, qp_patch_points *made) {
    const qp_plan *plan = surface->plans[surface->patch_plan[patch]];
    const uint32_t width = plan->ring_size, *vertices = surface->rings + surface->patch_ring[patch];
    const double *positions = surface->mesh->positions, *origin = positions + 3 * (size_t)vertices[0];
    if (!qp_grow((void **)&made->ring, &made->ring_capacity, 3 * (size_t)width, sizeof *made->ring) ||
        !qp_grow((void **)&made->points, &made->point_capacity, 3 * (size_t)plan->point_count,
                 sizeof *made->points))
        return false;
    made->plan = plan;
    for (size_t j = 0; j < width; ++j) {
        for (size_t x = 0; x < 3; ++x)
            made->ring[3 * j + x] = positions[3 * (size_t)vertices[j] + x] - origin[x];
    }
    for (size_t i = 0; i < plan->point_count; ++i) {
        const double *row = plan->weights + i * width;
        double sum[3] = {0};
        for (size_t j = 0; j < width; ++j) {
            for (size_t x = 0; x < 3; ++x) sum[x] += row[j] * made->ring[3 * j + x];
        }
        memcpy(made->points + 3 * i, sum, sizeof sum);
    }
    return true;
}

static bool is_late(float sharpness, uint32_t depth) {
    return sharpness < QP_SHARPNESS_INFINITE && sharpness + 3.0f > (float)depth;
}

bool qp_patch_settles(const qp_mesh *mesh, uint32_t patch, uint32_t depth) {
    uint32_t child;
    const uint32_t face = qp_patch_face(mesh, patch, &child);
    for (uint32_t h = mesh->face_offsets[face]; h < mesh->face_offsets[face + 1]; ++h) {
        const uint32_t vertex = mesh->face_vertices[h];
        if (is_late(mesh->vertex_sharpness[vertex], depth)) return false;
        for (uint32_t i = mesh->vertex_offsets[vertex]; i < mesh->vertex_offsets[vertex + 1]; ++i) {
            const uint32_t corner = mesh->vertex_corners[i];
            if (is_late(mesh->edge_sharpness[mesh->corner_edge[corner]], depth) ||
                is_late(mesh->edge_sharpness[mesh->corner_edge[qp_corner_prev(mesh, corner)]], depth))
                return false;
        }
    }
    return true;
}

void qp_patch_points_free(qp_patch_points *points) {
    free(points->ring);
    free(points->points);
    *points = (qp_patch_points){0};
}
