/* The parts of qp_mesh_generate. Each fills a builder, or makes the mesh itself. */
#ifndef QP_MESH_GENERATE_H
#define QP_MESH_GENERATE_H

#include "host/base/random.h"
#include "host/mesh/builder.h"

/* n[i], or a default, refused outside [low, high]. */
qp_status generate_size(const qp_generate_options *options, int i, uint32_t fallback, uint32_t low,
                        uint32_t high, const char *what, uint32_t *size, qp_error *err);

/* Point i of n on the unit circle, rounded to a multiple of 2^-40: the same whatever the mathematics library.
 */
void generate_circle(double turn, double *x, double *y);

/* Height field over [-1,1]^2 with n[0] x n[1] cells (32 x 32), some of them edited: rotated edges (two
 * vertices of valence 3 and two of 5), hexagons, octagons, triangles. seed chooses heights and places. */
qp_status generate_terrain(const qp_generate_options *options, qp_mesh **mesh, qp_error *err);

/* A random manifold mesh of at most options->faces faces with random tags and rules. */
qp_status generate_random(const qp_generate_options *options, bool open, qp_mesh **mesh, qp_error *err);

/* One random topological edit of a manifold mesh. False when it did not apply or would not leave a manifold
 * mesh of at most `limit` faces: *mesh is then unchanged. Otherwise *mesh is replaced (and freed). */
bool generate_edit(qp_mesh **mesh, qp_random *random, bool open, uint32_t limit);
/* Catmull-Clark's topology: every n-gon becomes n quads. False as above. */
bool generate_split_all(qp_mesh **mesh, uint32_t limit);

/* Starts a copy of a mesh without the faces whose flag is set (drop may be NULL: all are kept). */
void generate_copy(mesh_builder *b, const qp_mesh *mesh, const uint8_t *drop);
void generate_face_center(const qp_mesh *mesh, uint32_t face, double center[3]);

/* Adds random creases, corners and holes to the builder, which holds the faces and vertices of `mesh` in
 * order, and chooses its rules. */
void generate_tags(mesh_builder *b, const qp_mesh *mesh, qp_random *random);

#endif
