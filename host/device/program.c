/* Building the kernels for a device, specialised to what a surface needs. */
#include "host/base/embedded.h"
#include "host/device/host_kernels.h"
#include "host/device/opencl.h"
#include "kernels/plan_layout.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const shared_sources[] = {"portable.h", "plan_layout.h", "frame_layout.h",
                                             "ring_layout.h", "ring.h", "cache_layout.h", "real.h",
                                             "spline.h"};
enum { SHARED_SOURCES = sizeof shared_sources / sizeof shared_sources[0] };
/* parts: kernels (1 << qp_kernel_id) whose files it calls functions of, or is in. */
static const struct {
    const char *kernel, *file;
    unsigned parts;
} stages[QP_KERNELS] = {
    [QP_KERNEL_HULL] = {"hull", "hull.cl"},
    [QP_KERNEL_DOMAIN] = {"domain", "domain.cl"},
    [QP_KERNEL_REGULAR] = {"regular", "regular.cl"},
    [QP_KERNEL_FUSED] = {"fused", "fused.cl", 1u << QP_KERNEL_HULL | 1u << QP_KERNEL_DOMAIN},
    [QP_KERNEL_STREAM_HULL] = {"stream_hull", "stream_hull.cl", 1u << QP_KERNEL_HULL},
    [QP_KERNEL_STREAM_DOMAIN] = {"stream_domain", "stream_domain.cl", 1u << QP_KERNEL_DOMAIN},
    [QP_KERNEL_CACHED_HULL] = {"cached_hull", "cached_hull.cl", 1u << QP_KERNEL_HULL},
    [QP_KERNEL_CACHE_FORGET] = {"cache_forget", NULL, 1u << QP_KERNEL_CACHED_HULL | 1u << QP_KERNEL_HULL},
};

/* One source file, malloced with a NUL: from the folder when it is given, else from the library. */
static qp_status load_source(const char *folder, const char *name, char **text, qp_error *err) {
    *text = NULL;
    if (folder == NULL) {
        for (const qp_embedded *e = qp_embedded_kernels; e->name != NULL; ++e) {
            if (strcmp(e->name, name) != 0) continue;
            *text = qp_alloc(e->length + 1, 1, true);
            if (*text == NULL) return qp_fail_memory(err, e->length + 1, name);
            memcpy(*text, e->bytes, e->length);
            return QP_OK;
        }
        return qp_fail(err, QP_SYSTEM, "kernel source %s is not in the library", name);
    }
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path)
        return qp_fail(err, QP_BAD_INPUT, "QUADPLAN_KERNELS is too long");
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return qp_fail(err, QP_BAD_INPUT, "%s: cannot be read (folder from QUADPLAN_KERNELS)", path);
    size_t length = 0, capacity = 0, got;
    do {
        if (!qp_grow((void **)text, &capacity, length + 65536, 1)) {
            fclose(file);
            free(*text);
            *text = NULL;
            return qp_fail_memory(err, length + 65536, path);
        }
        got = fread(*text + length, 1, 65535, file);
        length += got;
    } while (got == 65535);
    (*text)[length] = '\0';
    bool bad = ferror(file) != 0;
    fclose(file);
    if (!bad) return QP_OK;
    free(*text);
    *text = NULL;
    return qp_fail(err, QP_SYSTEM, "%s: error while reading", path);
}

/* The compiler's log to stderr when QUADPLAN_VERBOSE asks for it, and one line into *err. */
static qp_status report_build(const qp_device *device, cl_program program, cl_int code, qp_error *err) {
    size_t length = 0;
    char *log = NULL, first[200] = "";
    if (clGetProgramBuildInfo(program, device->id, CL_PROGRAM_BUILD_LOG, 0, NULL, &length) == CL_SUCCESS &&
        (log = qp_alloc(length + 1, 1, true)) != NULL &&
        clGetProgramBuildInfo(program, device->id, CL_PROGRAM_BUILD_LOG, length, log, NULL) == CL_SUCCESS) {
        const char *verbose = getenv("QUADPLAN_VERBOSE");
        if (verbose != NULL && verbose[0] != '\0') fprintf(stderr, "%s\n", log);
        const char *line = strstr(log, "error:");
        if (line != NULL) snprintf(first, sizeof first, "%.*s", (int)strcspn(line, "\r\n"), line);
    }
    free(log);
    return qp_fail(err, QP_SYSTEM, "kernels do not compile for %s: %s%s%s (QUADPLAN_VERBOSE=1 shows the log)",
                   device->info.name, qp_cl_error_name(code), first[0] != '\0' ? ", " : "", first);
}

