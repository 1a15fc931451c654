/* Time of whole frames with the fused ring buffer against worst-case scratch, interleaved.
 *
 *   bench_ring [--device D] [--double] [--repeat N] [--bytes N] MESH.obj FACTOR...
 *
 * Lines a factor: scratch, then rings retired in order and out of order, issued by plan and by patch; medians over N repeats (default
 * 21) of the wall clock and of the processor time of all threads, which other programs disturb less, their ratios to scratch, and how
 * long allocations of the last run waited for room. */
#include "host/base/measure.h"
#include "host/frame/frame.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_REPEATS = 1000, VARIANTS = 5 };

static const struct {
    const char *name;
    qp_supports_options supports;
} variants[VARIANTS] = {
    {"scratch", {.kind = QP_SUPPORTS_SCRATCH}},
    {"ring, in order", {.kind = QP_SUPPORTS_RING, .retirement = QP_RETIRE_IN_ORDER}},
    {"ring, out of order", {.kind = QP_SUPPORTS_RING, .retirement = QP_RETIRE_OUT_OF_ORDER}},
    {"in order, by patch",
     {.kind = QP_SUPPORTS_RING, .retirement = QP_RETIRE_IN_ORDER, .issue_order = QP_ISSUE_BY_PATCH}},
    {"out of order, by patch",
     {.kind = QP_SUPPORTS_RING, .retirement = QP_RETIRE_OUT_OF_ORDER, .issue_order = QP_ISSUE_BY_PATCH}},
};

static qp_status measure(qp_frame *const *frames, float factor, int repeat, qp_error *err) {
    static double wall[VARIANTS][MOST_REPEATS], processor[VARIANTS][MOST_REPEATS];
    const qp_tessellation tessellation = {.factor = factor};
    qp_stream stream[VARIANTS];
    for (int i = -1; i < repeat; ++i) {
        for (int v = 0; v < VARIANTS; ++v) {
            if (qp_frame_eval(frames[v], &tessellation, &stream[v], err) != QP_OK) return err->status;
            if (stream[v].hash != stream[0].hash)
                return qp_fail(err, QP_CHECK_FAILED, "%s makes another stream at factor %g", variants[v].name,
                               (double)factor);
            if (i < 0) continue;
            wall[v][i] = stream[v].frame_ms;
            processor[v][i] = frames[v]->processor_ms;
        }
    }
    double wall0 = 1, processor0 = 1;
    for (int v = 0; v < VARIANTS; ++v) {
        const double ms = qp_median(wall[v], (size_t)repeat), all = qp_median(processor[v], (size_t)repeat);
        if (v == 0) wall0 = ms, processor0 = all;
        const qp_supports_report *r = &stream[v].supports;
        printf("%6g  %-22s %9.3f %6.3f %9.3f %6.3f %10" PRIu64 " %9" PRIu64 " %7" PRIu64 " %8.3f %6" PRIu64
               "\n",
               (double)factor, variants[v].name, ms, ms / wall0, all, all / processor0, r->capacity_bytes,
               r->peak_bytes, r->stalls, r->stall_ms, r->wraps);
    }
    fflush(stdout);
    return QP_OK;
}

int main(int argc, char **argv) {
    const char *device_name = NULL, *path = NULL;
    qp_frame_options options = {.want_hash = 1};
    qp_error err = {0};
    unsigned long long bytes = 1 << 20;
    int repeat = 21, i = 1;
    for (; i < argc && path == NULL; ++i) {
        if (strcmp(argv[i], "--device") == 0 && i + 1 < argc)
            device_name = argv[++i];
        else if (strcmp(argv[i], "--double") == 0)
            options.precision = QP_DOUBLE;
        else if (strcmp(argv[i], "--repeat") == 0 && i + 1 < argc)
            repeat = atoi(argv[++i]);
        else if (strcmp(argv[i], "--bytes") == 0 && i + 1 < argc)
            bytes = strtoull(argv[++i], NULL, 10);
        else
            path = argv[i];
    }
    if (path == NULL || i == argc || repeat < 1 || repeat > MOST_REPEATS) {
        fprintf(stderr,
                "usage: bench_ring [--device D] [--double] [--repeat N] [--bytes N] MESH.obj FACTOR...\n");
        return QP_BAD_INPUT;
    }
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_device *device = NULL;
    qp_frame *frames[VARIANTS] = {0};
    qp_status status = qp_mesh_read_obj(path, NULL, &mesh, &err);
    if (status == QP_OK) status = qp_surface_create(mesh, NULL, &surface, &err);
    if (status == QP_OK) status = qp_device_open(device_name, &device, &err);
    for (int v = 0; v < VARIANTS && status == QP_OK; ++v) {
        options.supports = variants[v].supports;
        options.supports.ring_bytes = bytes;
        status = qp_frame_create(device, surface, &options, &frames[v], &err);
    }
    if (status == QP_OK)
        printf("%s on %s\n%6s  %-22s %9s %6s %9s %6s %10s %9s %7s %8s %6s\n", path, qp_device_name(device),
               "factor", "", "frame ms", "ratio", "cpu ms", "ratio", "capacity", "peak", "stalls", "stall ms",
               "wraps");
    for (; i < argc && status == QP_OK; ++i) status = measure(frames, (float)atof(argv[i]), repeat, &err);
    for (int v = 0; v < VARIANTS; ++v) qp_frame_free(frames[v]);
    qp_device_free(device);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    if (status != QP_OK) fprintf(stderr, "bench_ring: %s\n", err.message);
    return (int)status;
}
