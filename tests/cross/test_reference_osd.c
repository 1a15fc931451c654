/* The reference against OpenSubdiv in double, to 1e-9 of the diagonal:
 * - Far's adaptive refinement, at any (u,v) outside its end caps, for every mesh of QUADPLAN_MODELS under its
 *   own rules and under the others, and for random meshes under every rule;
 * - the limit masks of uniform refinement on random meshes, position and normal.
 * Under Chaikin's rule adaptive refinement guesses where neighbours are missing (docs/reference.md), so there
 * it must agree at nearly all points, and uniform refinement at all. */
#define _GNU_SOURCE
#include "host/peer/osd.h"
#include "host/reference/eval.h"
#include "host/reference/stress.h"
#include "tests/check.h"
#include "tests/variants.h"

#include <dirent.h>
#include <string.h>

enum { SAMPLES = 12 };
static const double tolerance = 1e-9;
static qp_reference_work work;

typedef struct tally {
    unsigned long checked, end_caps, off;
    double worst, worst_du;
} tally;

/* Points spread over the square, every fourth on the edge v = 0 and every fourth on a 16 x 16 grid. */
static void spread(uint32_t patch, double uv[2 * SAMPLES]) {
    for (uint32_t i = 0; i < SAMPLES; ++i) {
        double k = (double)patch * SAMPLES + i + 1;
        double u = fmod(0.5 + k * 0.7548776662466927, 1), v = fmod(0.5 + k * 0.5698402909980532, 1);
        uv[2 * i] = i % 4 == 3 ? rint(u * 16) / 16 : u;
        uv[2 * i + 1] = i % 4 == 3 ? rint(v * 16) / 16 : i % 4 == 2 ? 0 : v;
    }
}

static void compare_sample(const qp_mesh *mesh, const qp_reference_sample *ours, const qp_osd_sample *theirs,
                           double unit, tally *t) {
    double error = 0, error_du = 0;
    CHECK(!theirs->missing);
    if (theirs->end_cap) {
        t->end_caps++;
        return;
    }
    for (int c = 0; c < 3; ++c) {
        error = fmax(error, fabs(ours->p[c] - theirs->p[c]) / mesh->diagonal);
        error_du = fmax(error_du, fabs(unit * ours->du[c] - theirs->du[c]) / mesh->diagonal);
        error_du = fmax(error_du, fabs(unit * ours->dv[c] - theirs->dv[c]) / mesh->diagonal);
    }
    t->checked++;
    t->off += !(error <= tolerance);
    if (!(error <= t->worst)) t->worst = error;
    if (!(error_du <= t->worst_du)) t->worst_du = error_du;
}

static void compare_adaptive(const qp_mesh *mesh, unsigned depth, uint32_t stride, tally *t) {
    qp_osd *osd;
    qp_error err = {0};
    if (!CHECK_OK(qp_osd_create(mesh, mesh->positions, depth, &osd, &err), err)) return;
    for (uint32_t p = 0; p < mesh->n_patches; p += stride) {
        double uv[2 * SAMPLES];
        qp_reference_sample ours[SAMPLES];
        qp_osd_sample theirs[SAMPLES];
        uint32_t face = qp_patch_face(mesh, p, NULL);
        spread(p, uv);
        if (!CHECK_OK(qp_osd_eval(osd, p, SAMPLES, uv, theirs, &err), err)) break;
        if (mesh->face_flags[face] & QP_FACE_HOLE) {
            CHECK(theirs[0].missing);
            continue;
        }
        if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, p, SAMPLES, uv, ours, &err), err))
            break;
        double unit = qp_face_size(mesh, face) == 4 ? 1 : 2;
        for (int i = 0; i < SAMPLES; ++i) compare_sample(mesh, &ours[i], &theirs[i], unit, t);
    }
    qp_osd_free(osd);
}

