/* Tessellation factors from a tolerance: each patch says how many pieces it wants along u and v, an edge takes the larger wish of its
 * patches, and the triangles that come of it are checked; patches that are over ask for more. */
#include "host/frame/tolerance.h"
#include "host/frame/factors.h"
#include "host/frame/majorant.h"
#include "host/frame/tessellator.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FACTORS = 6, ROUNDS = 8, UNITS = 1 << 16, MOST_WORKERS = 65 };

/* Of the diagonal: what evaluation may be off by, large coordinates apart. */
static const double rounding[2] = {3e-7, 1e-13};

typedef struct wish {
    uint8_t u, v; /* pieces of the patch along u and v */
} wish;

typedef struct tolerance_work {
    const qp_surface *surface;
    qp_tessellation tess; /* edge_factors: those of the round */
    float *edge_factors;
    qp_patch_majorant *majorants;
    double target; /* in the units of the positions */
    uint32_t most; /* largest factor */
    wish *wishes;  /* [n_patches] */
    double *gaps;  /* [2 * n_patches] of u and v with the factors of the round */
} tolerance_work;

/* ---- Wishes ---- */

static double uniform_gap(const qp_majorant *m, uint32_t n) {
    double most = 0;
    for (uint32_t i = 0; i < n; ++i)
        most = fmax(most, qp_majorant_gap(m, (double)i / n, (double)(i + 1) / n));
    return most;
}

/* The least number of pieces with a gap within `target`; `most` where none is. */
static uint32_t pieces_for(const qp_majorant *m, double target, uint32_t most) {
    uint32_t low = 0, high = most; /* low is too few */
    while (high - low > 1) {
        const uint32_t middle = (low + high) / 2;
        if (uniform_gap(m, middle) <= target)
            high = middle;
        else
            low = middle;
    }
    return high;
}

/* The product of both numbers is about least when each takes half of the error (gaps go as their inverse squares). What one leaves the
 * other may use. */
static wish first_wish(const tolerance_work *w, const qp_patch_majorant *m) {
    /* The tessellator rounds to 16 bits: a little wider triangles. */
    const double target = (w->target - m->rest) * (1 - 2e-3);
    uint32_t u = pieces_for(&m->u, 0.5 * target, w->most);
    const uint32_t v = pieces_for(&m->v, target - uniform_gap(&m->u, u), w->most);
    u = pieces_for(&m->u, target - uniform_gap(&m->v, v), w->most);
    return (wish){(uint8_t)u, (uint8_t)v};
}

static void wish_some(void *context, size_t begin, size_t end, unsigned worker) {
    tolerance_work *w = context;
    (void)worker;
    for (size_t p = begin; p < end; ++p) {
        if (w->surface->patch_plan[p] != QP_NONE) w->wishes[p] = first_wish(w, &w->majorants[p]);
    }
}

static void raise_edge(const tolerance_work *w, uint32_t edge, uint32_t factor) {
    const float f = (float)(factor < w->most ? factor : w->most);
    if (w->edge_factors[edge] < f) w->edge_factors[edge] = f;
}

/* Edges from wishes. A child of an n-gon has half of the edge before its corner along v and half of the one after it along u. */
static void set_edges(const tolerance_work *w) {
    const qp_mesh *mesh = w->surface->mesh;
    for (uint32_t e = 0; e < mesh->n_edges; ++e) w->edge_factors[e] = 1;
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        const uint32_t first = mesh->face_offsets[f], n = qp_face_size(mesh, f),
                       patch = mesh->patch_offsets[f];
        if (w->surface->patch_plan[patch] == QP_NONE) continue;
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t edge = mesh->corner_edge[first + i],
                           before = mesh->corner_edge[first + (i + n - 1) % n];
            if (n == 4) {
                raise_edge(w, edge, i % 2 == 0 ? w->wishes[patch].u : w->wishes[patch].v);
            } else {
                raise_edge(w, edge, 2u * w->wishes[patch + i].u);
                raise_edge(w, before, 2u * w->wishes[patch + i].v);
            }
        }
    }
}

