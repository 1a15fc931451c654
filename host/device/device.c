/* Which devices there are, and opening one of them. */
#include "host/device/host_kernels.h"
#include "host/device/opencl.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct device_handle {
    cl_platform_id platform;
    cl_device_id id;
} device_handle;

static void device_text(cl_device_id id, cl_device_info what, char *text, size_t size) {
    if (clGetDeviceInfo(id, what, size, text, NULL) != CL_SUCCESS) snprintf(text, size, "?");
    text[size - 1] = '\0';
    for (char *c = text; *c != '\0'; ++c) {
        if ((unsigned char)*c < 0x20) *c = ' ';
    }
}

static void describe_device(cl_platform_id platform, uint32_t p, cl_device_id id, uint32_t d,
                            qp_device_info *info) {
    cl_device_fp_config single = 0, doubles = 0;
    cl_device_type type = 0;
    cl_uint units = 0;
    cl_ulong memory = 0, largest = 0;
    *info = (qp_device_info){0};
    snprintf(info->id, sizeof info->id, "%u.%u", p, d);
    device_text(id, CL_DEVICE_NAME, info->name, sizeof info->name);
    device_text(id, CL_DEVICE_VERSION, info->version, sizeof info->version);
    if (clGetPlatformInfo(platform, CL_PLATFORM_NAME, sizeof info->platform, info->platform, NULL) !=
        CL_SUCCESS)
        snprintf(info->platform, sizeof info->platform, "?");
    /* A query that fails leaves its zero: no double, no correct rounding. */
    clGetDeviceInfo(id, CL_DEVICE_SINGLE_FP_CONFIG, sizeof single, &single, NULL);
    clGetDeviceInfo(id, CL_DEVICE_DOUBLE_FP_CONFIG, sizeof doubles, &doubles, NULL);
    clGetDeviceInfo(id, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_COMPUTE_UNITS, sizeof units, &units, NULL);
    clGetDeviceInfo(id, CL_DEVICE_GLOBAL_MEM_SIZE, sizeof memory, &memory, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, sizeof largest, &largest, NULL);
    info->has_double = doubles != 0;
    info->is_cpu = (type & CL_DEVICE_TYPE_CPU) != 0;
    info->rounds_correctly = (single & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
    /* Simulators and some compilers for processors that do have fma say no to the first alone. */
    info->slow_fma = (single & (CL_FP_FMA | CL_FP_DENORM)) == 0;
    info->checks_races = strstr(info->platform, "Oclgrind") != NULL;
#ifdef __x86_64__
    /* PoCL compiles with clang, whose cycle counter is there the processor's time stamp, the same for all cores. */
    info->has_clock = info->is_cpu && strstr(info->platform, "Portable Computing Language") != NULL;
#ifdef __linux__
    info->is_native = info->has_clock;
#endif
#endif
    info->compute_units = units;
    info->memory_bytes = memory;
    info->max_buffer_bytes = largest;
}

static void describe_host(qp_device_info *info) {
    *info = (qp_device_info){.has_double = true, .is_cpu = true, .rounds_correctly = true, .has_clock = true};
    snprintf(info->id, sizeof info->id, "host");
    snprintf(info->name, sizeof info->name, "host");
    snprintf(info->platform, sizeof info->platform, "quadplan");
    snprintf(info->version, sizeof info->version, "kernels compiled as C");
    info->compute_units = qp_thread_count();
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    info->memory_bytes = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : 0;
    info->max_buffer_bytes = SIZE_MAX / 2;
}

/* Every OpenCL device in platform order, with room for one more in *list; a system without OpenCL has none. */
static qp_status find_devices(qp_device_info **list, device_handle **handles, size_t *count, qp_error *err) {
    cl_platform_id platforms[64];
    cl_uint n_platforms = 0;
    size_t list_capacity = 0, handle_capacity = 0;
    *list = NULL;
    *handles = NULL;
    *count = 0;
    if (clGetPlatformIDs(64, platforms, &n_platforms) != CL_SUCCESS) n_platforms = 0;
    if (n_platforms > 64) n_platforms = 64;
    for (cl_uint p = 0; p <= n_platforms; ++p) {
        cl_device_id devices[64];
        cl_uint n_devices = 0;
        if (p < n_platforms &&
            clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, 64, devices, &n_devices) != CL_SUCCESS)
            continue;
        if (n_devices > 64) n_devices = 64;
        const size_t room = *count + n_devices + 1;
        if (!qp_grow((void **)list, &list_capacity, room, sizeof **list) ||
            !qp_grow((void **)handles, &handle_capacity, room, sizeof **handles)) {
            free(*list);
            free(*handles);
            *list = NULL;
            *handles = NULL;
            return qp_fail_memory(err, room * sizeof **list, "the list of devices");
        }
        for (cl_uint d = 0; d < n_devices; ++d, ++*count) {
            describe_device(platforms[p], p, devices[d], d, &(*list)[*count]);
            (*handles)[*count] = (device_handle){platforms[p], devices[d]};
        }
    }
    return QP_OK;
}

qp_status qp_device_list(qp_device_info **list, size_t *count, qp_error *err) {
    device_handle *handles;
    qp_status status = find_devices(list, &handles, count, err);
    if (status != QP_OK) return status;
    free(handles);
    describe_host(&(*list)[(*count)++]);
    return QP_OK;
}

