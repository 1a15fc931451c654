/* The run of `bench error-time`: rounds over all configurations, so that whatever else the machine does meets all of
 * them alike. */
#define _GNU_SOURCE
#include "host/base/measure.h"
#include "host/cli/error_time.h"
#include "host/frame/frame.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

qp_status et_skip_add(et_run *run, const char *name, unsigned level, const char *reason, qp_error *err) {
    if (!qp_grow((void **)&run->skips, &run->skip_capacity, run->n_skips + 1, sizeof *run->skips))
        return qp_fail_memory(err, (run->n_skips + 1) * sizeof *run->skips, "a list");
    et_skip *skip = &run->skips[run->n_skips++];
    snprintf(skip->name, sizeof skip->name, "%s", name);
    snprintf(skip->reason, sizeof skip->reason, "%s", reason);
    skip->level = level;
    return QP_OK;
}

/* Leaves out this level of a peer's series and those above it. */
static qp_status drop_from(et_run *run, const et_configuration *from, const char *reason, qp_error *err) {
    for (size_t i = 0; i < run->n_configurations; ++i) {
        et_configuration *c = &run->configurations[i];
        if (c->series == from->series && c->level >= from->level) c->dropped = true;
    }
    return et_skip_add(run, from->name, from->level, reason, err);
}

/* The clock that frames are timed by. */
static double frame_clock(const et_run *run) {
    return run->options->processor_time ? qp_processor_ms() : qp_now_ms();
}

static bool is_set_up(const et_configuration *c) {
    return c->series == NULL ? c->frame != NULL : c->peer != NULL;
}

static void tear_down(et_run *run, et_configuration *c) {
    qp_frame_free(c->frame);
    c->frame = NULL;
    if (c->peer != NULL) c->peer->series->free(c->peer);
    c->peer = NULL;
    run->held_bytes -= c->held_bytes;
    c->held_bytes = 0;
}

static void add_setup(et_configuration *c, double setup_ms, double locate_ms) {
    if (c->n_setups == ET_MOST_REPEATS) return;
    c->setups[c->n_setups] = setup_ms;
    c->locates[c->n_setups++] = locate_ms;
}

/* ---- quadplan ---- */

static qp_status create_frame(et_run *run, et_configuration *c, qp_error *err) {
    const qp_frame_options options = {
        .precision = c->precision, .no_exact_tail = !c->exact_tail, .tolerance = c->tolerance};
    return qp_frame_create(run->device, c->surface, &options, &c->frame, err);
}

/* A frame as a program runs it: positions that moved, then all samples. With a tolerance the plans are chosen by the
 * positions, which takes much longer than a frame: it is for positions that stay, and the choice is part of set-up. Putting the samples in order and handing them
 * over is done anew each time, but is no part of a frame's time, as the peers' looking for their patches is not. */
static qp_status quadplan_frame(et_run *run, et_configuration *c, qp_stream *stream, double *ms,
                                double *locate_ms, qp_error *err) {
    const double start = frame_clock(run);
    qp_status status = c->tolerance > 0 ? QP_OK : qp_frame_update_positions(c->frame, err);
    *ms = frame_clock(run) - start;
    const double updated = qp_now_ms();
    if (status == QP_OK)
        status = qp_frame_eval_points(c->frame, run->count, run->patch, run->uv, stream, err);
    if (status != QP_OK) return status;
    *ms += run->options->processor_time ? c->frame->processor_ms : stream->frame_ms;
    *locate_ms = qp_now_ms() - updated - stream->frame_ms;
    return QP_OK;
}

/* What a frame holds beside plans, roughly: results, coordinates on both sides, sample tables. */
static uint64_t frame_bytes(const et_run *run, const et_configuration *c) {
    return run->count * (c->precision == QP_DOUBLE ? 100 : 60) + 3 * c->plan_bytes;
}

/* Sets the frame up and evaluates it once, which is when deep plans are built. */
static qp_status set_up_quadplan(et_run *run, et_configuration *c, qp_stream *stream, double *setup_ms,
                                 double *locate_ms, qp_error *err) {
    double ms;
    const double start = qp_now_ms();
    qp_status status = create_frame(run, c, err);
    *setup_ms = c->surface_ms + qp_now_ms() - start;
    return status == QP_OK ? quadplan_frame(run, c, stream, &ms, locate_ms, err) : status;
}