static void judge(const char *name, const char *method, const tally *t) {
    double share = 100.0 * (double)t->checked / fmax(1, (double)(t->checked + t->end_caps));
    printf("%-42s %-8s %8lu points outside end caps (%.2f %%): position %.2e, derivative %.2e\n", name,
           method, t->checked, share, t->worst, t->worst_du);
    if (strcmp(method, "uniform") == 0)
        CHECK_NEAR(t->worst, 0, tolerance);
    else
        CHECK((double)t->off <= 0.01 * (double)t->checked);
}

/* Deep enough for the sharpest tag, and shallower where that would take too long. */
static unsigned depth_for(const qp_mesh *mesh) {
    unsigned need = (unsigned)ceilf(variant_sharpest(mesh)) + 2;
    if (mesh->n_patches <= 2000) return 10;
    return need < 6 ? 6 : need > 10 ? 10 : need;
}

/* A model that the reader refuses is not a manifold mesh; the mesh tests look after those. */
static int compare_model(const char *folder, const char *file) {
    char path[4096];
    qp_mesh *mesh;
    qp_error err = {0};
    qp_mesh_options options = {0};
    snprintf(path, sizeof path, "%s/%s", folder, file);
    if (qp_mesh_read_obj(path, &options, &mesh, &err) != QP_OK) return 0;
    tally own[2] = {{0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}};
    bool chaikin = mesh->crease_method == QP_CREASE_CHAIKIN;
    compare_adaptive(mesh, depth_for(mesh), 1, &own[chaikin]);
    judge(file, chaikin ? "chaikin" : "uniform", &own[chaikin]);
    tally others[2] = {{0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}};
    for (unsigned rules = 0; rules < VARIANT_RULES && mesh->n_patches < (CHECK_SANITIZED ? 30 : 700);
         ++rules) {
        qp_mesh *variant = variant_make(mesh, rules, QP_SHARPNESS_INFINITE, &err);
        if (!CHECK(variant != NULL)) continue;
        compare_adaptive(variant, 10, 1 + variant->n_patches / 200, &others[rules / 3 % 2]);
        qp_mesh_free(variant);
    }
    if (others[0].checked > 0) judge("  under all other rules", "uniform", &others[0]);
    if (others[1].checked > 0) judge("", "chaikin", &others[1]);
    qp_mesh_free(mesh);
    return 1;
}

static int compare_folder(const char *folder) {
    DIR *dir = opendir(folder);
    int count = 0;
    if (!CHECK(dir != NULL)) return 0;
    for (struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot != NULL && strcmp(dot, ".obj") == 0) count += compare_model(folder, entry->d_name);
    }
    closedir(dir);
    return count;
}

typedef struct mask_tally {
    unsigned long checked, normals, unsettled;
    double worst, worst_normal;
} mask_tally;

static void compare_limit(const qp_mesh *mesh, const qp_osd_limit *theirs, mask_tally *t) {
    const double uv[2] = {theirs->u, theirs->v};
    qp_reference_sample ours;
    qp_error err = {0};
    if (!theirs->settled) {
        t->unsettled++;
        return;
    }
    if (!CHECK_OK(qp_reference_eval_with(&work, mesh, mesh->positions, theirs->patch, 1, uv, &ours, &err),
                  err))
        return;
    t->checked++;
    for (int c = 0; c < 3; ++c) t->worst = fmax(t->worst, fabs(ours.p[c] - theirs->p[c]) / mesh->diagonal);
    if (!theirs->has_normal || !ours.normal_defined) return;
    t->normals++;
    for (int c = 0; c < 3; ++c) t->worst_normal = fmax(t->worst_normal, fabs(ours.n[c] - theirs->n[c]));
}

