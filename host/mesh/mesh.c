#include "host/mesh/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void qp_mesh_free(qp_mesh *mesh) {
    if (mesh == NULL) return;
    free(mesh->positions);
    free(mesh->face_offsets);
    free(mesh->face_vertices);
    free(mesh->corner_face);
    free(mesh->corner_edge);
    free(mesh->corner_twin);
    free(mesh->edge_vertices);
    free(mesh->edge_face_count);
    free(mesh->edge_sharpness);
    free(mesh->edge_flags);
    free(mesh->vertex_offsets);
    free(mesh->vertex_corners);
    free(mesh->vertex_sharpness);
    free(mesh->vertex_flags);
    free(mesh->face_flags);
    free(mesh->face_lines);
    free(mesh->patch_offsets);
    free(mesh->texcoords);
    free(mesh->corner_texcoords);
    free(mesh->crease_vertices);
    free(mesh->crease_sharpness);
    free(mesh->corner_tag_vertices);
    free(mesh->corner_tag_sharpness);
    free(mesh->hole_tag_faces);
    free(mesh);
}

uint32_t qp_mesh_vertex_count(const qp_mesh *mesh) {
    return mesh->n_vertices;
}
uint32_t qp_mesh_face_count(const qp_mesh *mesh) {
    return mesh->n_faces;
}
uint32_t qp_mesh_patch_count(const qp_mesh *mesh) {
    return mesh->n_patches;
}
qp_local_frame qp_mesh_local_frame(const qp_mesh *mesh) {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, extent = 0.0, farthest = 0.0;
    qp_local_frame f = {{0, 0, 0}, 0};
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; ++i) {
        const double x = mesh->positions[i];
        const size_t axis = i % 3;
        if (i < 3 || x < low[axis]) low[axis] = x;
        if (i < 3 || x > high[axis]) high[axis] = x;
    }
    for (size_t axis = 0; axis < 3; ++axis) extent = fmax(extent, high[axis] - low[axis]);
    farthest = extent;
    for (size_t axis = 0; axis < 3; ++axis) {
        const double middle = low[axis] / 2 + high[axis] / 2;
        if (fabs(middle) > 4 * extent)
            f.centre[axis] = (double)(float)middle + (double)(float)(middle - (double)(float)middle);
        else
            farthest = fmax(farthest, fmax(fabs(low[axis]), fabs(high[axis])));
    }
    if (farthest > 0.0) f.exponent = ilogb(farthest);
    if (f.exponent < -100) f.exponent = -100;
    if (f.exponent > 100) f.exponent = 100;
    return f;
}

uint32_t qp_mesh_edge_count(const qp_mesh *mesh) {
    return mesh->n_edges;
}

const uint32_t *qp_mesh_edge_vertices(const qp_mesh *mesh) {
    return mesh->edge_vertices;
}

const double *qp_mesh_positions(const qp_mesh *mesh) {
    return mesh->positions;
}

uint32_t qp_patch_face(const qp_mesh *mesh, uint32_t patch, uint32_t *child) {
    uint32_t low = 0, high = mesh->n_faces; /* patch_offsets[low] <= patch < patch_offsets[high] */
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (mesh->patch_offsets[middle] <= patch) {
            low = middle;
        } else {
            high = middle;
        }
    }
    if (child != NULL) *child = patch - mesh->patch_offsets[low];
    return low;
}

bool qp_face_is_regular(const qp_mesh *mesh, uint32_t face) {
    if (qp_face_size(mesh, face) != 4) return false;
    for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; ++c) {
        uint32_t v = mesh->face_vertices[c];
        uint32_t begin = mesh->vertex_offsets[v], end = mesh->vertex_offsets[v + 1];
        if (mesh->vertex_flags[v] != 0 || mesh->vertex_sharpness[v] > 0 || end - begin != 4) return false;
        for (uint32_t i = begin; i < end; ++i) {
            uint32_t corner = mesh->vertex_corners[i];
            if (qp_face_size(mesh, mesh->corner_face[corner]) != 4) return false;
            if (mesh->edge_sharpness[mesh->corner_edge[corner]] > 0) return false;
        }
    }
    return true;
}

