/* Effective tags against OpenSubdiv's base level: sharpness, boundaries, non-manifold edges and vertices, holes, on
 * models, generated meshes, and soups of random faces that are anything but manifold. */
#include "host/base/random.h"
#include "host/peer/osd.h"
#include "tests/unit/mesh_files.h"

static float shown(float sharpness) {
    return sharpness >= QP_SHARPNESS_INFINITE ? QP_SHARPNESS_INFINITE : sharpness;
}

static unsigned nonmanifold, through, holes;

static void compare(const char *name, qp_mesh *mesh) {
    qp_osd_tags tags = {.edge_sharpness = qp_alloc(mesh->n_edges, sizeof(float), true),
                        .vertex_sharpness = qp_alloc(mesh->n_vertices, sizeof(float), true),
                        .edge_flags = qp_alloc(mesh->n_edges, 1, true),
                        .vertex_flags = qp_alloc(mesh->n_vertices, 1, true),
                        .face_flags = qp_alloc(mesh->n_faces, 1, true)};
    qp_error err;
    unsigned long before = check_failures;
    if (CHECK_OK(qp_osd_base_tags(mesh, &tags, &err), err)) {
        CHECK(tags.n_edges == mesh->n_edges);
        for (uint32_t e = 0; e < mesh->n_edges; ++e) {
            CHECK(mesh->edge_flags[e] == tags.edge_flags[e]);
            CHECK(mesh->edge_sharpness[e] == shown(tags.edge_sharpness[e]));
        }
        for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
            if (mesh->vertex_flags[v] & QP_VERTEX_UNUSED) continue;
            CHECK(mesh->vertex_flags[v] == tags.vertex_flags[v]);
            CHECK(mesh->vertex_sharpness[v] == shown(tags.vertex_sharpness[v]));
            bool is = (mesh->vertex_flags[v] & QP_VERTEX_NONMANIFOLD) != 0;
            nonmanifold += is;
            through += is && mesh->vertex_sharpness[v] < QP_SHARPNESS_INFINITE;
        }
        for (uint32_t f = 0; f < mesh->n_faces; ++f) {
            CHECK(mesh->face_flags[f] == tags.face_flags[f]);
            holes += mesh->face_flags[f] != 0;
        }
    }
    if (check_failures != before) fprintf(stderr, "    on %s\n", name);
    free(tags.edge_sharpness);
    free(tags.vertex_sharpness);
    free(tags.edge_flags);
    free(tags.vertex_flags);
    free(tags.face_flags);
}

/* Faces of 3 to 5 random vertices out of few: edges of many faces, both ways round; random tags. */
static void compare_soup(uint64_t seed) {
    enum { VERTICES = 9, FACES = 8, TAGS = 4 };
    qp_random random = {seed};
    double positions[3 * VERTICES] = {0};
    uint32_t sizes[FACES], vertices[5 * FACES], edges[2 * TAGS], corners[TAGS], n_corners = 0;
    float sharpness[TAGS];
    const uint32_t used = 5 + qp_random_below(&random, VERTICES - 4);
    for (uint32_t f = 0; f < FACES; ++f) {
        uint32_t order[VERTICES];
        for (uint32_t i = 0; i < used; ++i) order[i] = i;
        sizes[f] = 3 + qp_random_below(&random, 3);
        for (uint32_t i = 0; i < sizes[f]; ++i) {
            const uint32_t j = i + qp_random_below(&random, used - i), swap = order[i];
            order[i] = order[j];
            order[j] = swap;
            vertices[n_corners++] = order[i];
        }
    }
    for (uint32_t i = 0; i < TAGS; ++i) {
        const uint32_t c = qp_random_below(&random, n_corners - 1);
        edges[2 * i] = vertices[c]; /* mostly an edge */
        edges[2 * i + 1] = vertices[c + 1];
        corners[i] = vertices[qp_random_below(&random, n_corners)];
        sharpness[i] = (float)qp_random_below(&random, 12);
    }
    qp_mesh_desc desc = {.n_vertices = VERTICES,
                         .n_faces = 1 + qp_random_below(&random, FACES),
                         .positions = positions,
                         .face_sizes = sizes,
                         .face_vertices = vertices,
                         .n_creases = TAGS,
                         .crease_vertices = edges,
                         .crease_sharpness = sharpness,
                         .n_corners = 2,
                         .corner_vertices = corners,
                         .corner_sharpness = sharpness,
                         .boundary = (qp_boundary)qp_random_below(&random, 3)};
    for (uint32_t i = 0; i < 2; ++i) desc.n_corners = corners[i] < VERTICES ? desc.n_corners : 0;
    qp_mesh *mesh;
    qp_error err;
    char name[32];
    snprintf(name, sizeof name, "soup %llu", (unsigned long long)seed);
    if (!CHECK_OK(qp_mesh_create(&desc, &mesh, &err), err)) return;
    compare(name, mesh);
    qp_mesh_free(mesh);
}

/* Three strips of quads along one line: an interior vertex of the line is no corner. */
static void compare_fins(void) {
    enum { LENGTH = 4, FINS = 3 };
    double positions[3 * (LENGTH + 1) * (FINS + 1)] = {0};
    uint32_t sizes[LENGTH * FINS], vertices[4 * LENGTH * FINS], count = 0;
    for (uint32_t fin = 1; fin <= FINS; ++fin) {
        for (uint32_t i = 0; i < LENGTH; ++i) {
            const uint32_t quad[4] = {i, i + 1, fin * (LENGTH + 1) + i + 1, fin * (LENGTH + 1) + i};
            sizes[count] = 4;
            memcpy(vertices + 4 * count++, quad, sizeof quad);
        }
    }
    qp_mesh_desc desc = {.n_vertices = (LENGTH + 1) * (FINS + 1),
                         .n_faces = LENGTH * FINS,
                         .positions = positions,
                         .face_sizes = sizes,
                         .face_vertices = vertices,
                         .boundary = QP_BOUNDARY_EDGE_AND_CORNER};
    qp_mesh *mesh;
    qp_error err;
    if (!CHECK_OK(qp_mesh_create(&desc, &mesh, &err), err)) return;
    compare("fins", mesh);
    CHECK(mesh->vertex_sharpness[1] == 0 && mesh->vertex_flags[1] == QP_VERTEX_NONMANIFOLD);
    CHECK(mesh->vertex_sharpness[0] == QP_SHARPNESS_INFINITE);
    qp_mesh_free(mesh);
}

int main(void) {
    compare_fins();
    for (uint64_t seed = 0; seed < 3000; ++seed) compare_soup(seed);
    visit_generated(compare, 200);
    visit_models(compare);
    printf("%u non-manifold vertices (%u not sharpened), %u holes\n", nonmanifold, through, holes);
    CHECK(nonmanifold > 1000 && through > 100 && holes > 100);
    return check_report();
}