static void compare_masks(const qp_mesh *base, unsigned rules, mask_tally *t) {
    enum { LEVEL = 5, STRIDE = 37 };
    qp_error err = {0};
    qp_osd_limit *limits;
    size_t count;
    /* Sharpness that is gone before the last level. */
    qp_mesh *mesh = variant_make(base, rules, 3.5f, &err);
    if (!CHECK(mesh != NULL)) return;
    if (CHECK_OK(qp_osd_uniform_limits(mesh, mesh->positions, LEVEL, &limits, &count, &err), err)) {
        for (size_t i = 0; i < count; ++i) {
            bool corner = (limits[i].u == 0 || limits[i].u == 1) && (limits[i].v == 0 || limits[i].v == 1);
            if (corner || i % STRIDE == 0) compare_limit(mesh, &limits[i], t);
        }
        free(limits);
    }
    qp_mesh_free(mesh);
}

static void compare_random(void) {
    enum { SEEDS = CHECK_SANITIZED ? 4 : 8, FACES = 60 };
    tally adaptive[2] = {{0, 0, 0, 0, 0}, {0, 0, 0, 0, 0}};
    mask_tally masks = {0, 0, 0, 0, 0};
    for (unsigned i = 0; i < 2 * SEEDS; ++i) {
        qp_generate_options options = {.seed = 100 + i / 2, .faces = FACES, .sharpness = -1};
        qp_mesh *base;
        qp_error err = {0};
        if (!CHECK_OK(qp_mesh_generate(i % 2 ? "random-open" : "random-closed", &options, &base, &err), err))
            continue;
        for (unsigned rules = 0; rules < VARIANT_RULES; ++rules) {
            qp_mesh *mesh = variant_make(base, rules, 8.0f, &err);
            if (!CHECK(mesh != NULL)) continue;
            compare_adaptive(mesh, 10, 1, &adaptive[rules / 3 % 2]);
            qp_mesh_free(mesh);
            if (i < 8) compare_masks(base, rules, &masks);
        }
        qp_mesh_free(base);
    }
    judge("random meshes", "uniform", &adaptive[0]);
    judge("", "chaikin", &adaptive[1]);
    printf("%-42s %-8s %8lu points, %lu normals, %lu left out: position %.2e, normal %.2e\n",
           "random meshes, limit masks", "both", masks.checked, masks.normals, masks.unsettled, masks.worst,
           masks.worst_normal);
    CHECK(masks.checked > 10000 && masks.normals > 10000);
    CHECK_NEAR(masks.worst, 0, tolerance);
    CHECK_NEAR(masks.worst_normal, 0, 1e-6);
}

/* Vertices on creases of two non-manifold edges, fans beside such a crease, fans that only touch. */
static void compare_nonmanifold(void) {
    enum { CASES = CHECK_SANITIZED ? 8 : 60 };
    tally adaptive = {0, 0, 0, 0, 0};
    mask_tally masks = {0, 0, 0, 0, 0};
    for (uint32_t i = 0; i < CASES; ++i) {
        qp_random random = {i};
        qp_mesh *base;
        qp_error err = {0};
        if (!CHECK_OK(qp_stress_nonmanifold(&random, &base, &err), err)) continue;
        compare_adaptive(base, 6, 1, &adaptive);
        compare_masks(base, 1 + i % 2 + 3 * (i / 2 % 2), &masks);
        qp_mesh_free(base);
    }
    judge("non-manifold soups", "uniform", &adaptive);
    printf("%-42s %-8s %8lu points, %lu normals, %lu left out: position %.2e, normal %.2e\n",
           "non-manifold soups, limit masks", "both", masks.checked, masks.normals, masks.unsettled, masks.worst,
           masks.worst_normal);
    CHECK(masks.checked > 1000);
    CHECK_NEAR(masks.worst, 0, tolerance);
}

int main(void) {
    compare_random();
    compare_nonmanifold();
    const char *models = check_models();
    if (models) {
        char shapes[4096];
        snprintf(shapes, sizeof shapes, "%s/osd_shapes", models);
        CHECK(compare_folder(models) > 0);
        CHECK(compare_folder(shapes) > 0);
    } else {
        printf("models skipped: QUADPLAN_MODELS not set\n");
    }
    qp_reference_work_free(&work);
    return check_report();
}
