/* Collects vertices, faces and tags and makes a mesh of them. Running out of memory is remembered and told by
 * builder_finish, so that the code that adds elements need not look. */
#ifndef QP_MESH_BUILDER_H
#define QP_MESH_BUILDER_H

#include "host/mesh/mesh.h"

typedef struct builder_list {
    void *at;
    size_t count, capacity;
} builder_list;

/* Zero-initialise; the rules are the caller's to set. */
typedef struct mesh_builder {
    builder_list positions;        /* double, 3 a vertex */
    builder_list face_sizes;       /* uint32_t */
    builder_list face_vertices;    /* uint32_t */
    builder_list crease_vertices;  /* uint32_t, 2 a crease */
    builder_list crease_sharpness; /* float */
    builder_list corner_vertices, corner_sharpness, hole_faces;
    qp_boundary boundary;
    qp_crease_method crease_method;
    qp_triangle_rule triangle_rule;
    bool failed; /* out of memory, or more than 2^31 - 1 of something */
} mesh_builder;

/* Adds a vertex; returns its number. */
uint32_t builder_vertex(mesh_builder *b, double x, double y, double z);
void builder_face(mesh_builder *b, uint32_t size, const uint32_t *vertices);
void builder_quad(mesh_builder *b, uint32_t v0, uint32_t v1, uint32_t v2, uint32_t v3);
void builder_crease(mesh_builder *b, uint32_t v0, uint32_t v1, float sharpness);
void builder_corner(mesh_builder *b, uint32_t vertex, float sharpness);
void builder_hole(mesh_builder *b, uint32_t face);
uint32_t builder_vertex_count(const mesh_builder *b);
uint32_t builder_face_count(const mesh_builder *b);
/* 3 doubles; valid until the next vertex is added. NULL when memory ran out. */
double *builder_position(mesh_builder *b, uint32_t vertex);

/* The mesh; vertices that no face uses are left out. Frees what the builder holds, also on failure. */
qp_status builder_finish(mesh_builder *b, qp_mesh **mesh, qp_error *err);
void builder_free(mesh_builder *b);

#endif
