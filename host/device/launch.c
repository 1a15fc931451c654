/* Running kernels and timing them. */
#include "host/device/host_kernels.h"
#include "host/device/opencl.h"

enum { MAX_ARGS = 24 };

/* Work-items a group. A processor needs no more than the hull stage's 32, as the paper has it; for the sample loops one item is
 * enough there, whose lanes are in the kernels (and in Mesa 22.3 items of one group that walk a tree by different ways disturb each
 * other, see docs/same-bits.md). No number changes a bit of the stream. */
static size_t group_items(const qp_device *device, qp_kernel_id kernel) {
    if (device->items != 0) return device->items;
    return kernel == QP_KERNEL_HULL || !device->info.is_cpu ? 32 : 1;
}

typedef struct host_launch {
    qp_host_kernel kernel;
    qp_host_arg args[MAX_ARGS];
} host_launch;

static void run_groups(void *context, size_t begin, size_t end, unsigned worker) {
    const host_launch *launch = context;
    (void)worker;
    for (size_t group = begin; group < end; ++group) launch->kernel(launch->args, group);
}

static void launch_host(const qp_program *program, qp_kernel_id kernel, const qp_arg *args, uint32_t n_args,
                        uint32_t groups, double *ms) {
    host_launch launch = {.kernel = kernel == QP_KERNEL_HULL     ? program->host->hull
                                    : kernel == QP_KERNEL_DOMAIN ? program->host->domain
                                    : kernel == QP_KERNEL_FUSED  ? program->host->fused
                                                                 : program->host->regular};
    for (uint32_t i = 0; i < n_args; ++i) {
        launch.args[i].memory = args[i].buffer != NULL ? args[i].buffer->host : NULL;
        launch.args[i].number = args[i].number;
    }
    double start = qp_now_ms();
    qp_parallel(groups, 16, run_groups, &launch);
    *ms += qp_now_ms() - start;
}

qp_status qp_launch(qp_device *device, const qp_program *program, qp_kernel_id kernel, const qp_arg *args,
                    uint32_t n_args, uint32_t groups, double *ms, qp_error *err) {
    if (groups == 0) return QP_OK;
    if (n_args > MAX_ARGS)
        return qp_fail(err, QP_SYSTEM, "a kernel has more than %d arguments", (int)MAX_ARGS);
    if (device->host) {
        launch_host(program, kernel, args, n_args, groups, ms);
        return QP_OK;
    }
    cl_kernel object = program->kernels[kernel];
    for (uint32_t i = 0; i < n_args; ++i) {
        cl_int code = args[i].buffer != NULL
                          ? clSetKernelArg(object, i, sizeof(cl_mem), &args[i].buffer->object)
                          : clSetKernelArg(object, i, sizeof args[i].number, &args[i].number);
        if (code != CL_SUCCESS) return qp_cl_check(code, "clSetKernelArg", device, err);
    }
    if (!qp_grow((void **)&device->pending, &device->pending_capacity, device->n_pending + 1,
                 sizeof(qp_pending)))
        return qp_fail_memory(err, sizeof(qp_pending), "timing");
    const size_t local = group_items(device, kernel), global = local * groups;
    cl_event event;
    cl_int code = clEnqueueNDRangeKernel(device->queue, object, 1, NULL, &global, &local, 0, NULL, &event);
    if (code != CL_SUCCESS) return qp_cl_check(code, "clEnqueueNDRangeKernel", device, err);
    device->pending[device->n_pending++] = (qp_pending){event, ms};
    return QP_OK;
}

qp_status qp_device_finish(qp_device *device, qp_error *err) {
    if (device->host) return QP_OK;
    qp_status status = qp_cl_check(clFinish(device->queue), "clFinish", device, err);
    for (size_t i = 0; i < device->n_pending; ++i) {
        cl_event event = device->pending[i].event;
        cl_int run = CL_COMPLETE;
        cl_ulong start = 0, end = 0;
        if (status == QP_OK)
            status =
                qp_cl_check(clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof run, &run, NULL),
                            "clGetEventInfo", device, err);
        if (status == QP_OK && run < 0) status = qp_cl_check(run, "a kernel", device, err);
        /* A device without a clock leaves the time at 0. */
        if (clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof start, &start, NULL) ==
                CL_SUCCESS &&
            clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, NULL) == CL_SUCCESS &&
            end > start)
            *device->pending[i].ms += (double)(end - start) * 1e-6;
        clReleaseEvent(event);
    }
    device->n_pending = 0;
    return status;
}
