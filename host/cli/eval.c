/* quadplan eval: the vertex stream, to a file and timed. */
#include "host/base/measure.h"
#include "host/cli/evaluation.h"

#include <inttypes.h>
#include <stdlib.h>

enum { MOST_REPEATS = 1000 };

/* Milliseconds of each repetition. */
typedef struct timings {
    uint64_t count;
    double hull[MOST_REPEATS], domain[MOST_REPEATS], frame[MOST_REPEATS], fill[MOST_REPEATS];
    uint64_t peak_support_bytes;
    /* With --chunk-bytes: */
    uint64_t chunk_bytes;
    double set_up[MOST_REPEATS], consumer[MOST_REPEATS], total[MOST_REPEATS];
    qp_chunks chunks; /* of the last repetition */
} timings;

/* One evaluation, whole or in pieces, as repetition i. */
static qp_status evaluate(const cli_evaluation *evaluation, const qp_tessellation *tessellation, uint64_t i,
                          timings *t, qp_stream *stream, qp_error *err) {
    if (t->chunk_bytes == 0) return qp_frame_eval(evaluation->frame, tessellation, stream, err);
    const double start = qp_now_ms();
    qp_status status =
        qp_frame_eval_chunks(evaluation->frame, tessellation, t->chunk_bytes, NULL, NULL, &t->chunks, err);
    t->total[i] = qp_now_ms() - start;
    t->set_up[i] = t->chunks.set_up_ms;
    t->consumer[i] = t->chunks.consumer_ms;
    *stream = t->chunks.stream;
    return status;
}

/* Bytes of vertices that are held at one time. */
static size_t held_bytes(const timings *t, const qp_stream *stream) {
    if (t->chunk_bytes != 0) return (size_t)t->chunks.peak_vertex_bytes;
    return (size_t)stream->n_samples * 6 * (stream->precision == QP_DOUBLE ? sizeof(double) : sizeof(float));
}

/* Evaluates `repeats` times, each beside a memset of as many bytes on all cores. The stream is the last one.
 */
static qp_status measure(const cli_evaluation *evaluation, const qp_tessellation *tessellation,
                         uint64_t repeats, timings *t, qp_stream *stream, qp_error *err) {
    unsigned char *buffer = NULL;
    size_t size = 0;
    qp_status status = QP_OK;
    /* One run more at the start warms caches and sizes the buffers; it is not counted. Pieces do so by themselves. */
    const uint64_t warm = t->chunk_bytes == 0;
    for (uint64_t i = 0; i < repeats + warm && status == QP_OK; ++i) {
        const uint64_t at = i < warm ? 0 : i - warm;
        status = evaluate(evaluation, tessellation, at, t, stream, err);
        if (status != QP_OK) break;
        if (stream->support_bytes > t->peak_support_bytes) t->peak_support_bytes = stream->support_bytes;
        if (buffer == NULL) {
            size = held_bytes(t, stream);
            buffer = qp_alloc(size, 1, false);
            if (buffer == NULL) {
                status = qp_fail_memory(err, size, "the memset that a frame is compared with");
                break;
            }
        }
        const double whole = (double)stream->n_samples * 6 * (stream->precision == QP_DOUBLE ? 8 : 4);
        double fill = qp_memset_ms(buffer, size);
        if (size != 0) fill *= whole / (double)size;
        if (i < warm) continue;
        t->hull[at] = stream->hull_ms;
        t->domain[at] = stream->domain_ms;
        t->frame[at] = stream->frame_ms;
        t->fill[at] = fill;
        t->count = at + 1;
    }
    free(buffer);
    return status;
}

static void print_chunks(const timings *t) {
    if (t->chunk_bytes == 0) return;
    const qp_chunks *c = &t->chunks;
    printf("  %" PRIu64 " pieces of at most %" PRIu64 " bytes; vertices held %" PRIu64 " bytes, %" PRIu64
           " samples of theirs evaluated twice\n",
           c->n_chunks, t->chunk_bytes, c->peak_vertex_bytes, c->n_ghosts);
}

/* Sorts the times. */
static void write_chunks(qp_json *json, timings *t) {
    if (t->chunk_bytes == 0) return;
    qp_json_integer(json, "chunk_bytes", t->chunk_bytes);
    qp_json_integer(json, "chunks", t->chunks.n_chunks);
    qp_json_integer(json, "ghosts", t->chunks.n_ghosts);
    qp_json_integer(json, "peak_vertex_bytes", t->chunks.peak_vertex_bytes);
    qp_json_real(json, "set_up_ms", qp_median(t->set_up, t->count));
    qp_json_real(json, "consumer_ms", qp_median(t->consumer, t->count));
    qp_json_real(json, "total_ms", qp_median(t->total, t->count));
}