/* ---- The triangles' bounds ---- */

/* Factors of a part, to be sorted so that equal ones are tessellated once. */
typedef struct part_key {
    float factors[FACTORS];
    uint32_t patch;
    uint32_t quarter; /* or 4: the whole patch */
} part_key;

static int compare_factors(const void *a, const void *b) {
    return memcmp(((const part_key *)a)->factors, ((const part_key *)b)->factors,
                  sizeof((part_key *)0)->factors);
}

/* Ranges of u, or v, of a grid's triangles: those that no other contains. */
typedef struct ranges {
    size_t count;
    double *list; /* begin, end */
    size_t capacity;
} ranges;

typedef struct check_worker {
    qp_tess_grid grid;
    uint32_t *end_of; /* [UNITS + 1] by where a range begins; 0: none does */
    ranges u, v;
    bool failed;
} check_worker;

typedef struct check_job {
    tolerance_work *work;
    const part_key *parts;
    size_t *runs;      /* [n_runs + 1] first part of each run of equal factors */
    double *part_gaps; /* [2 * parts] */
    check_worker workers[MOST_WORKERS];
} check_job;

static bool find_ranges(check_worker *w, uint32_t axis, ranges *found) {
    const qp_tess_grid *g = &w->grid;
    memset(w->end_of, 0, (UNITS + 1) * sizeof *w->end_of);
    for (size_t t = 0; t < g->n_triangles; ++t) {
        uint32_t low = UNITS, high = 0;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t x = (uint32_t)(g->uv[2 * (size_t)g->triangles[3 * t + k] + axis] * UNITS + 0.5f);
            if (x < low) low = x;
            if (x > high) high = x;
        }
        if (w->end_of[low] < high) w->end_of[low] = high;
    }
    found->count = 0;
    uint32_t reached = 0;
    for (uint32_t low = 0; low <= UNITS; ++low) {
        if (w->end_of[low] <= reached) continue;
        reached = w->end_of[low];
        if (!qp_grow((void **)&found->list, &found->capacity, 2 * (found->count + 1), sizeof *found->list))
            return false;
        found->list[2 * found->count] = (double)low / UNITS;
        found->list[2 * found->count++ + 1] = (double)reached / UNITS;
    }
    return true;
}

static double largest_gap(const qp_majorant *m, const ranges *r, double add, double scale) {
    double most = 0;
    for (size_t i = 0; i < r->count; ++i)
        most = fmax(most,
                    qp_majorant_gap(m, scale * (r->list[2 * i] + add), scale * (r->list[2 * i + 1] + add)));
    return most;
}

static void check_runs(void *context, size_t begin, size_t end, unsigned worker) {
    check_job *job = context;
    check_worker *w = &job->workers[worker];
    for (size_t r = begin; r < end && !w->failed; ++r) {
        const float *f = job->parts[job->runs[r]].factors;
        if (w->end_of == NULL) w->end_of = qp_alloc(UNITS + 1, sizeof *w->end_of, false);
        if (w->end_of == NULL || qp_tessellate(job->work->tess.spacing, f, f + 4, &w->grid, NULL) != QP_OK ||
            !find_ranges(w, 0, &w->u) || !find_ranges(w, 1, &w->v)) {
            w->failed = true;
            return;
        }
        for (size_t i = job->runs[r]; i < job->runs[r + 1]; ++i) {
            const part_key *part = &job->parts[i];
            const qp_patch_majorant *m = &job->work->majorants[part->patch];
            const bool whole = part->quarter == 4;
            const double scale = whole ? 1 : 0.5;
            job->part_gaps[2 * i] = largest_gap(&m->u, &w->u, whole ? 0 : part->quarter & 1u, scale);
            job->part_gaps[2 * i + 1] = largest_gap(&m->v, &w->v, whole ? 0 : part->quarter >> 1, scale);
        }
    }
}