/* The first time a kernel is needed the runtime compiles it, which takes about a second, and keeps it for all later
 * runs. Set-up is what it takes then. */
enum { COMPILED_MS = 500 };

static qp_status measure_quadplan(et_run *run, et_configuration *c, qp_error *err) {
    qp_stream stream;
    double ms, setup_ms, locate_ms;
    qp_status status = QP_OK;
    if (c->frame == NULL) {
        status = set_up_quadplan(run, c, &stream, &setup_ms, &locate_ms, err);
        if (status == QP_OK && setup_ms - c->surface_ms + locate_ms > COMPILED_MS && c->n_setups == 0) {
            qp_frame_free(c->frame);
            c->frame = NULL;
            status = set_up_quadplan(run, c, &stream, &setup_ms, &locate_ms, err);
        }
        if (status != QP_OK) return status;
        c->held_bytes = frame_bytes(run, c);
        run->held_bytes += c->held_bytes;
        add_setup(c, setup_ms, locate_ms);
    } else {
        status = quadplan_frame(run, c, &stream, &ms, &locate_ms, err);
        if (status != QP_OK) return status;
    }
    if (!c->measured) {
        status = et_quadplan_errors(run, c, &stream, err);
        c->bound = stream.bound;
        c->bytes = (c->precision == QP_DOUBLE ? 2 : 1) * c->plan_bytes + stream.support_bytes;
    }
    if (status == QP_OK) status = quadplan_frame(run, c, &stream, &ms, &locate_ms, err);
    if (status == QP_OK) c->frames[c->n_frames++] = ms;
    return status;
}

/* ---- Peers ---- */

enum { PEER_BYTES_LIMIT_MB = 2048 };

/* A series ends where its set-up takes too long, or is about to take too much memory. */
static qp_status end_series(et_run *run, et_configuration *c, qp_error *err) {
    char reason[160];
    et_configuration *next = NULL, *previous = NULL;
    for (size_t i = 0; i < run->n_configurations; ++i) {
        et_configuration *other = &run->configurations[i];
        if (other->series != c->series) continue;
        if (other->level == c->level + 1) next = other;
        if (other->level + 1 == c->level) previous = other;
    }
    if (next == NULL || next->dropped) return QP_OK;
    const double limit = PEER_BYTES_LIMIT_MB * 1048576.0, bytes = (double)c->peer->bytes;
    const double growth = previous != NULL && previous->bytes > 0 ? bytes / (double)previous->bytes : 1;
    if (c->peer->setup_ms > run->options->setup_limit_ms)
        snprintf(reason, sizeof reason, "set-up of level %u took %.1f s", c->level, c->peer->setup_ms * 1e-3);
    else if (bytes * growth > limit)
        snprintf(reason, sizeof reason, "level %u took %.0f MB, level %u would take about %.0f", c->level,
                 bytes / 1048576, c->level + 1, bytes * growth / 1048576);
    else
        return QP_OK;
    return drop_from(run, next, reason, err);
}

static qp_status measure_peer(et_run *run, et_configuration *c, qp_error *err) {
    qp_status status = QP_OK;
    if (c->peer == NULL) {
        qp_error reason = {0};
        status = c->series->create(c->series, &run->task, c->level, &c->peer, &reason);
        /* What a peer cannot do is no failure of the run. */
        if (status != QP_OK) return drop_from(run, c, reason.message, err);
        add_setup(c, c->peer->setup_ms, c->peer->locate_ms);
        c->held_bytes = c->peer->bytes + 32 * run->count;
        run->held_bytes += c->held_bytes;
        c->bytes = c->peer->bytes;
    }
    status = c->series->evaluate(c->peer, err);
    if (status == QP_OK && !c->measured) {
        status = et_peer_errors(run, c, err);
        if (status == QP_OK) status = end_series(run, c, err);
    }
    if (status != QP_OK) return status;
    const double start = frame_clock(run);
    status = c->series->evaluate(c->peer, err);
    c->frames[c->n_frames++] = frame_clock(run) - start;
    return status;
}