/* Is `part` in `text`, whatever the case? */
static bool contains(const char *text, const char *part) {
    size_t n = strlen(part);
    for (; *text != '\0'; ++text) {
        size_t i = 0;
        while (i < n && tolower((unsigned char)text[i]) == tolower((unsigned char)part[i])) ++i;
        if (i == n) return true;
    }
    return false;
}

static qp_status open_queue(qp_device *device, cl_platform_id platform, qp_error *err) {
    cl_int code;
    const cl_context_properties properties[] = {CL_CONTEXT_PLATFORM, (cl_context_properties)platform, 0};
    device->context = clCreateContext(properties, 1, &device->id, NULL, NULL, &code);
    if (code != CL_SUCCESS) return qp_cl_check(code, "clCreateContext", device, err);
    device->queue = clCreateCommandQueue(device->context, device->id, CL_QUEUE_PROFILING_ENABLE, &code);
    return qp_cl_check(code, "clCreateCommandQueue", device, err);
}

/* The register width in elements, where a work-item has vector registers to itself. */
static uint32_t native_lanes(const qp_device *device, cl_device_info what, uint32_t largest) {
    cl_uint width = 1;
    if (!device->info.is_cpu || clGetDeviceInfo(device->id, what, sizeof width, &width, NULL) != CL_SUCCESS)
        return 1;
    uint32_t lanes = 1;
    while (lanes * 2 <= width && lanes < largest) lanes *= 2;
    return lanes == 2 ? 4 : lanes; /* widths of two are not worth their shuffles */
}

/* What speaks for a device when nobody chose one: the more the better. */
static int rank(const qp_device_info *info) {
    if (info->is_cpu && info->has_double && strstr(info->platform, "Portable Computing Language") != NULL)
        return 3;
    return !info->has_double ? 0 : info->rounds_correctly ? 2 : 1;
}

size_t qp_device_choose(const qp_device_info *list, size_t n, const char *which) {
    size_t best = n;
    if (which[0] == '\0') {
        for (size_t i = 0; i < n; ++i) {
            if (best == n || rank(&list[i]) > rank(&list[best])) best = i;
        }
        return best;
    }
    for (size_t i = 0; i < n; ++i) {
        if (strcmp(list[i].id, which) == 0) return i;
    }
    for (size_t i = 0; i < n; ++i) {
        if (contains(list[i].name, which)) return i;
    }
    return n;
}

/* A number from the environment in [1, most]; `otherwise` where there is none. */
static uint32_t number_from(const char *variable, uint32_t most, uint32_t otherwise) {
    const char *text = getenv(variable);
    const long n = text == NULL ? 0 : strtol(text, NULL, 10);
    return n >= 1 && n <= (long)most ? (uint32_t)n : otherwise;
}

qp_status qp_device_open(const char *which, qp_device **device, qp_error *err) {
    *device = NULL;
    if (which == NULL || which[0] == '\0') {
        which = getenv("QUADPLAN_DEVICE");
        if (which == NULL) which = "";
    }
    qp_device *d = qp_alloc(1, sizeof *d, true);
    if (d == NULL) return qp_fail_memory(err, sizeof *d, "a device");
    if (strcmp(which, "host") == 0) {
        d->host = true;
        describe_host(&d->info);
        *device = d;
        return QP_OK;
    }
    qp_device_info *list;
    device_handle *handles;
    size_t n = 0;
    qp_status status = find_devices(&list, &handles, &n, err);
    if (status == QP_OK) {
        const size_t chosen = qp_device_choose(list, n, which);
        if (chosen < n) {
            d->info = list[chosen];
            d->id = handles[chosen].id;
            status = open_queue(d, handles[chosen].platform, err);
        } else if (n == 0) {
            status =
                qp_fail(err, QP_SYSTEM,
                        "no OpenCL device found (install pocl-opencl-icd, or choose the device \"host\")");
        } else {
            status = qp_fail(err, QP_SYSTEM, "no OpenCL device is called '%s' (see quadplan devices)", which);
        }
    }
    free(list);
    free(handles);
    if (status != QP_OK) {
        qp_device_free(d);
        return status;
    }
    d->lanes_float = d->info.slow_fma ? 1 : native_lanes(d, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, 16);
    d->lanes_double = native_lanes(d, CL_DEVICE_NATIVE_VECTOR_WIDTH_DOUBLE, 8);
    d->items = number_from("QUADPLAN_GROUP_ITEMS", 1024, 0);
    *device = d;
    return QP_OK;
}

void qp_device_free(qp_device *device) {
    if (device == NULL) return;
    if (device->queue != NULL) {
        clFinish(device->queue);
        clReleaseCommandQueue(device->queue);
    }
    for (size_t i = 0; i < QP_QUEUES - 1; ++i) {
        if (device->more_queues[i] == NULL) continue;
        clFinish(device->more_queues[i]);
        clReleaseCommandQueue(device->more_queues[i]);
    }
    for (size_t i = 0; i < device->n_pending; ++i) clReleaseEvent(device->pending[i].event);
    free(device->pending);
    if (device->context != NULL) clReleaseContext(device->context);
    free(device);
}

const char *qp_device_name(const qp_device *device) {
    return device->info.name;
}

int qp_device_has_double(const qp_device *device) {
    return device->info.has_double;
}

const qp_device_info *qp_device_get_info(const qp_device *device) {
    return &device->info;
}

bool qp_device_is_host(const qp_device *device) {
    return device->host;
}

uint64_t qp_device_ticks(const qp_device *device) {
    if (device->host) return qp_host_clock();
#ifdef __x86_64__
    if (device->info.has_clock) return __builtin_ia32_rdtsc();
#endif
    return 0;
}