static void write_options(const qp_device *device, qp_precision precision, unsigned kernels, uint32_t plan_flags,
                          char *options, size_t size) {
    bool correct = device->info.rounds_correctly;
    snprintf(
        options, size,
        "-cl-std=CL1.2%s%s%s -DQP_LANES=%u -DQP_WITH_INTERNAL=%d -DQP_WITH_CREASE=%d -DQP_WITH_TERMINAL=%d "
        "-DQP_WITH_CORNERS=%d%s%s%s%s",
        correct ? " -cl-fp32-correctly-rounded-divide-sqrt -DQP_CORRECT_DIVIDE" : "",
        precision == QP_DOUBLE ? " -DQP_REAL_DOUBLE" : "",
        precision == QP_FLOAT && device->info.slow_fma ? " -DQP_SOFT_FMA" : "",
        precision == QP_DOUBLE ? device->lanes_double : device->lanes_float,
        (plan_flags & QP_PLAN_INTERNAL) != 0, (plan_flags & QP_PLAN_CREASE) != 0,
        (plan_flags & QP_PLAN_TERMINAL) != 0, (plan_flags & QP_PLAN_CORNERS) != 0,
        (kernels & (1u << QP_KERNEL_HULL | 1u << QP_KERNEL_DOMAIN)) != 0 ? "" : " -DQP_WITH_STAGES=0",
        device->info.has_clock ? " -DQP_KERNEL_CLOCK" : "", device->info.is_native ? " -DQP_KERNEL_YIELD" : "",
        device->info.checks_races ? " -DQP_WORD_ATOMICS" : "");
}

static qp_status build_sources(qp_device *device, const char **sources, cl_uint n, const char *options,
                               unsigned kernels, qp_program *program, qp_error *err) {
    cl_int code;
    program->object = clCreateProgramWithSource(device->context, n, sources, NULL, &code);
    if (code != CL_SUCCESS) return qp_cl_check(code, "clCreateProgramWithSource", device, err);
    code = clBuildProgram(program->object, 1, &device->id, options, NULL, NULL);
    if (code != CL_SUCCESS) return report_build(device, program->object, code, err);
    for (int k = 0; k < QP_KERNELS; ++k) {
        if ((kernels & 1u << k) == 0) continue;
        program->kernels[k] = clCreateKernel(program->object, stages[k].kernel, &code);
        if (code != CL_SUCCESS) return qp_cl_check(code, "clCreateKernel", device, err);
    }
    return QP_OK;
}

qp_status qp_program_build(qp_device *device, qp_precision precision, unsigned kernels, uint32_t plan_flags,
                           qp_program *program, qp_error *err) {
    *program = (qp_program){.precision = precision};
    if (precision == QP_DOUBLE && !device->info.has_double)
        return qp_fail(err, QP_SYSTEM, "%s has no double precision", device->info.name);
    if (device->host) {
        program->host = qp_host_kernels_for(precision);
        return QP_OK;
    }
    const char *folder = getenv("QUADPLAN_KERNELS");
    if (folder != NULL && folder[0] == '\0') folder = NULL;
    char *texts[SHARED_SOURCES + QP_KERNELS] = {0};
    cl_uint n = 0;
    qp_status status = QP_OK;
    for (int i = 0; i < SHARED_SOURCES && status == QP_OK; ++i, ++n)
        status = load_source(folder, shared_sources[i], &texts[n], err);
    unsigned files = kernels;
    for (int k = 0; k < QP_KERNELS; ++k) files |= (kernels & 1u << k) != 0 ? stages[k].parts : 0u;
    for (int k = 0; k < QP_KERNELS && status == QP_OK; ++k) {
        if ((files & 1u << k) != 0 && stages[k].file != NULL)
            status = load_source(folder, stages[k].file, &texts[n++], err);
    }
    if (status == QP_OK) {
        char options[512];
        write_options(device, precision, kernels, plan_flags, options, sizeof options);
        status = build_sources(device, (const char **)texts, n, options, kernels, program, err);
    }
    for (cl_uint i = 0; i < n; ++i) free(texts[i]);
    if (status != QP_OK) qp_program_free(program);
    return status;
}

void qp_program_free(qp_program *program) {
    for (int k = 0; k < QP_KERNELS; ++k) {
        if (program->kernels[k] != NULL) clReleaseKernel(program->kernels[k]);
    }
    if (program->object != NULL) clReleaseProgram(program->object);
    *program = (qp_program){0};
}