/* ---- Rounds ---- */

static qp_status measure_all(et_run *run, qp_error *err) {
    const uint64_t limit = run->options->memory_mb << 20;
    const bool progress = isatty(STDERR_FILENO);
    qp_status status = QP_OK;
    for (uint64_t round = 0; round < run->options->repeats && status == QP_OK; ++round) {
        for (size_t i = 0; i < run->n_configurations && status == QP_OK; ++i) {
            et_configuration *c = &run->configurations[i];
            if (c->dropped) continue;
            if (progress)
                fprintf(stderr, "\rround %llu of %llu, %zu of %zu ", (unsigned long long)round + 1,
                        (unsigned long long)run->options->repeats, i + 1, run->n_configurations);
            status = c->series == NULL ? measure_quadplan(run, c, err) : measure_peer(run, c, err);
            if (is_set_up(c) && (run->held_bytes > limit || round + 1 == run->options->repeats))
                tear_down(run, c);
        }
    }
    if (progress) fprintf(stderr, "\r%48s\r", "");
    return status;
}

/* Drops what was left out, and takes medians. */
static void finish(et_run *run) {
    size_t kept = 0;
    for (size_t i = 0; i < run->n_configurations; ++i) {
        et_configuration *c = &run->configurations[i];
        if (c->dropped || c->n_frames == 0) continue;
        c->frame_ms = qp_median(c->frames, c->n_frames);
        c->setup_ms = qp_median(c->setups, c->n_setups);
        c->locate_ms = qp_median(c->locates, c->n_setups);
        c->ns = c->frame_ms * 1e6 / (double)run->count;
        if (kept != i) run->configurations[kept] = *c;
        ++kept;
    }
    run->n_configurations = kept;
}

/* Every runtime takes its number of threads from the environment, when it starts. */
static void set_threads(uint64_t threads) {
    char text[24];
    snprintf(text, sizeof text, "%llu", (unsigned long long)threads);
    setenv("QUADPLAN_THREADS", text, 1);
    setenv("POCL_MAX_PTHREAD_COUNT", text, 1); /* PoCL to 3.1, then its name from 4.0 on */
    setenv("POCL_CPU_MAX_CU_COUNT", text, 1);
}

qp_status et_measure(et_run *run, const char *mesh_name, const et_options *options, qp_error *err) {
    memset(run, 0, sizeof *run);
    run->options = options;
    run->mesh_name = mesh_name;
    /* OpenMP's threads would else spin between frames and take the processors from the others. */
    setenv("OMP_WAIT_POLICY", "passive", 0);
    qp_status status = cli_mesh_open(mesh_name, &options->mesh, &run->mesh, err);
    if (status == QP_OK) status = et_make_samples(run, err);
    if (status == QP_OK) status = et_list_peers(run, err);
    if (status == QP_OK) status = et_know(run, err);
    if (status != QP_OK) return status;
    const unsigned threads = options->threads > 0 ? (unsigned)options->threads : qp_thread_count();
    if (options->threads > 0) set_threads(threads);
    status = qp_device_open(options->device, &run->device, err);
    if (status == QP_OK) status = et_list_quadplan(run, err);
    if (status != QP_OK) return status;
    const uint64_t bytes = QP_PEER_OUT_BYTES(run->count);
    run->task =
        (qp_peer_task){run->mesh, run->count, run->patch, run->peer_uv, threads, aligned_alloc(64, bytes)};
    if (run->task.out == NULL) return qp_fail_memory(err, bytes, "the peers' results");
    memset(run->task.out, 0, bytes);
    status = measure_all(run, err);
    if (status == QP_OK) finish(run);
    return status;
}

void et_free(et_run *run) {
    for (size_t i = 0; i < run->n_configurations; ++i) tear_down(run, &run->configurations[i]);
    free(run->configurations);
    et_free_surfaces(run);
    et_free_known(run);
    qp_device_free(run->device);
    free(run->task.out);
    free(run->skips);
    free(run->patch);
    free(run->uv);
    free(run->peer_uv);
    qp_mesh_free(run->mesh);
}
