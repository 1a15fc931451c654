/* Shallow plans for points that may be off by a tolerance.
 *
 * Below its last ring a plan goes on in that ring with the corner's dominant eigenvalue r (kernels/plan_layout.h, EXTRAORDINARY): a
 * sample m levels farther down is limit + r^m (p - limit). The true surface there is a spline of the same kind with the points of the
 * ring m levels down, so both differ by at most the largest difference between r^m times an offset of the last ring and the offset at the
 * same place of that ring (convex hull property). All else in a plan is exact. The surface's own plan has those rings; past its last
 * one offsets are taken to shrink by 0.7 a level or faster (majorant.c). */
#include "host/frame/frame.h"
#include "host/frame/patch_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_WORKERS = 65, MOST_TAILS = 4, UNSETTLED = QP_LIGHT_NONE };
static const double SHRINK = 0.7;

/* Where a plan ends in an extraordinary corner. */
typedef struct tail {
    double u, v; /* the cell's place in the plan */
    int level;   /* of its last ring */
    const uint32_t *terminal, *node;
} tail;

typedef struct tails {
    uint32_t count;
    tail list[MOST_TAILS];
    bool good; /* every end of the plan is in the list, with a ring before it */
} tails;

static void find_tails(const qp_plan *plan, uint32_t at, double u, double v, int level,
                       const uint32_t *terminal, tails *found) {
    const uint32_t *node = plan->tree + at;
    const double half = ldexp(0.5, -level);
    switch (QP_NODE_KIND(node[0])) {
    case QP_NODE_INTERNAL:
        for (uint32_t child = 0; child < 4; ++child)
            find_tails(plan, node[1 + child], u + half * (child & 1u), v + half * (child >> 1), level + 1,
                       NULL, found);
        return;
    case QP_NODE_TERMINAL: {
        /* The corner that is (0,0) after the rotation: 0 is (0,0), 1 (1,0), 2 (1,1), 3 (0,1). */
        const uint32_t corner = QP_NODE_ROTATION(node[0]);
        const int last = level + (int)QP_NODE_RINGS(node[0]);
        const double rest = 2 * half - ldexp(1.0, -last);
        find_tails(plan, node[2], u + (corner == 1 || corner == 2 ? rest : 0), v + (corner >= 2 ? rest : 0),
                   last, node, found);
        return;
    }
    case QP_NODE_EXTRAORDINARY:
        found->good =
            found->good && terminal != NULL && QP_NODE_RINGS(terminal[0]) > 0 && found->count < MOST_TAILS;
        if (found->good) found->list[found->count++] = (tail){u, v, level, terminal, node};
        return;
    case QP_NODE_IRREGULAR:
        found->good = false;
        return;
    default:
        return;
    }
}

static tails tails_of(const qp_plan *plan) {
    tails found = {.good = true};
    find_tails(plan, 0, 0, 0, 0, NULL, &found);
    return found;
}