static bool run_check(tolerance_work *w, const part_key *parts, size_t n_parts) {
    check_job *job = qp_alloc(1, sizeof *job, true);
    bool ok = job != NULL;
    size_t n_runs = 0;
    if (ok) {
        *job = (check_job){.work = w, .parts = parts};
        job->runs = qp_alloc(n_parts + 1, sizeof *job->runs, false);
        job->part_gaps = qp_alloc(2 * n_parts, sizeof *job->part_gaps, true);
        ok = job->runs != NULL && job->part_gaps != NULL;
    }
    if (ok) {
        for (size_t i = 0; i < n_parts; ++i)
            if (i == 0 || compare_factors(&parts[i - 1], &parts[i]) != 0) job->runs[n_runs++] = i;
        job->runs[n_runs] = n_parts;
        qp_parallel(n_runs, 4, check_runs, job);
        for (unsigned i = 0; i < MOST_WORKERS; ++i) {
            ok = ok && !job->workers[i].failed;
            qp_tess_grid_free(&job->workers[i].grid);
            free(job->workers[i].end_of);
            free(job->workers[i].u.list);
            free(job->workers[i].v.list);
        }
    }
    /* The largest of a patch's parts; where the whole is one part, that one's. */
    for (size_t i = 0; ok && i < 2 * n_parts; ++i) {
        double *gap = &w->gaps[2 * (size_t)parts[i / 2].patch + i % 2];
        *gap = fmax(*gap, job->part_gaps[i]);
    }
    if (job != NULL) {
        free(job->runs);
        free(job->part_gaps);
    }
    free(job);
    return ok;
}

/* Sets the gaps of every patch for the edge factors at hand. */
static qp_status check_triangles(tolerance_work *w, qp_error *err) {
    const uint32_t n = w->surface->mesh->n_patches;
    qp_part_factors factors;
    qp_status status = qp_factors_make(w->surface, &w->tess, &factors, err);
    if (status != QP_OK) return status;
    const size_t n_parts = (size_t)factors.first[n];
    part_key *parts = qp_alloc(n_parts, sizeof *parts, false);
    bool ok = parts != NULL;
    for (uint32_t p = 0; ok && p < n; ++p) {
        const uint64_t first = factors.first[p], end = factors.first[p + 1];
        for (uint64_t i = first; i < end; ++i) {
            memcpy(parts[i].factors, factors.values + FACTORS * i, sizeof parts[i].factors);
            parts[i].patch = p;
            parts[i].quarter = end - first == 1 ? 4 : (uint32_t)(i - first);
        }
        w->gaps[2 * (size_t)p] = w->gaps[2 * (size_t)p + 1] = 0;
    }
    qp_factors_free(&factors);
    if (ok) {
        qsort(parts, n_parts, sizeof *parts, compare_factors);
        ok = run_check(w, parts, n_parts);
    }
    free(parts);
    return ok ? QP_OK : qp_fail_memory(err, n_parts * sizeof *parts, "tessellation factors");
}

/* ---- Rounds ---- */

static double patch_bound(const tolerance_work *w, uint32_t patch) {
    return w->gaps[2 * (size_t)patch] + w->gaps[2 * (size_t)patch + 1] + w->majorants[patch].rest;
}

/* Patches over the target wish for more, along the direction that errs more. False where none can. */
static bool raise_wishes(const tolerance_work *w) {
    const qp_mesh *mesh = w->surface->mesh;
    bool raised = false;
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        const uint32_t most = qp_face_size(mesh, f) == 4 ? w->most : (w->most + 1) / 2;
        for (uint32_t p = mesh->patch_offsets[f]; p < mesh->patch_offsets[f + 1]; ++p) {
            wish *now = &w->wishes[p];
            if (w->surface->patch_plan[p] == QP_NONE || patch_bound(w, p) <= w->target) continue;
            const bool u_can = now->u < most, v_can = now->v < most;
            if (!u_can && !v_can) continue;
            uint8_t *which =
                u_can && (!v_can || w->gaps[2 * (size_t)p] >= w->gaps[2 * (size_t)p + 1]) ? &now->u : &now->v;
            const uint32_t more = *which + 1u + *which / 16u;
            *which = (uint8_t)(more < most ? more : most);
            raised = true;
        }
    }
    return raised;
}

