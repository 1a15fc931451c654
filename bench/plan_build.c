/* How long plans take to build, beside OpenSubdiv's set-up of the same mesh.
 *
 *   bench_plan_build [--repeat N] MESH.obj ...
 *
 * Every repetition times, in turn: our plans to level 6 (the paper's depth, and OpenSubdiv's here) on one
 * thread and on all, and OpenSubdiv's adaptive refinement to level 6, patch table and stencil table, which
 * use one thread. Medians are printed. Then a regular mesh of a million faces: its plans must not grow with
 * it. */
#define _GNU_SOURCE
#include "host/base/measure.h"
#include "host/mesh/mesh.h"
#include "host/peer/osd.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEVEL = 6, MOST_REPEATS = 100 };

/* Milliseconds of qp_surface_create, analysis of the mesh apart. threads: NULL for all. */
static qp_status time_plans(const qp_mesh *mesh, uint32_t depth, const char *threads, double *ms,
                            qp_surface_info *info, qp_error *err) {
    qp_surface_options options = {.depth = depth};
    qp_surface *surface = NULL;
    if (threads != NULL) {
        setenv("QUADPLAN_THREADS", threads, 1);
    } else {
        unsetenv("QUADPLAN_THREADS");
    }
    double begin = qp_now_ms();
    qp_status status = qp_surface_create(mesh, &options, &surface, err);
    *ms = qp_now_ms() - begin;
    if (status == QP_OK && info != NULL) status = qp_surface_get_info(surface, info, err);
    qp_surface_free(surface);
    return status;
}

static qp_status beside_opensubdiv(const char *path, unsigned repeats, qp_error *err) {
    double one[MOST_REPEATS], all[MOST_REPEATS], refine[MOST_REPEATS], patches[MOST_REPEATS],
        stencils[MOST_REPEATS], peer[MOST_REPEATS];
    qp_mesh *mesh = NULL;
    qp_surface_info info = {0};
    qp_status status = qp_mesh_read_obj(path, NULL, &mesh, err);
    for (unsigned i = 0; i < repeats && status == QP_OK; ++i) {
        status = time_plans(mesh, LEVEL, "1", &one[i], NULL, err);
        if (status == QP_OK) status = time_plans(mesh, LEVEL, NULL, &all[i], i == 0 ? &info : NULL, err);
        if (status == QP_OK)
            status = qp_osd_time_setup(mesh, LEVEL, &refine[i], &patches[i], &stencils[i], err);
        peer[i] = refine[i] + patches[i] + stencils[i];
    }
    qp_mesh_free(mesh);
    if (status != QP_OK) return status;
    const char *slash = strrchr(path, '/');
    double ours = qp_median(one, repeats), ours_all = qp_median(all, repeats),
           theirs = qp_median(peer, repeats);
    printf("%s: %" PRIu64 " plans, %" PRIu64 " stencils, level %d, medians of %u\n",
           slash != NULL ? slash + 1 : path, info.plans, info.stencils, LEVEL, repeats);
    printf("  plans, 1 thread      %9.2f ms\n", ours);
    printf("  plans, %u threads     %9.2f ms\n", qp_thread_count(), ours_all);
    printf("  OpenSubdiv, 1 thread %9.2f ms (refine %.2f, patch table %.2f, stencil table %.2f)\n", theirs,
           qp_median(refine, repeats), qp_median(patches, repeats), qp_median(stencils, repeats));
    printf("  OpenSubdiv / plans   %9.2f (1 thread), %.2f (all)\n", theirs / ours, theirs / ours_all);
    return QP_OK;
}

/* A torus of n x n quads: every face is regular. */
static qp_status regular_mesh(uint32_t n, qp_error *err) {
    qp_generate_options generate = {.n = {n, n}, .sharpness = -1};
    qp_mesh *mesh = NULL;
    qp_surface_info info = {0};
    double ms = 0, begin = qp_now_ms();
    qp_status status = qp_mesh_generate("torus", &generate, &mesh, err);
    double analyse_ms = qp_now_ms() - begin;
    if (status == QP_OK) status = time_plans(mesh, LEVEL, NULL, &ms, &info, err);
    if (status == QP_OK)
        printf("torus, %" PRIu32 " faces: %" PRIu64 " plans, %" PRIu64
               " stencils; mesh made and analysed in %.0f ms, "
               "plans in %.2f ms (%.1f ns a face)\n",
               mesh->n_faces, info.plans, info.stencils, analyse_ms, ms, ms * 1e6 / mesh->n_faces);
    qp_mesh_free(mesh);
    return status;
}

int main(int argc, char **argv) {
    unsigned repeats = 5;
    int first = 1;
    if (argc > 2 && strcmp(argv[1], "--repeat") == 0) {
        long n = strtol(argv[2], NULL, 10);
        if (n < 1 || n > MOST_REPEATS) {
            fprintf(stderr, "--repeat: from 1 to %d\n", MOST_REPEATS);
            return QP_BAD_INPUT;
        }
        repeats = (unsigned)n;
        first = 3;
    }
    qp_error err = {0};
    qp_status status = QP_OK;
    for (int i = first; i < argc && status == QP_OK; ++i) status = beside_opensubdiv(argv[i], repeats, &err);
    static const uint32_t sides[] = {100, 1000};
    for (size_t i = 0; i < sizeof sides / sizeof *sides && status == QP_OK; ++i)
        status = regular_mesh(sides[i], &err);
    if (status != QP_OK) fprintf(stderr, "%s\n", err.message);
    return (int)status;
}