static double norm(const double *d) {
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Largest of |factor times a ring's offsets less those of another ring|; without `other`, of the first alone. */
static double ring_difference(const qp_patch_points *p, const tail *t, uint32_t ring, double factor,
                              const qp_patch_points *other, const tail *o, uint32_t other_ring) {
    double most = 0;
    for (uint32_t k = 0; k < 24; ++k) {
        double d[3], e[3] = {0, 0, 0};
        qp_patch_offset(p, t->terminal, t->node, ring, k, d);
        if (other != NULL) qp_patch_offset(other, o->terminal, o->node, other_ring, k, e);
        for (int x = 0; x < 3; ++x) d[x] = factor * d[x] - e[x];
        most = fmax(most, norm(d));
    }
    return most;
}

static double ratio_of(const qp_plan *plan, const tail *t) {
    return plan->constants[t->node[4] - qp_plan_first_constant(plan)];
}

/* What a tail is off by, given the deeper plan's tail at the same corner; infinite where they do not match. */
static double tail_error(const qp_patch_points *light, const tail *t, const qp_patch_points *deep,
                         const tail *d, bool settled) {
    const uint32_t last = QP_NODE_RINGS(t->terminal[0]) - 1, rings = QP_NODE_RINGS(d->terminal[0]);
    const int more = d->level - t->level;
    if (more < 0 || (uint32_t)more >= rings ||
        QP_NODE_ROTATION(d->terminal[0]) != QP_NODE_ROTATION(t->terminal[0]))
        return INFINITY;
    const double r = ratio_of(light->plan, t);
    double factor = 1, error = 0;
    for (int m = 1; m <= more; ++m) {
        factor *= r;
        error =
            fmax(error, ring_difference(light, t, last, factor, deep, d, rings - 1 - (uint32_t)(more - m)));
    }
    if (settled && rings > 1) {
        /* By as much as the two last rings do not go on with r, the ones below do not either, less and less: what sums up is at most
         * (sum of r^i 0.7^(j-i), no more than 1.5) times that. */
        return fmax(error, r * ring_difference(light, t, last, factor, deep, d, rings - 1) +
                               1.5 * ring_difference(deep, d, rings - 2, r, deep, d, rings - 1));
    }
    return fmax(error, ring_difference(light, t, last, factor * r, NULL, NULL, 0) +
                           ring_difference(deep, d, rings - 1, SHRINK, NULL, NULL, 0));
}

/* Of a plan, given the surface's own one. */
static double plan_error(const qp_patch_points *light, const qp_patch_points *deep, bool settled) {
    const tails a = tails_of(light->plan), b = tails_of(deep->plan);
    double most = 0;
    if (!a.good || !b.good || a.count > b.count) return INFINITY;
    for (uint32_t i = 0; i < a.count; ++i) {
        double error = INFINITY;
        for (uint32_t j = 0; j < b.count; ++j) {
            /* The deeper cell lies in the other one, at its corner. */
            const double size = ldexp(1.0, -a.list[i].level), du = b.list[j].u - a.list[i].u,
                         dv = b.list[j].v - a.list[i].v;
            if (du >= 0 && du < size && dv >= 0 && dv < size)
                error = tail_error(light, &a.list[i], deep, &b.list[j], settled);
        }
        most = fmax(most, error);
    }
    return most;
}

typedef struct light_job {
    const qp_frame *frame;
    const qp_surface *surface; /* whose plans are tried */
    uint8_t step;
    double target;
    uint8_t *light;
    double *errors; /* [n_patches] */
    struct {
        qp_patch_points light, deep;
        bool failed;
    } workers[MOST_WORKERS];
} light_job;

static void try_some(void *context, size_t begin, size_t end, unsigned worker) {
    light_job *job = context;
    qp_patch_points *light = &job->workers[worker].light, *deep = &job->workers[worker].deep;
    for (size_t p = begin; p < end && !job->workers[worker].failed; ++p) {
        if (job->light[p] != UNSETTLED || job->surface->patch_plan[p] == QP_NONE) continue;
        if (!qp_patch_points_make(job->frame->surface, (uint32_t)p, deep) ||
            (job->step != 0 && !qp_patch_points_make(job->surface, (uint32_t)p, light))) {
            job->workers[worker].failed = true;
            return;
        }
        const double error =
            plan_error(job->step == 0 ? deep : light, deep,
                       qp_patch_settles(job->frame->surface->mesh, (uint32_t)p, deep->plan->depth));
        if (!(error <= job->target)) continue;
        job->light[p] = job->step;
        job->errors[p] = error;
    }
}

static qp_status try_step(light_job *job, uint8_t step, qp_error *err) {
    const uint32_t n = job->frame->surface->mesh->n_patches;
    job->step = step;
    job->surface = step == 0 ? job->frame->surface : job->frame->deep[step - 1];
    if (job->surface == NULL) return QP_OK; /* no patch is left */
    qp_parallel(n, 16, try_some, job);
    bool failed = false;
    for (unsigned i = 0; i < MOST_WORKERS; ++i) {
        failed = failed || job->workers[i].failed;
        qp_patch_points_free(&job->workers[i].light);
        qp_patch_points_free(&job->workers[i].deep);
    }
    return failed ? qp_fail_memory(err, n, "shallower plans") : QP_OK;
}

/* The shallowest step that is within the target for each patch that has a tail; patches without one stay with the surface's plan. */
static qp_status choose(qp_frame *frame, light_job *job, bool *changed, qp_error *err) {
    const qp_surface *surface = frame->surface;
    const uint32_t n = surface->mesh->n_patches;
    qp_status status = QP_OK;
    for (uint32_t p = 0; p < n; ++p) {
        const bool has = surface->patch_plan[p] != QP_NONE &&
                         (surface->plans[surface->patch_plan[p]]->flags & QP_PLAN_CORNERS) != 0;
        job->light[p] = has ? UNSETTLED : 0;
    }
    for (uint8_t step = QP_DEEP_STEPS + 1; step <= QP_PLAN_STEPS && status == QP_OK; ++step) {
        if (qp_step_level(step) >= surface->options.depth) break;
        for (uint32_t p = 0; p < n; ++p) frame->patch_step[p] = job->light[p] == UNSETTLED ? step : 0;
        status = qp_frame_grow_step(frame, step, changed, err);
        if (status == QP_OK) status = try_step(job, step, err);
    }
    return status == QP_OK ? try_step(job, 0, err) : status;
}

qp_status qp_frame_choose_light(qp_frame *frame, bool *changed, qp_error *err) {
    const qp_mesh *mesh = frame->surface->mesh;
    if (frame->light != NULL) return QP_OK;
    const double lost = qp_tolerance_rounding(mesh, frame->options.precision);
    light_job *job = qp_alloc(1, sizeof *job, true);
    uint8_t *light = qp_alloc(mesh->n_patches, 1, false);
    double *errors = qp_alloc(mesh->n_patches, sizeof *errors, true);
    qp_status status = QP_OK;
    if (job == NULL || light == NULL || errors == NULL) {
        status = qp_fail_memory(err, mesh->n_patches * sizeof *errors, "shallower plans");
    } else {
        job->frame = frame;
        job->target = frame->options.tolerance * mesh->diagonal - lost;
        job->light = light;
        job->errors = errors;
        status = choose(frame, job, changed, err);
    }
    if (status == QP_OK) {
        double most = 0;
        for (uint32_t p = 0; p < mesh->n_patches; ++p) most = fmax(most, errors[p]);
        frame->light = light;
        frame->light_bound = (most * (1 + 1e-9) + lost) / mesh->diagonal;
        light = NULL;
    }
    free(job);
    free(light);
    free(errors);
    return status;
}