/* A copy of count * size bytes; true also when there is nothing to copy. */
static bool copy_array(void *destination, const void *source, size_t count, size_t size) {
    void *copy = qp_alloc(count, size, false);
    if (copy == NULL) return false;
    if (count > 0) memcpy(copy, source, count * size);
    memcpy(destination, &copy, sizeof copy);
    return true;
}

static qp_status check_desc(const qp_mesh_desc *desc, qp_error *err) {
    if (desc == NULL || (desc->n_vertices > 0 && desc->positions == NULL) ||
        (desc->n_faces > 0 && (desc->face_sizes == NULL || desc->face_vertices == NULL)) ||
        (desc->n_creases > 0 && (desc->crease_vertices == NULL || desc->crease_sharpness == NULL)) ||
        (desc->n_corners > 0 && (desc->corner_vertices == NULL || desc->corner_sharpness == NULL)) ||
        (desc->n_holes > 0 && desc->hole_faces == NULL)) {
        return qp_fail(err, QP_BAD_INPUT, "mesh: an array of the description is missing");
    }
    return QP_OK;
}

/* Fills what a reader would: positions, faces and tags. */
static qp_status copy_desc(qp_mesh *mesh, const qp_mesh_desc *desc, qp_error *err) {
    mesh->face_offsets = qp_alloc((size_t)desc->n_faces + 1, sizeof *mesh->face_offsets, false);
    if (mesh->face_offsets == NULL) return qp_fail_memory(err, desc->n_faces * (size_t)4, "faces");
    uint64_t corners = 0;
    for (uint32_t f = 0; f < desc->n_faces; ++f) {
        mesh->face_offsets[f] = (uint32_t)corners;
        corners += desc->face_sizes[f];
        if (corners > INT32_MAX) return qp_fail(err, QP_BAD_INPUT, "mesh: more than 2^31 - 1 face corners");
    }
    mesh->face_offsets[desc->n_faces] = (uint32_t)corners;
    mesh->n_vertices = desc->n_vertices;
    mesh->n_faces = desc->n_faces;
    mesh->n_corners = (uint32_t)corners;
    mesh->n_creases = desc->n_creases;
    mesh->n_corner_tags = desc->n_corners;
    mesh->n_hole_tags = desc->n_holes;
    mesh->boundary = desc->boundary;
    mesh->crease_method = desc->crease_method;
    mesh->triangle_rule = desc->triangle_rule;
    mesh->fvar_boundary = 5;
    bool good =
        copy_array(&mesh->positions, desc->positions, (size_t)desc->n_vertices * 3, sizeof(double)) &&
        copy_array(&mesh->face_vertices, desc->face_vertices, corners, sizeof(uint32_t)) &&
        copy_array(&mesh->crease_vertices, desc->crease_vertices, (size_t)desc->n_creases * 2,
                   sizeof(uint32_t)) &&
        copy_array(&mesh->crease_sharpness, desc->crease_sharpness, desc->n_creases, sizeof(float)) &&
        copy_array(&mesh->corner_tag_vertices, desc->corner_vertices, desc->n_corners, sizeof(uint32_t)) &&
        copy_array(&mesh->corner_tag_sharpness, desc->corner_sharpness, desc->n_corners, sizeof(float)) &&
        copy_array(&mesh->hole_tag_faces, desc->hole_faces, desc->n_holes, sizeof(uint32_t));
    return good ? QP_OK : qp_fail_memory(err, corners * sizeof(uint32_t), "a copy of the mesh");
}

qp_status qp_mesh_create(const qp_mesh_desc *desc, qp_mesh **result, qp_error *err) {
    *result = NULL;
    qp_status status = check_desc(desc, err);
    if (status != QP_OK) return status;
    qp_mesh *mesh = qp_alloc(1, sizeof *mesh, true);
    if (mesh == NULL) return qp_fail_memory(err, sizeof *mesh, "a mesh");
    status = copy_desc(mesh, desc, err);
    if (status == QP_OK) status = qp_mesh_analyse(mesh, "mesh", NULL, err);
    if (status != QP_OK) {
        qp_mesh_free(mesh);
        return status;
    }
    *result = mesh;
    return QP_OK;
}
