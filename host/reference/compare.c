/* Error of a vertex stream, as DESIGN.md, "Measuring", defines it. */
#include "host/reference/eval.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Patches a work item; partial reports are kept for each and added in order, so that the sums are the same
 * however many threads there are. */
enum { CHUNK = 16 };

/* What one work item found; rms fields of the report hold sums of squares. */
typedef struct partial {
    qp_error_report report;
    uint64_t positions, normals; /* measured */
} partial;

/* A worker's buffers and its first error. */
typedef struct worker_state {
    qp_reference_work work;
    double *uv;
    size_t uv_capacity;
    qp_reference_sample *samples;
    size_t sample_capacity;
    qp_error error;
} worker_state;

typedef struct compare {
    const qp_mesh *mesh;
    const qp_stream *stream;
    const double *uv;                      /* or NULL: the stream's */
    const qp_reference_sample *references; /* of every sample, or NULL: they are evaluated here */
    const double *positions;
    uint64_t *first, *order; /* samples of patch p: order[first[p] .. first[p + 1]) */
    partial *partials;
    worker_state *workers;
} compare;

static void read_vertex(const qp_stream *stream, uint64_t i, double out[6]) {
    for (int c = 0; c < 6; ++c)
        out[c] = stream->precision == QP_FLOAT ? (double)((const float *)stream->vertices)[6 * i + c]
                                               : ((const double *)stream->vertices)[6 * i + c];
}

static void read_uv(const compare *c, uint64_t i, double uv[2]) {
    for (uint64_t k = 0; k < 2; ++k)
        uv[k] = c->uv != NULL ? c->uv[2 * i + k] : (double)c->stream->uv[2 * i + k];
}

/* Degrees between two directions, accurate when small; 180 when a is no direction at all. */
static double angle(const double a[3], const double b[3]) {
    double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if (a[0] == 0 && a[1] == 0 && a[2] == 0) return 180;
    return atan2(sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]), dot) *
           57.29577951308232;
}

/* n: NULL where the sample is flagged as without one. */
static void measure_normal(const double *n, const qp_reference_sample *ref, uint32_t patch, const double *uv,
                           bool past, partial *to) {
    qp_error_report *r = &to->report;
    if (!ref->normal_defined) {
        r->normals_undefined++;
        return;
    }
    double degrees = n != NULL ? angle(n, ref->n) : 180;
    if (past) {
        r->past_normal_max_deg = fmax(r->past_normal_max_deg, degrees);
        return;
    }
    if (ref->condition > QP_WELL_CONDITIONED) {
        r->normals_ill++;
        r->ill_normal_max_deg = fmax(r->ill_normal_max_deg, degrees);
        r->ill_normal_deg_per_condition = fmax(r->ill_normal_deg_per_condition, degrees / ref->condition);
        return;
    }
    r->normal_rms_deg += degrees * degrees;
    to->normals++;
    if (degrees <= r->normal_max_deg) return;
    r->normal_max_deg = degrees;
    r->worst_normal_patch = patch;
    r->worst_normal_u = uv[0];
    r->worst_normal_v = uv[1];
}

static void measure(const compare *c, uint64_t i, const qp_reference_sample *ref, partial *to) {
    qp_error_report *r = &to->report;
    double uv[2];
    read_uv(c, i, uv);
    bool past = c->stream->flags[i] & QP_SAMPLE_PAST_DEPTH;
    double got[6], square = 0;
    read_vertex(c->stream, i, got);
    r->samples++;
    r->past_depth += past;
    for (int k = 0; k < 6; ++k)
        if (!isfinite(got[k])) {
            r->nonfinite++;
            return;
        }
    for (int k = 0; k < 3; ++k) square += (got[k] - ref->p[k]) * (got[k] - ref->p[k]);
    double distance = sqrt(square) / c->mesh->diagonal;
    uint32_t patch = c->stream->sample_patch[i];
    if (past) {
        r->past_position_max = fmax(r->past_position_max, distance);
    } else {
        r->position_rms += distance * distance;
        to->positions++;
        if (distance > r->position_max) {
            r->position_max = distance;
            r->worst_patch = patch;
            r->worst_u = uv[0];
            r->worst_v = uv[1];
        }
    }
    measure_normal(c->stream->flags[i] & QP_SAMPLE_NO_NORMAL ? NULL : got + 3, ref, patch, uv, past, to);
}

