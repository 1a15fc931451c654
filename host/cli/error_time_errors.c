/* Errors of the configurations of `bench error-time`: the reference is evaluated once for each set of positions that
 * configurations are given. */
#include "host/cli/error_time.h"
#include "host/reference/eval.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Positions as given: in double, in float relative to the mesh's local frame (ours), in float (the peers'). */
enum { EXACT, LOCAL_FLOAT, PLAIN_FLOAT, KINDS };

typedef struct et_known {
    double *positions[KINDS];
    qp_reference_sample *samples[KINDS]; /* shared where the positions are the same */
    uint8_t *no_flags;                   /* so that samples past the plans' depth count as all others do */
    double *vertices;                    /* of a peer, as a stream in double */
} et_known;

void et_free_known(et_run *run) {
    et_known *known = run->known;
    if (known == NULL) return;
    if (known->samples[PLAIN_FLOAT] == known->samples[LOCAL_FLOAT]) known->samples[PLAIN_FLOAT] = NULL;
    for (int i = 0; i < KINDS; ++i) {
        free(known->positions[i]);
        free(known->samples[i]);
    }
    free(known->no_flags);
    free(known->vertices);
    free(known);
    run->known = NULL;
}

typedef struct job {
    const et_run *run;
    const double *positions;
    qp_reference_sample *samples;
    qp_reference_work *works; /* one a worker */
    qp_error *errors;
} job;

static void evaluate_patches(void *context, size_t begin, size_t end, unsigned worker) {
    const job *j = context;
    const uint64_t each = j->run->options->samples;
    for (size_t i = begin; i < end && j->errors[worker].status == QP_OK; ++i)
        j->errors[worker].status = qp_reference_eval_with(
            &j->works[worker], j->run->mesh, j->positions, j->run->patch[i * each], each,
            j->run->uv + 2 * i * each, j->samples + i * each, &j->errors[worker]);
}

static qp_status evaluate_reference(const et_run *run, const double *positions, qp_reference_sample *samples,
                                    qp_error *err) {
    const unsigned workers = qp_thread_count();
    job j = {run, positions, samples, qp_alloc(workers, sizeof *j.works, true),
             qp_alloc(workers, sizeof *j.errors, true)};
    qp_status status = QP_OK;
    if (j.works == NULL || j.errors == NULL)
        status = qp_fail_memory(err, workers * sizeof *j.works, "the reference");
    else
        qp_parallel((size_t)(run->count / run->options->samples), 8, evaluate_patches, &j);
    for (unsigned w = 0; w < workers && status == QP_OK; ++w)
        if (j.errors[w].status != QP_OK) status = qp_fail(err, j.errors[w].status, "%s", j.errors[w].message);
    for (unsigned w = 0; w < workers && j.works != NULL; ++w) qp_reference_work_free(&j.works[w]);
    free(j.works);
    free(j.errors);
    return status;
}

static qp_status evaluate_kind(et_run *run, int kind, qp_error *err) {
    et_known *known = run->known;
    known->samples[kind] = qp_alloc(run->count, sizeof *known->samples[kind], false);
    if (known->samples[kind] == NULL)
        return qp_fail_memory(err, run->count * sizeof *known->samples[kind], "the reference's samples");
    return evaluate_reference(run, known->positions[kind], known->samples[kind], err);
}

