/* The measure of stress cases. */
#include "host/reference/stress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "host/reference/eval.h"

/* A worker's buffers and its first error. */
typedef struct stress_worker {
    qp_reference_work work;
    double *uv;
    size_t uv_capacity;
    double
        *positions; /* of the whole mesh; those about the patch at hand are a unit in the last place away */
    qp_reference_sample *samples, *moved;
    size_t sample_capacity, moved_capacity;
    qp_error error;
} stress_worker;

typedef struct stress {
    const qp_stress_case *tried;
    uint32_t number;
    const qp_stream *stream;
    qp_local_frame frame;
    uint64_t *first, *order; /* samples of patch p: order[first[p] .. first[p + 1]) */
    qp_stress_sample *results;
    bool *well; /* conditioned, of a normal that is worth asking about */
    stress_worker *workers;
} stress;

/* A unit in the last place of x in the precision. */
static double unit_in_last_place(double x, qp_precision precision) {
    const int digits = precision == QP_FLOAT ? 23 : 52, least = precision == QP_FLOAT ? -149 : -1074;
    const int power = x == 0 ? least : ilogb(x) - digits;
    return ldexp(1, power > least ? power : least);
}

/* Calls visit with every corner of the faces that touch the patch's base face: each vertex of its 1-ring at least once. */
static void visit_ring(const qp_mesh *m, uint32_t patch, void (*visit)(void *context, uint32_t vertex),
                       void *context) {
    const uint32_t face = qp_patch_face(m, patch, NULL);
    for (uint32_t c = m->face_offsets[face]; c < m->face_offsets[face + 1]; ++c) {
        const uint32_t v = m->face_vertices[c];
        for (uint32_t i = m->vertex_offsets[v]; i < m->vertex_offsets[v + 1]; ++i) {
            const uint32_t f = m->corner_face[m->vertex_corners[i]];
            for (uint32_t h = m->face_offsets[f]; h < m->face_offsets[f + 1]; ++h)
                visit(context, m->face_vertices[h]);
        }
    }
}

/* Largest absolute coordinates of a 1-ring, an axis at a time, and of what the device holds of them. */
typedef struct ring_size {
    const qp_mesh *mesh;
    const qp_local_frame *frame;
    double most[3], held[3];
} ring_size;

static void measure_vertex(void *context, uint32_t vertex) {
    ring_size *ring = context;
    for (size_t k = 0; k < 3; ++k) {
        const double x = ring->mesh->positions[3 * (size_t)vertex + k];
        ring->most[k] = fmax(ring->most[k], fabs(x));
        ring->held[k] = fmax(ring->held[k], fabs(x - ring->frame->centre[k]));
    }
}

/* A vertex moved by a unit in the last place of the largest coordinate of the ring. */
typedef struct ring_move {
    const qp_mesh *mesh;
    double *positions, unit[3];
} ring_move;

static void move_vertex(void *context, uint32_t vertex) {
    const ring_move *move = context;
    qp_random random = {vertex}; /* the same however often the vertex comes */
    for (size_t k = 0; k < 3; ++k) {
        const size_t i = 3 * (size_t)vertex + k;
        const double x = move->mesh->positions[i], unit = move->unit[k];
        move->positions[i] = qp_random_chance(&random, 0.5) ? x + unit : x - unit;
    }
}

static void read_vertex(const qp_stream *stream, uint64_t i, double out[6]) {
    for (size_t c = 0; c < 6; ++c)
        out[c] = stream->precision == QP_FLOAT ? (double)((const float *)stream->vertices)[6 * i + c]
                                               : ((const double *)stream->vertices)[6 * i + c];
}

/* Degrees between two directions; 180 when one is none. */
static double angle(const double a[3], const double b[3]) {
    const double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const double sine = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    return sine == 0 && dot == 0 ? 180 : atan2(sine, dot) * 57.29577951308232;
}

/* Normals that are off by no more are as good as the coordinates. */
static double normal_limit(qp_precision precision) {
    return precision == QP_FLOAT ? 1e-3 : 1e-11;
}