static qp_status compare_patch(compare *c, uint32_t patch, unsigned worker, partial *to) {
    worker_state *w = &c->workers[worker];
    uint64_t begin = c->first[patch], count = c->first[patch + 1] - begin;
    if (count == 0) return QP_OK;
    if (c->references != NULL) {
        for (uint64_t i = begin; i < begin + count; ++i)
            measure(c, c->order[i], &c->references[c->order[i]], to);
        return QP_OK;
    }
    if (!qp_grow((void **)&w->uv, &w->uv_capacity, 2 * count, sizeof *w->uv) ||
        !qp_grow((void **)&w->samples, &w->sample_capacity, count, sizeof *w->samples))
        return qp_fail_memory(&w->error, count * sizeof *w->samples, "the samples of a patch");
    for (uint64_t i = 0; i < count; ++i) read_uv(c, c->order[begin + i], w->uv + 2 * i);
    qp_status status =
        qp_reference_eval_with(&w->work, c->mesh, c->positions, patch, count, w->uv, w->samples, &w->error);
    for (uint64_t i = 0; i < count && !status; ++i) measure(c, c->order[begin + i], &w->samples[i], to);
    return status;
}

static void compare_range(void *context, size_t begin, size_t end, unsigned worker) {
    compare *c = context;
    for (size_t item = begin; item < end; ++item)
        for (size_t p = item * CHUNK; p < (item + 1) * CHUNK && p < c->mesh->n_patches; ++p)
            if (c->workers[worker].error.status ||
                compare_patch(c, (uint32_t)p, worker, &c->partials[item]) != QP_OK)
                return;
}

/* Counting sort of the samples by patch. */
static qp_status sort_samples(compare *c, qp_error *err) {
    const qp_stream *s = c->stream;
    uint32_t n = c->mesh->n_patches;
    for (uint64_t i = 0; i < s->n_samples; ++i) {
        if (s->sample_patch[i] >= n)
            return qp_fail(err, QP_BAD_INPUT, "a sample names patch %u of a mesh with %u", s->sample_patch[i],
                           n);
        c->first[s->sample_patch[i] + 1]++;
    }
    for (uint32_t p = 0; p < n; ++p) c->first[p + 1] += c->first[p];
    for (uint64_t i = 0; i < s->n_samples; ++i) c->order[c->first[s->sample_patch[i]]++] = i;
    /* Each start has moved to its patch's end: move all by one. */
    memmove(c->first + 1, c->first, n * sizeof *c->first);
    c->first[0] = 0;
    return QP_OK;
}

static void add_partial(qp_error_report *sum, const qp_error_report *r) {
    sum->samples += r->samples;
    sum->past_depth += r->past_depth;
    sum->normals_undefined += r->normals_undefined;
    sum->nonfinite += r->nonfinite;
    sum->normals_ill += r->normals_ill;
    sum->ill_normal_max_deg = fmax(sum->ill_normal_max_deg, r->ill_normal_max_deg);
    sum->ill_normal_deg_per_condition =
        fmax(sum->ill_normal_deg_per_condition, r->ill_normal_deg_per_condition);
    sum->position_rms += r->position_rms;
    sum->normal_rms_deg += r->normal_rms_deg;
    sum->past_position_max = fmax(sum->past_position_max, r->past_position_max);
    sum->past_normal_max_deg = fmax(sum->past_normal_max_deg, r->past_normal_max_deg);
    if (r->position_max > sum->position_max) {
        sum->position_max = r->position_max;
        sum->worst_patch = r->worst_patch;
        sum->worst_u = r->worst_u;
        sum->worst_v = r->worst_v;
    }
    if (r->normal_max_deg > sum->normal_max_deg) {
        sum->normal_max_deg = r->normal_max_deg;
        sum->worst_normal_patch = r->worst_normal_patch;
        sum->worst_normal_u = r->worst_normal_u;
        sum->worst_normal_v = r->worst_normal_v;
    }
}

