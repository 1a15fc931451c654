/* Meshes that the mesh tests share: every model, and meshes of every generated kind. */
#ifndef QP_TESTS_MESH_FILES_H
#define QP_TESTS_MESH_FILES_H

#include "host/mesh/mesh.h"
#include "tests/check.h"

#include <dirent.h>
#include <string.h>

typedef void mesh_visitor(const char *name, qp_mesh *mesh);

/* Calls visit for every mesh that `folder` holds as .obj; files that are refused are counted. */
static inline unsigned visit_folder(const char *folder, mesh_visitor *visit, unsigned *refused) {
    unsigned count = 0;
    DIR *entries = opendir(folder);
    if (!CHECK(entries != NULL)) return 0;
    for (struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot == NULL || strcmp(dot, ".obj") != 0) continue;
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        qp_mesh *mesh;
        qp_error err;
        ++count;
        if (qp_mesh_read_obj(path, NULL, &mesh, &err) == QP_OK) {
            visit(entry->d_name, mesh);
            qp_mesh_free(mesh);
        } else {
            printf("refused: %s\n", err.message);
            ++*refused;
        }
    }
    closedir(entries);
    return count;
}

/* All models but those in which a face has a vertex twice. False, with a line, when there are no models. */
static inline int visit_models(mesh_visitor *visit) {
    const char *folder = check_models();
    if (folder == NULL) {
        printf("models skipped: QUADPLAN_MODELS not set\n");
        return 0;
    }
    char shapes[1024];
    unsigned refused = 0;
    snprintf(shapes, sizeof shapes, "%s/osd_shapes", folder);
    CHECK(visit_folder(folder, visit, &refused) >= 5);
    CHECK(refused == 0);
    CHECK(visit_folder(shapes, visit, &refused) >= 40);
    CHECK(refused == 3);
    return 1;
}

/* Every fixed kind at several sizes, and `seeds` meshes of each random kind. */
static inline void visit_generated(mesh_visitor *visit, unsigned seeds) {
    static const struct {
        const char *kind;
        uint32_t n[3];
    } fixed[] = {{"cube", {1}},          {"cube", {3}},        {"torus", {0}},      {"torus", {3, 3}},
                 {"creased-torus", {0}}, {"cubes", {2, 3, 2}}, {"cubes", {0}},      {"fan", {2, 1}},
                 {"fan", {2, 3}},        {"fan", {3}},         {"fan", {5, 1}},     {"fan", {64, 2}},
                 {"fan", {2000, 1}},     {"prism", {3}},       {"prism", {4}},      {"prism", {7, 3}},
                 {"prism", {1000}},      {"terrain", {0}},     {"terrain", {1, 1}}, {"terrain", {40, 9}}};
    char name[64];
    qp_mesh *mesh;
    qp_error err;
    for (size_t i = 0; i < sizeof fixed / sizeof fixed[0]; ++i) {
        qp_generate_options options = {.n = {fixed[i].n[0], fixed[i].n[1], fixed[i].n[2]}, .sharpness = -1};
        snprintf(name, sizeof name, "%s %u %u", fixed[i].kind, fixed[i].n[0], fixed[i].n[1]);
        if (!CHECK_OK(qp_mesh_generate(fixed[i].kind, &options, &mesh, &err), err)) continue;
        visit(name, mesh);
        qp_mesh_free(mesh);
    }
    for (unsigned i = 0; i < 2 * seeds; ++i) {
        const char *kind = i % 2 == 0 ? "random-closed" : "random-open";
        qp_generate_options options = {.seed = i / 2, .sharpness = -1};
        snprintf(name, sizeof name, "%s %u", kind, i / 2);
        if (!CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err)) continue;
        visit(name, mesh);
        qp_mesh_free(mesh);
    }
}

#endif