static void measure_sample(const stress *s, uint64_t i, const double most[3],
                           const qp_reference_sample *ref) {
    const qp_precision precision = s->stream->precision;
    qp_stress_sample *r = &s->results[i];
    *r = (qp_stress_sample){.number = s->number,
                            .patch = s->tried->patch[i],
                            .uv = {s->tried->uv[2 * i], s->tried->uv[2 * i + 1]},
                            .flags = s->stream->flags[i],
                            .finite = true};
    read_vertex(s->stream, i, r->got);
    memcpy(r->p, ref->p, sizeof r->p);
    memcpy(r->n, ref->n, sizeof r->n);
    for (int c = 0; c < 6; ++c) r->finite = r->finite && isfinite(r->got[c]);
    if (!r->finite) return;
    for (int k = 0; k < 3; ++k) {
        const double error = (r->got[k] - ref->p[k]) - ref->p_rest[k];
        r->ulp = fmax(r->ulp, fabs(error) / unit_in_last_place(most[k], precision));
    }
    if (ref->normal_defined) r->normal_deg = angle(r->got + 3, ref->n);
}

/* The samples of one patch: measured, and those whose normal is off looked at again with positions moved. */
static qp_status stress_patch(const stress *s, uint32_t patch, stress_worker *w) {
    const qp_mesh *mesh = s->tried->mesh;
    const uint64_t *order = s->order + s->first[patch], count = s->first[patch + 1] - s->first[patch];
    if (count == 0) return QP_OK;
    if (!qp_grow((void **)&w->uv, &w->uv_capacity, 2 * count, sizeof *w->uv) ||
        !qp_grow((void **)&w->samples, &w->sample_capacity, count, sizeof *w->samples) ||
        !qp_grow((void **)&w->moved, &w->moved_capacity, count, sizeof *w->moved))
        return qp_fail_memory(&w->error, count * sizeof *w->samples, "the samples of a patch");
    for (uint64_t i = 0; i < count; ++i)
        memcpy(w->uv + 2 * i, s->tried->uv + 2 * order[i], 2 * sizeof *w->uv);
    qp_status status =
        qp_reference_eval_with(&w->work, mesh, mesh->positions, patch, count, w->uv, w->samples, &w->error);
    if (status != QP_OK) return status;
    ring_size ring = {.mesh = mesh, .frame = &s->frame};
    uint64_t asked = 0;
    visit_ring(mesh, patch, measure_vertex, &ring);
    for (uint64_t i = 0; i < count; ++i) {
        const qp_stress_sample *r = &s->results[order[i]];
        measure_sample(s, order[i], ring.most, &w->samples[i]);
        if (!r->finite || w->samples[i].condition > QP_WELL_CONDITIONED) continue;
        s->well[order[i]] = r->normal_deg <= normal_limit(s->stream->precision);
        if (s->well[order[i]]) continue;
        memmove(w->uv + 2 * asked, w->uv + 2 * i, 2 * sizeof *w->uv);
        ++asked;
    }
    if (asked == 0) return QP_OK;
    if (w->positions == NULL) {
        w->positions = qp_alloc(mesh->n_vertices, 3 * sizeof(double), true);
        if (w->positions == NULL) return qp_fail_memory(&w->error, mesh->n_vertices * 24u, "positions");
    }
    ring_move move = {.mesh = mesh, .positions = w->positions};
    for (int k = 0; k < 3; ++k) move.unit[k] = unit_in_last_place(ring.held[k], s->stream->precision);
    visit_ring(mesh, patch, move_vertex, &move);
    status = qp_reference_eval_with(&w->work, mesh, w->positions, patch, asked, w->uv, w->moved, &w->error);
    if (status != QP_OK) return status;
    for (uint64_t i = 0, at = 0; i < count; ++i) {
        const qp_stress_sample *r = &s->results[order[i]];
        if (!r->finite || w->samples[i].condition > QP_WELL_CONDITIONED || s->well[order[i]]) continue;
        const qp_reference_sample *moved = &w->moved[at++];
        s->well[order[i]] =
            moved->normal_defined && angle(moved->n, r->n) <= normal_limit(s->stream->precision);
    }
    return QP_OK;
}

static void stress_range(void *context, size_t begin, size_t end, unsigned worker) {
    const stress *s = context;
    stress_worker *w = &s->workers[worker];
    for (size_t p = begin; p < end; ++p)
        if (w->error.status != QP_OK || stress_patch(s, (uint32_t)p, w) != QP_OK) return;
}