static qp_status run(compare *c, unsigned n_workers, qp_error_report *report, qp_error *err) {
    size_t items = (c->mesh->n_patches + CHUNK - 1) / CHUNK;
    qp_status status = sort_samples(c, err);
    if (status) return status;
    qp_parallel(items, 1, compare_range, c);
    for (unsigned w = 0; w < n_workers; ++w)
        if (c->workers[w].error.status)
            return qp_fail(err, c->workers[w].error.status, "%s", c->workers[w].error.message);
    uint64_t positions = 0, normals = 0;
    for (size_t i = 0; i < items; ++i) {
        add_partial(report, &c->partials[i].report);
        positions += c->partials[i].positions;
        normals += c->partials[i].normals;
    }
    report->position_rms = positions ? sqrt(report->position_rms / (double)positions) : 0;
    report->normal_rms_deg = normals ? sqrt(report->normal_rms_deg / (double)normals) : 0;
    return QP_OK;
}

/* Positions as the kernels were given them. */
double *qp_reference_rounded_positions(const qp_mesh *mesh) {
    size_t n = 3 * (size_t)mesh->n_vertices;
    double *to = qp_alloc(n, sizeof *to, false);
    const qp_local_frame f = qp_mesh_local_frame(mesh);
    for (size_t i = 0; to && i < n; ++i) {
        const float local = (float)ldexp(mesh->positions[i] - f.centre[i % 3], -f.exponent);
        to[i] = f.centre[i % 3] + ldexp((double)local, f.exponent);
    }
    return to;
}

static qp_status compare_stream(const qp_mesh *mesh, const qp_stream *stream, const double *uv,
                                const qp_reference_sample *references, qp_error_report *report,
                                qp_error *err) {
    unsigned n_workers = qp_thread_count();
    const bool round = stream->precision == QP_FLOAT && references == NULL;
    double *rounded = round ? qp_reference_rounded_positions(mesh) : NULL;
    compare c = {.mesh = mesh,
                 .stream = stream,
                 .uv = uv,
                 .references = references,
                 .positions = rounded ? rounded : mesh->positions,
                 .first = qp_alloc((size_t)mesh->n_patches + 1, sizeof(uint64_t), true),
                 .order = qp_alloc(stream->n_samples, sizeof(uint64_t), false),
                 .partials = qp_alloc(mesh->n_patches / CHUNK + 1, sizeof(partial), true),
                 .workers = qp_alloc(n_workers, sizeof(worker_state), true)};
    memset(report, 0, sizeof *report);
    qp_status status;
    if (!c.first || !c.order || !c.partials || !c.workers || (round && !rounded))
        status = qp_fail_memory(err, stream->n_samples * sizeof(uint64_t), "the comparison of samples");
    else
        status = run(&c, n_workers, report, err);
    for (unsigned w = 0; w < n_workers && c.workers; ++w) {
        qp_reference_work_free(&c.workers[w].work);
        free(c.workers[w].uv);
        free(c.workers[w].samples);
    }
    free(c.workers);
    free(c.partials);
    free(c.order);
    free(c.first);
    free(rounded);
    return status;
}

qp_status qp_reference_compare(const qp_mesh *mesh, const qp_stream *stream, const double *uv,
                               qp_error_report *report, qp_error *err) {
    return compare_stream(mesh, stream, uv, NULL, report, err);
}

qp_status qp_reference_compare_known(const qp_mesh *mesh, const qp_stream *stream, const double *uv,
                                     const qp_reference_sample *references, qp_error_report *report,
                                     qp_error *err) {
    return compare_stream(mesh, stream, uv, references, report, err);
}