static void print_result(bool as_json, const char *name, const cli_evaluation *evaluation,
                         const cli_evaluation_options *options, timings *t, const qp_stream *s) {
    double frame_ms = qp_median(t->frame, t->count), fill_ms = qp_median(t->fill, t->count);
    /* Pieces are laid out within the evaluation, whole frames before it. */
    const double work_ms = frame_ms + (t->chunk_bytes != 0 ? qp_median(t->set_up, t->count) : 0);
    double rate = work_ms > 0 ? (double)s->n_samples / work_ms * 1e3 : 0;
    double ratio = frame_ms > 0 ? fill_ms / frame_ms : 0;
    static const char *const spacings[] = {"equal", "fractional_even", "fractional_odd"};
    if (!as_json) {
        printf("%s on %s\n", name, qp_device_name(evaluation->device));
        printf("  %" PRIu32 " patches, %" PRIu64 " samples, %" PRIu64 " triangles\n",
               evaluation->mesh->n_patches, s->n_samples, s->n_triangles);
        printf("  frame %.3f ms (hull %.3f, domain %.3f), median of %" PRIu64 "\n", frame_ms,
               qp_median(t->hull, t->count), qp_median(t->domain, t->count), t->count);
        printf("  %.2f million samples a second, %.4f of the speed of memset\n", rate * 1e-6, ratio);
        printf("  control points %" PRIu64 " bytes, stream hash %016" PRIx64 "\n", t->peak_support_bytes,
               s->hash);
        print_chunks(t);
        cli_supports_text(&options->supports, &s->supports);
        cli_tolerance_text(options->tolerance, s);
        return;
    }
    char hash[20];
    snprintf(hash, sizeof hash, "%016" PRIx64, s->hash);
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_text(&json, "mesh", name);
    if (options->tolerance == 0) qp_json_real(&json, "tess", options->tess);
    cli_tolerance_json(&json, options->tolerance, s);
    qp_json_text(&json, "spacing", spacings[options->spacing]);
    qp_json_text(&json, "precision", options->precision == QP_DOUBLE ? "double" : "float");
    qp_json_integer(&json, "patches", evaluation->mesh->n_patches);
    qp_json_integer(&json, "samples", s->n_samples);
    qp_json_integer(&json, "triangles", s->n_triangles);
    qp_json_integer(&json, "repeat", t->count);
    qp_json_real(&json, "hull_ms", qp_median(t->hull, t->count));
    qp_json_real(&json, "domain_ms", qp_median(t->domain, t->count));
    qp_json_real(&json, "frame_ms", frame_ms);
    qp_json_real(&json, "memset_ms", fill_ms);
    qp_json_real(&json, "samples_per_second", rate);
    qp_json_real(&json, "memset_ratio", ratio);
    qp_json_integer(&json, "peak_support_bytes", t->peak_support_bytes);
    write_chunks(&json, t);
    cli_supports_json(&json, &options->supports, &s->supports);
    qp_json_text(&json, "stream_hash", hash);
    qp_json_text(&json, "device", qp_device_name(evaluation->device));
    qp_json_finish(&json);
}

static qp_status run(int argc, char **argv, qp_error *err) {
    cli_evaluation_options o = CLI_EVALUATION_DEFAULTS;
    const char *path = NULL;
    uint64_t repeats = 1, chunk_bytes = 0;
    bool json = false;
    const cli_option options[] = {
        CLI_EVALUATION_OPTIONS(o),
        {"--repeat", "N", "timed evaluations, 1 to 1000; times are medians (default 1)", CLI_COUNT, &repeats,
         1, MOST_REPEATS, NULL},
        {"-o", "FILE", "write the vertex stream: .obj, .ply (binary) or .npy (n x 6)", CLI_TEXT, &path, 0, 0,
         NULL},
        {"--chunk-bytes", "N", "in pieces of at most N bytes of vertices (16M), never held whole", CLI_BYTES,
         &chunk_bytes, 1, 1e15, NULL},
        {"--trace", "FILE", "write each patch's way through the ring, for chrome://tracing", CLI_TEXT,
         &o.supports.trace, 0, 0, NULL},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_eval, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    if (path != NULL) status = cli_stream_check_name(path, err);
    if (status == QP_OK && chunk_bytes != 0 && (path != NULL || o.supports.trace != NULL))
        status = qp_fail(err, QP_BAD_INPUT, "%s is of a stream that is held whole, which --chunk-bytes does not do",
                         path != NULL ? "-o" : "--trace");
    if (status != QP_OK) return status;

    o.no_triangles = chunk_bytes != 0;
    cli_evaluation evaluation;
    status = cli_evaluation_open(arguments.values[0], &o, true, &evaluation, err);
    if (status != QP_OK) return status;
    const qp_tessellation tessellation = cli_evaluation_tessellation(&o);
    qp_stream stream = {0};
    timings *t = qp_alloc(1, sizeof *t, true);
    if (t == NULL) status = qp_fail_memory(err, sizeof *t, "timings");
    if (status == QP_OK) t->chunk_bytes = chunk_bytes;
    if (status == QP_OK) status = measure(&evaluation, &tessellation, repeats, t, &stream, err);
    if (status == QP_OK) cli_tolerance_warn(o.tolerance, &stream);
    if (status == QP_OK && path != NULL) status = cli_stream_write(&stream, path, err);
    if (status == QP_OK && o.supports.trace != NULL)
        status = cli_trace_write(&o.supports, &stream, o.supports.trace, err);
    if (status == QP_OK) print_result(json, arguments.values[0], &evaluation, &o, t, &stream);
    free(t);
    cli_evaluation_close(&evaluation);
    return status;
}

const cli_command cli_eval = {
    "eval", "MESH", "Evaluates the vertex stream of a mesh, times it, and writes it.",
    CLI_MESH_HELP "\nmemset_ratio is the time to set as many bytes on all cores over the time of a frame.\n"
    "With --chunk-bytes frame_ms is the sum over the pieces; set_up_ms is what laying them out took,\n"
    "which counts in samples_per_second as well, consumer_ms the hash.",
    run};