static qp_status choose(tolerance_work *w, qp_error *err) {
    qp_parallel(w->surface->mesh->n_patches, 64, wish_some, w);
    qp_status status = QP_OK;
    for (int round = 0; status == QP_OK; ++round) {
        set_edges(w);
        status = check_triangles(w, err);
        if (round == ROUNDS || (status == QP_OK && !raise_wishes(w))) break;
    }
    return status;
}

static void summarise(const tolerance_work *w, double lost, qp_tolerance_report *report) {
    const qp_mesh *mesh = w->surface->mesh;
    const double diagonal = mesh->diagonal;
    double sum = 0;
    uint64_t count = 0;
    for (uint32_t p = 0; p < mesh->n_patches; ++p) {
        if (w->surface->patch_plan[p] == QP_NONE) continue;
        /* The last digits of the sums above are no part of the proof. */
        const double bound = patch_bound(w, p) * (1 + 1e-9);
        report->over += bound + lost > w->tess.tolerance * diagonal;
        report->bound = fmax(report->bound, (bound + lost) / diagonal);
    }
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        const float f = w->edge_factors[mesh->corner_edge[h]];
        if (w->surface->patch_plan[mesh->patch_offsets[mesh->corner_face[h]]] == QP_NONE) continue;
        report->factor_min = count == 0 || f < report->factor_min ? f : report->factor_min;
        report->factor_max = f > report->factor_max ? f : report->factor_max;
        sum += (double)f;
        ++count;
    }
    report->factor_mean = count != 0 ? (float)(sum / (double)count) : 0;
}

double qp_tolerance_rounding(const qp_mesh *mesh, qp_precision precision) {
    double farthest = 0;
    for (int x = 0; x < 3; ++x)
        farthest = fmax(farthest, fmax(fabs(mesh->box_min[x]), fabs(mesh->box_max[x])));
    return rounding[precision == QP_DOUBLE] * mesh->diagonal +
           (precision == QP_DOUBLE ? DBL_EPSILON : (double)FLT_EPSILON) * farthest;
}

qp_status qp_tolerance_factors(const qp_surface *surface, const qp_tessellation *tess, qp_precision precision,
                               float *edge_factors, qp_tolerance_report *report, qp_error *err) {
    const qp_mesh *mesh = surface->mesh;
    *report = (qp_tolerance_report){0};
    if (!(tess->tolerance > 0) || isinf(tess->tolerance))
        return qp_fail(err, QP_BAD_INPUT, "tolerance %g is not a positive number", tess->tolerance);
    if (tess->factor != 0 && !(tess->factor >= 1 && tess->factor <= 64))
        return qp_fail(err, QP_BAD_INPUT, "tessellation factor %g is not between 1 and 64",
                       (double)tess->factor);
    const double lost = qp_tolerance_rounding(mesh, precision);
    tolerance_work w = {.surface = surface,
                        .tess = *tess,
                        .edge_factors = edge_factors,
                        .target = (tess->tolerance * mesh->diagonal - lost) / (1 + 1e-9),
                        .most = tess->factor != 0 ? (uint32_t)tess->factor : 64};
    w.tess.patch_factors = NULL;
    w.tess.edge_factors = edge_factors;
    w.wishes = qp_alloc(mesh->n_patches, sizeof *w.wishes, true);
    w.gaps = qp_alloc(2 * (size_t)mesh->n_patches, sizeof *w.gaps, true);
    qp_status status = QP_OK;
    if (w.wishes == NULL || w.gaps == NULL)
        status = qp_fail_memory(err, mesh->n_patches * sizeof *w.gaps, "tessellation factors");
    if (status == QP_OK) status = qp_majorants_make(surface, &w.majorants, err);
    if (status == QP_OK) status = choose(&w, err);
    if (status == QP_OK) summarise(&w, lost, report);
    qp_majorants_free(w.majorants, mesh->n_patches);
    free(w.wishes);
    free(w.gaps);
    return status;
}