/* Counting sort of the samples by patch. */
static void sort_samples(stress *s) {
    const qp_stress_case *t = s->tried;
    for (uint64_t i = 0; i < t->count; ++i) s->first[t->patch[i] + 1]++;
    for (uint32_t p = 0; p < t->mesh->n_patches; ++p) s->first[p + 1] += s->first[p];
    for (uint64_t i = 0; i < t->count; ++i) s->order[s->first[t->patch[i]]++] = i;
    /* Each start has moved to its patch's end: move all by one. */
    memmove(s->first + 1, s->first, t->mesh->n_patches * sizeof *s->first);
    s->first[0] = 0;
}

static void add_sample(qp_stress_report *report, const qp_stress_sample *r, bool well) {
    const bool flagged = r->flags & QP_SAMPLE_NO_NORMAL, past = r->flags & QP_SAMPLE_PAST_DEPTH;
    const bool defined = r->n[0] != 0 || r->n[1] != 0 || r->n[2] != 0;
    report->samples++;
    if (!r->finite) {
        if (report->nonfinite++ == 0) report->worst = *r;
        return;
    }
    const double *n = r->got + 3, length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    report->normals_not_unit += !(fabs(length - 1) <= 1e-6);
    report->no_normal += flagged;
    report->past_depth += past;
    if (past) return;
    if (r->ulp > report->worst_ulp) {
        report->worst_ulp = r->ulp;
        if (report->nonfinite == 0) report->worst = *r;
    }
    if (flagged && well && report->normals_missing++ == 0) report->missing = *r;
    report->normals_ill += !flagged && defined && !well;
    if (!defined || !well || flagged || r->normal_deg <= report->worst_normal_deg) return;
    report->worst_normal_deg = r->normal_deg;
    report->worst_normal = *r;
}

static qp_status compare(const qp_stress_case *tried, uint32_t number, const qp_stream *stream,
                         qp_stress_report *report,
                         void (*each)(void *context, const qp_stress_sample *sample), void *context,
                         qp_error *err) {
    const qp_mesh *mesh = tried->mesh;
    const unsigned n_workers = qp_thread_count();
    stress s = {.tried = tried,
                .number = number,
                .stream = stream,
                .frame = qp_mesh_local_frame(mesh),
                .first = qp_alloc((size_t)mesh->n_patches + 1, sizeof(uint64_t), true),
                .order = qp_alloc(tried->count, sizeof(uint64_t), false),
                .results = qp_alloc(tried->count, sizeof(qp_stress_sample), true),
                .well = qp_alloc(tried->count, sizeof(bool), true),
                .workers = qp_alloc(n_workers, sizeof(stress_worker), true)};
    qp_status status = QP_OK;
    if (!s.first || !s.order || !s.results || !s.well || !s.workers)
        status = qp_fail_memory(err, tried->count * sizeof(qp_stress_sample), "the samples of a case");
    if (status == QP_OK) {
        sort_samples(&s);
        qp_parallel(mesh->n_patches, 1, stress_range, &s);
    }
    for (unsigned w = 0; w < n_workers && s.workers; ++w) {
        const qp_error *e = &s.workers[w].error;
        if (status == QP_OK && e->status != QP_OK) status = qp_fail(err, e->status, "%s", e->message);
        qp_reference_work_free(&s.workers[w].work);
        free(s.workers[w].uv);
        free(s.workers[w].samples);
        free(s.workers[w].moved);
        free(s.workers[w].positions);
    }
    for (uint64_t i = 0; i < tried->count && status == QP_OK; ++i) {
        add_sample(report, &s.results[i], s.well[i]);
        if (each != NULL) each(context, &s.results[i]);
    }
    free(s.first);
    free(s.order);
    free(s.results);
    free(s.well);
    free(s.workers);
    return status;
}

qp_status qp_stress_measure(const qp_stress_case *tried, uint32_t number, qp_device *device,
                            qp_precision precision, qp_stress_report *report,
                            void (*each)(void *context, const qp_stress_sample *sample), void *context,
                            qp_error *err) {
    const qp_surface_options surface_options = {.depth = tried->depth};
    const qp_frame_options frame_options = {.precision = precision};
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream stream = {0};
    report->cases++;
    if (tried->count == 0) return QP_OK;
    qp_status status = qp_surface_create(tried->mesh, &surface_options, &surface, err);
    if (status == QP_OK) status = qp_frame_create(device, surface, &frame_options, &frame, err);
    if (status == QP_OK)
        status = qp_frame_eval_points(frame, tried->count, tried->patch, tried->uv, &stream, err);
    if (status == QP_OK) status = compare(tried, number, &stream, report, each, context, err);
    qp_frame_free(frame);
    qp_surface_free(surface);
    return status;
}