qp_status et_know(et_run *run, qp_error *err) {
    const size_t reals = 3 * (size_t)run->mesh->n_vertices;
    et_known *known = run->known = qp_alloc(1, sizeof *known, true);
    if (known == NULL) return qp_fail_memory(err, sizeof *known, "the reference");
    known->positions[EXACT] = qp_alloc(reals, sizeof(double), false);
    known->positions[LOCAL_FLOAT] = qp_reference_rounded_positions(run->mesh);
    known->positions[PLAIN_FLOAT] = qp_alloc(reals, sizeof(double), false);
    known->no_flags = qp_alloc(run->count, 1, true);
    known->vertices = qp_alloc(run->count, 6 * sizeof(double), false);
    for (int i = 0; i < KINDS; ++i)
        if (known->positions[i] == NULL) return qp_fail_memory(err, reals * sizeof(double), "positions");
    if (known->no_flags == NULL || known->vertices == NULL)
        return qp_fail_memory(err, run->count * 49, "a vertex stream");
    memcpy(known->positions[EXACT], run->mesh->positions, reals * sizeof(double));
    for (size_t i = 0; i < reals; ++i)
        known->positions[PLAIN_FLOAT][i] = (double)(float)run->mesh->positions[i];
    qp_status status = evaluate_kind(run, EXACT, err);
    if (status == QP_OK) status = evaluate_kind(run, LOCAL_FLOAT, err);
    if (status != QP_OK) return status;
    if (memcmp(known->positions[LOCAL_FLOAT], known->positions[PLAIN_FLOAT], reals * sizeof(double)) != 0)
        return evaluate_kind(run, PLAIN_FLOAT, err);
    known->samples[PLAIN_FLOAT] = known->samples[LOCAL_FLOAT];
    return QP_OK;
}

static qp_status measure(et_run *run, et_configuration *c, qp_stream stream, int kind, qp_error *err) {
    qp_error_report report;
    stream.flags = run->known->no_flags;
    stream.sample_patch = run->patch;
    qp_status status =
        qp_reference_compare_known(run->mesh, &stream, run->uv, run->known->samples[kind], &report, err);
    if (status != QP_OK) return status;
    c->position_max = report.position_max;
    c->position_rms = report.position_rms;
    c->normal_max = report.normal_max_deg;
    c->normal_rms = report.normal_rms_deg;
    c->nonfinite = report.nonfinite;
    c->measured = true;
    run->normals_undefined = report.normals_undefined;
    run->normals_ill = report.normals_ill;
    return QP_OK;
}

qp_status et_quadplan_errors(et_run *run, et_configuration *c, const qp_stream *stream, qp_error *err) {
    return measure(run, c, *stream, c->precision == QP_DOUBLE ? EXACT : LOCAL_FLOAT, err);
}

typedef struct peer_job {
    const qp_peer *peer;
    double *vertices;
} peer_job;

/* Peers give derivatives; what it takes to make normals of them is not in their time. */
static void read_vertices(void *context, size_t begin, size_t end, unsigned worker) {
    const peer_job *j = context;
    (void)worker;
    for (size_t i = begin; i < end; ++i) {
        double *p = j->vertices + 6 * i, *n = p + 3, du[3], dv[3];
        j->peer->series->read(j->peer, i, p, du, dv);
        for (int k = 0; k < 3; ++k)
            n[k] = du[(k + 1) % 3] * dv[(k + 2) % 3] - du[(k + 2) % 3] * dv[(k + 1) % 3];
        const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; ++k) n[k] = length > 0 ? n[k] / length : 0;
        /* The comparison leaves out what is not finite. */
        if (j->peer->apart != NULL && j->peer->apart[i]) p[0] = (double)NAN;
    }
}

qp_status et_peer_errors(et_run *run, et_configuration *c, qp_error *err) {
    peer_job j = {c->peer, run->known->vertices};
    qp_parallel(run->count, 4096, read_vertices, &j);
    const qp_stream stream = {
        .precision = QP_DOUBLE, .n_samples = run->count, .vertices = run->known->vertices};
    qp_status status = measure(run, c, stream, c->precision == QP_DOUBLE ? EXACT : PLAIN_FLOAT, err);
    c->apart = 0;
    for (uint64_t i = 0; i < run->count && c->peer->apart != NULL; ++i) c->apart += c->peer->apart[i];
    c->nonfinite -= c->nonfinite < c->apart ? c->nonfinite : c->apart;
    return status;
}
