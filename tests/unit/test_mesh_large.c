/* Large meshes: a million regular faces, and a vertex of valence 10^6 from which quadratic work would never return.
 * Times are printed, not asserted. QUADPLAN_LARGE=0 makes the meshes a hundred times smaller (for slow builds). */
#include "host/mesh/mesh.h"
#include "tests/check.h"

#include <string.h>

static qp_mesh *generate(const char *kind, uint32_t n0, uint32_t n1, double *ms) {
    qp_generate_options options = {.n = {n0, n1}, .sharpness = -1};
    qp_mesh *mesh = NULL;
    qp_error err;
    const double start = qp_now_ms();
    CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err);
    *ms = qp_now_ms() - start;
    return mesh;
}

/* Written and read back. */
static void check_file(const char *kind, uint32_t n0, uint32_t n1, uint32_t faces) {
    double generate_ms, start;
    const char *path = "mesh_large.obj";
    qp_mesh *mesh = generate(kind, n0, n1, &generate_ms), *back = NULL;
    qp_error err;
    if (mesh == NULL) return;
    CHECK(mesh->n_faces == faces);
    start = qp_now_ms();
    CHECK_OK(qp_mesh_write_obj(mesh, path, &err), err);
    const double write_ms = qp_now_ms() - start;
    start = qp_now_ms();
    if (CHECK_OK(qp_mesh_read_obj(path, NULL, &back, &err), err)) {
        const double read_ms = qp_now_ms() - start;
        CHECK(back->n_edges == mesh->n_edges && back->n_patches == mesh->n_patches);
        CHECK(memcmp(back->corner_twin, mesh->corner_twin, mesh->n_corners * sizeof(uint32_t)) == 0);
        CHECK(memcmp(back->positions, mesh->positions, 3 * mesh->n_vertices * sizeof(double)) == 0);
        printf("%s %u x %u: %u faces; made and analysed in %.0f ms, written in %.0f, read and analysed in "
               "%.0f\n",
               kind, n0, n1, faces, generate_ms, write_ms, read_ms);
    }
    qp_mesh_free(back);
    qp_mesh_free(mesh);
    remove(path);
}

static void check_valence(const char *kind, uint32_t n0, uint32_t faces) {
    double ms;
    qp_mesh *mesh = generate(kind, n0, 1, &ms);
    if (mesh == NULL) return;
    CHECK(mesh->n_faces == faces);
    printf("%s %u: made and analysed in %.0f ms\n", kind, n0, ms);
    qp_mesh_free(mesh);
}

int main(void) {
    const char *wish = getenv("QUADPLAN_LARGE");
    const uint32_t small = wish != NULL && strcmp(wish, "0") == 0 ? 10 : 1;
    const uint32_t side = 1000 / small, valence = 1000000 / (small * small);
    check_file("torus", side, side, side * side);
    check_valence("fan", valence, valence);
    check_valence("prism", valence, valence + 2);
    return check_report();
}
