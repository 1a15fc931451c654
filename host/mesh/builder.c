#include "host/mesh/builder.h"

#include <stdlib.h>
#include <string.h>

static void append(mesh_builder *b, builder_list *list, const void *values, size_t count, size_t size) {
    if (b->failed) return;
    size_t need = list->count + count;
    if (need > INT32_MAX || (need > list->capacity && !qp_grow(&list->at, &list->capacity, 2 * need, size))) {
        b->failed = true;
        return;
    }
    memcpy((char *)list->at + list->count * size, values, count * size);
    list->count = need;
}

uint32_t builder_vertex(mesh_builder *b, double x, double y, double z) {
    const double p[3] = {x, y, z};
    append(b, &b->positions, p, 3, sizeof *p);
    return builder_vertex_count(b) - 1;
}

void builder_face(mesh_builder *b, uint32_t size, const uint32_t *vertices) {
    append(b, &b->face_sizes, &size, 1, sizeof size);
    append(b, &b->face_vertices, vertices, size, sizeof *vertices);
}

void builder_quad(mesh_builder *b, uint32_t v0, uint32_t v1, uint32_t v2, uint32_t v3) {
    const uint32_t quad[4] = {v0, v1, v2, v3};
    builder_face(b, 4, quad);
}

void builder_crease(mesh_builder *b, uint32_t v0, uint32_t v1, float sharpness) {
    const uint32_t edge[2] = {v0, v1};
    append(b, &b->crease_vertices, edge, 2, sizeof *edge);
    append(b, &b->crease_sharpness, &sharpness, 1, sizeof sharpness);
}

void builder_corner(mesh_builder *b, uint32_t vertex, float sharpness) {
    append(b, &b->corner_vertices, &vertex, 1, sizeof vertex);
    append(b, &b->corner_sharpness, &sharpness, 1, sizeof sharpness);
}

void builder_hole(mesh_builder *b, uint32_t face) {
    append(b, &b->hole_faces, &face, 1, sizeof face);
}

uint32_t builder_vertex_count(const mesh_builder *b) {
    return (uint32_t)(b->positions.count / 3);
}
uint32_t builder_face_count(const mesh_builder *b) {
    return (uint32_t)b->face_sizes.count;
}
double *builder_position(mesh_builder *b, uint32_t vertex) {
    return b->failed ? NULL : (double *)b->positions.at + 3 * (size_t)vertex;
}

/* Renumbers vertices so that only used ones remain. */
static bool drop_unused(mesh_builder *b) {
    uint32_t count = builder_vertex_count(b), kept = 0;
    uint32_t *number = qp_alloc(count, sizeof *number, true);
    if (number == NULL) return false;
    uint32_t *vertices = b->face_vertices.at, *creases = b->crease_vertices.at,
             *corners = b->corner_vertices.at;
    double *positions = b->positions.at;
    for (size_t i = 0; i < b->face_vertices.count; ++i) number[vertices[i]] = 1;
    for (uint32_t v = 0; v < count; ++v) {
        if (!number[v]) {
            number[v] = QP_NONE;
            continue;
        }
        memmove(positions + 3 * (size_t)kept, positions + 3 * (size_t)v, 3 * sizeof *positions);
        number[v] = kept++;
    }
    b->positions.count = 3 * (size_t)kept;
    for (size_t i = 0; i < b->face_vertices.count; ++i) vertices[i] = number[vertices[i]];
    for (size_t i = 0; i < b->crease_vertices.count; ++i) creases[i] = number[creases[i]];
    for (size_t i = 0; i < b->corner_vertices.count; ++i) corners[i] = number[corners[i]];
    free(number);
    return true;
}

qp_status builder_finish(mesh_builder *b, qp_mesh **mesh, qp_error *err) {
    *mesh = NULL;
    qp_status status;
    if (b->failed || !drop_unused(b)) {
        status = qp_fail_memory(err, b->positions.count * sizeof(double), "a generated mesh");
    } else {
        qp_mesh_desc desc = {.n_vertices = builder_vertex_count(b),
                             .n_faces = builder_face_count(b),
                             .positions = b->positions.at,
                             .face_sizes = b->face_sizes.at,
                             .face_vertices = b->face_vertices.at,
                             .n_creases = (uint32_t)b->crease_sharpness.count,
                             .crease_vertices = b->crease_vertices.at,
                             .crease_sharpness = b->crease_sharpness.at,
                             .n_corners = (uint32_t)b->corner_vertices.count,
                             .corner_vertices = b->corner_vertices.at,
                             .corner_sharpness = b->corner_sharpness.at,
                             .n_holes = (uint32_t)b->hole_faces.count,
                             .hole_faces = b->hole_faces.at,
                             .boundary = b->boundary,
                             .crease_method = b->crease_method,
                             .triangle_rule = b->triangle_rule};
        status = qp_mesh_create(&desc, mesh, err);
    }
    builder_free(b);
    return status;
}

void builder_free(mesh_builder *b) {
    free(b->positions.at);
    free(b->face_sizes.at);
    free(b->face_vertices.at);
    free(b->crease_vertices.at);
    free(b->crease_sharpness.at);
    free(b->corner_vertices.at);
    free(b->corner_sharpness.at);
    free(b->hole_faces.at);
    *b = (mesh_builder){0};
}
