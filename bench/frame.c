/* Time of whole frames, and of their stages, beside the time to memset the same vertex stream on all cores.
 *
 *   bench_frame [--device D] [--double] [--general] [--repeat N] MESH.obj FACTOR...
 *
 * One line a factor: medians over N repeats (default 21), frames and memsets interleaved. */
#include "host/base/measure.h"
#include "host/base/status.h"
#include "quadplan.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int fail(const qp_error *err) {
    fprintf(stderr, "bench_frame: %s\n", err->message);
    return (int)err->status;
}

static int measure(qp_frame *frame, float factor, int repeat, size_t real_size, qp_error *err) {
    enum { MOST = 1000 };
    static double hull[MOST], domain[MOST], whole[MOST], plain[MOST];
    qp_tessellation tessellation = {.factor = factor};
    qp_stream stream;
    if (qp_frame_eval(frame, &tessellation, &stream, err) != QP_OK) return 1;
    size_t bytes = (size_t)stream.n_samples * 6 * real_size;
    char *block = malloc(bytes + 1);
    if (block == NULL) return qp_fail_memory(err, bytes, "memset"), 1;
    memset(block, 0, bytes);
    for (int i = 0; i < repeat; ++i) {
        if (qp_frame_eval(frame, &tessellation, &stream, err) != QP_OK) {
            free(block);
            return 1;
        }
        hull[i] = stream.hull_ms;
        domain[i] = stream.domain_ms;
        whole[i] = stream.frame_ms;
        plain[i] = qp_memset_ms(block, bytes);
    }
    free(block);
    double ms = qp_median(whole, (size_t)repeat), memset_ms = qp_median(plain, (size_t)repeat);
    printf("%6g %10llu %9.3f %9.3f %9.3f %9.1f %8.3f %10llu\n", (double)factor,
           (unsigned long long)stream.n_samples, qp_median(hull, (size_t)repeat),
           qp_median(domain, (size_t)repeat), ms, (double)stream.n_samples / ms * 1e-3, memset_ms / ms,
           (unsigned long long)stream.support_bytes);
    return 0;
}

int main(int argc, char **argv) {
    const char *device_name = NULL, *path = NULL;
    qp_frame_options options = {0};
    qp_error err = {0};
    int repeat = 21, i = 1;
    for (; i < argc && path == NULL; ++i) {
        if (strcmp(argv[i], "--device") == 0 && i + 1 < argc)
            device_name = argv[++i];
        else if (strcmp(argv[i], "--repeat") == 0 && i + 1 < argc)
            repeat = atoi(argv[++i]);
        else if (strcmp(argv[i], "--double") == 0)
            options.precision = QP_DOUBLE;
        else if (strcmp(argv[i], "--general") == 0)
            options.no_regular_pass = 1;
        else
            path = argv[i];
    }
    if (path == NULL || i == argc || repeat < 1 || repeat > 1000) {
        fprintf(stderr,
                "usage: bench_frame [--device D] [--double] [--general] [--repeat N] MESH.obj FACTOR...\n");
        return QP_BAD_INPUT;
    }
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_device *device = NULL;
    qp_frame *frame = NULL;
    int bad = qp_mesh_read_obj(path, NULL, &mesh, &err) != QP_OK ||
              qp_surface_create(mesh, NULL, &surface, &err) != QP_OK ||
              qp_device_open(device_name, &device, &err) != QP_OK ||
              qp_frame_create(device, surface, &options, &frame, &err) != QP_OK;
    if (!bad) {
        printf("%s on %s\n%6s %10s %9s %9s %9s %9s %8s %10s\n", path, qp_device_name(device), "factor",
               "samples", "hull ms", "domain ms", "frame ms", "Msample/s", "memset", "support");
        for (; i < argc && !bad; ++i)
            bad = measure(frame, (float)atof(argv[i]), repeat,
                          options.precision == QP_DOUBLE ? sizeof(double) : sizeof(float), &err);
    }
    qp_frame_free(frame);
    qp_device_free(device);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    return bad ? fail(&err) : 0;
}
