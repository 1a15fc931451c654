#include "host/frame/grids.h"
#include "kernels/plan_layout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t slot_of(const qp_grids *grids, const float *factors) {
    return (size_t)qp_hash(factors, QP_GRID_FACTORS * sizeof(float), 0) & (grids->n_slots - 1);
}

static bool resize(qp_grids *grids, size_t n_slots) {
    uint32_t *slots = qp_alloc(n_slots, sizeof *slots, false);
    if (slots == NULL) return false;
    memset(slots, 0xff, n_slots * sizeof *slots);
    free(grids->slots);
    grids->slots = slots;
    grids->n_slots = n_slots;
    for (size_t i = 0; i < grids->count; ++i) {
        size_t s = slot_of(grids, grids->factors + QP_GRID_FACTORS * i);
        while (slots[s] != QP_NONE) s = (s + 1) & (n_slots - 1);
        slots[s] = (uint32_t)i;
    }
    return true;
}

uint32_t qp_grids_find(qp_grids *grids, const float factors[QP_GRID_FACTORS]) {
    const size_t bytes = QP_GRID_FACTORS * sizeof(float);
    if (2 * (grids->count + 1) > grids->n_slots &&
        !resize(grids, grids->n_slots == 0 ? 64 : 2 * grids->n_slots))
        return QP_NONE;
    size_t s = slot_of(grids, factors);
    for (; grids->slots[s] != QP_NONE; s = (s + 1) & (grids->n_slots - 1)) {
        if (memcmp(grids->factors + QP_GRID_FACTORS * (size_t)grids->slots[s], factors, bytes) == 0)
            return grids->slots[s];
    }
    if (!qp_grow((void **)&grids->factors, &grids->factor_capacity, QP_GRID_FACTORS * (grids->count + 1),
                 sizeof(float)) ||
        !qp_grow((void **)&grids->list, &grids->capacity, grids->count + 1, sizeof *grids->list))
        return QP_NONE;
    memcpy(grids->factors + QP_GRID_FACTORS * grids->count, factors, bytes);
    grids->list[grids->count] = (qp_grid){0};
    grids->slots[s] = (uint32_t)grids->count++;
    return grids->slots[s];
}

/* ---- Making them ---- */

typedef struct grid_job {
    qp_grids *grids;
    qp_error error; /* of one of the failures, if any */
    int failed;
} grid_job;

/* The points on the rim, which come first and run around counter-clockwise, whole patches assumed. Points behind those may lie on the
 * patch's edges as well, where an inner factor is 1; but a disc of P points with R of them on its rim has 2 P - 2 - R triangles. */
static qp_rim find_rim(const qp_tess_grid *grid) {
    if (grid->n_points == 0) return (qp_rim){0};
    qp_rim rim = {.count = 2 * grid->n_points - 2 - grid->n_triangles};
    for (uint32_t i = 0; i < rim.count; ++i) {
        const float u = grid->uv[2 * (size_t)i], v = grid->uv[2 * (size_t)i + 1];
        if ((u == 0 || u == 1) && (v == 0 || v == 1))
            rim.corner[v == 0 ? (u == 0 ? 0 : 1) : (u == 0 ? 3 : 2)] = i;
    }
    return rim;
}

/* From a quarter's (u,v) to its patch's; exact, for the tessellator's points are multiples of 2^-16. */
static void place_quarter(qp_tess_grid *grid, unsigned quarter) {
    const float add[2] = {(float)(quarter & 1u), (float)(quarter >> 1)};
    for (size_t i = 0; i < 2 * (size_t)grid->n_points; ++i) grid->uv[i] = 0.5f * (grid->uv[i] + add[i & 1u]);
}

static double nearest_to_corner(const qp_tess_grid *grid) {
    float nearest = 2;
    for (size_t i = 0; i < grid->n_points; ++i) {
        const float u = grid->uv[2 * i], v = grid->uv[2 * i + 1];
        const float du = u < 0.5f ? u : 1 - u, dv = v < 0.5f ? v : 1 - v, d = du > dv ? du : dv;
        if (d > 0 && d < nearest) nearest = d;
    }
    return (double)nearest;
}

static qp_status make_grid(const qp_grids *grids, size_t i, qp_error *err) {
    const float *f = grids->factors + QP_GRID_FACTORS * i;
    qp_grid *grid = &grids->list[i];
    qp_status status = qp_tessellate(grids->spacing, f, f + 4, &grid->tess, err);
    if (status != QP_OK) return status;
    grid->rim = find_rim(&grid->tess);
    if (f[6] < QP_GRID_WHOLE) place_quarter(&grid->tess, (unsigned)f[6]);
    grid->level = qp_tess_grid_level(&grid->tess);
    if (grid->level >= QP_LEVELS) grid->level = QP_LEVELS - 1;
    grid->nearest = nearest_to_corner(&grid->tess);
    if (!grids->triangles) {
        free(grid->tess.triangles);
        grid->tess.triangles = NULL;
        grid->tess.triangle_capacity = 0;
    }
    return QP_OK;
}

static void make_some(void *context, size_t begin, size_t end, unsigned worker) {
    grid_job *job = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        qp_error error;
        if (make_grid(job->grids, job->grids->made + i, &error) == QP_OK) continue;
        if (__atomic_exchange_n(&job->failed, 1, __ATOMIC_RELAXED) == 0) job->error = error;
        return;
    }
}

qp_status qp_grids_make(qp_grids *grids, qp_error *err) {
    grid_job job = {.grids = grids};
    qp_parallel(grids->count - grids->made, 16, make_some, &job);
    for (; grids->made < grids->count; ++grids->made) grids->points += grids->list[grids->made].tess.n_points;
    return job.failed ? qp_fail(err, job.error.status, "%s", job.error.message) : QP_OK;
}

void qp_grids_clear(qp_grids *grids) {
    for (size_t i = 0; i < grids->count; ++i) qp_tess_grid_free(&grids->list[i].tess);
    free(grids->factors);
    free(grids->list);
    free(grids->slots);
    *grids = (qp_grids){.spacing = grids->spacing, .triangles = grids->triangles};
}
