/* Running kernels and timing them. */
#include "host/device/host_kernels.h"
#include "host/device/opencl.h"

#include <stdlib.h>

enum { MAX_ARGS = 24 };

/* Work-items a group. A processor needs no more than the hull stage's 32, as the paper has it; for the sample loops one item is
 * enough there, whose lanes are in the kernels (and in Mesa 22.3 items of one group that walk a tree by different ways disturb each
 * other, see docs/same-bits.md). No number changes a bit of the stream. */
static size_t group_items(const qp_device *device, qp_kernel_id kernel) {
    if (device->items != 0) return device->items;
    const bool hull = kernel == QP_KERNEL_HULL || kernel == QP_KERNEL_STREAM_HULL ||
                      kernel == QP_KERNEL_CACHED_HULL || kernel == QP_KERNEL_CACHE_FORGET;
    return hull || !device->info.is_cpu ? 32 : 1;
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
                        uint32_t groups, qp_event *event, double *ms) {
    const qp_host_kernels *all = program->host;
    const qp_host_kernel kernels[QP_KERNELS] = {[QP_KERNEL_HULL] = all->hull,
                                                [QP_KERNEL_DOMAIN] = all->domain,
                                                [QP_KERNEL_REGULAR] = all->regular,
                                                [QP_KERNEL_FUSED] = all->fused,
                                                [QP_KERNEL_STREAM_HULL] = all->stream_hull,
                                                [QP_KERNEL_STREAM_DOMAIN] = all->stream_domain,
                                                [QP_KERNEL_CACHED_HULL] = all->cached_hull,
                                                [QP_KERNEL_CACHE_FORGET] = all->cache_forget};
    host_launch launch = {.kernel = kernels[kernel]};
    for (uint32_t i = 0; i < n_args; ++i) {
        launch.args[i].memory = args[i].buffer != NULL ? args[i].buffer->host : NULL;
        launch.args[i].number = args[i].number;
    }
    const double start = qp_now_ms();
    qp_parallel(groups, 16, run_groups, &launch);
    const double end = qp_now_ms();
    *ms += end - start;
    if (event != NULL) *event = (qp_event){.start_ms = start, .end_ms = end};
}

/* A queue beside the first one, made when it is first used. */
static qp_status use_queue(qp_device *device, unsigned number, cl_command_queue *queue, qp_error *err) {
    cl_int code = CL_SUCCESS;
    *queue = number == 0 ? device->queue : device->more_queues[number - 1];
    if (*queue != NULL) return QP_OK;
    *queue = clCreateCommandQueue(device->context, device->id, CL_QUEUE_PROFILING_ENABLE, &code);
    if (code != CL_SUCCESS) return qp_cl_check(code, "clCreateCommandQueue", device, err);
    device->more_queues[number - 1] = *queue;
    return QP_OK;
}

/* Enqueues a kernel whose arguments are set. Whatever others may wait for is flushed: OpenCL promises no more that it starts otherwise. */
static qp_status enqueue(qp_device *device, cl_kernel object, size_t local, size_t global,
                         const qp_turn *turn, cl_event *event, qp_error *err) {
    cl_command_queue queue;
    qp_status status = use_queue(device, turn->queue, &queue, err);
    if (status != QP_OK) return status;
    cl_event *after = NULL;
    if (turn->n_after != 0) {
        after = qp_alloc(turn->n_after, sizeof *after, false);
        if (after == NULL) return qp_fail_memory(err, turn->n_after * sizeof *after, "a launch");
        for (uint32_t i = 0; i < turn->n_after; ++i) after[i] = turn->after[i]->object;
    }
    cl_int code =
        clEnqueueNDRangeKernel(queue, object, 1, NULL, &global, &local, turn->n_after, after, event);
    free(after);
    if (code != CL_SUCCESS) return qp_cl_check(code, "clEnqueueNDRangeKernel", device, err);
    return turn->event == NULL ? QP_OK : qp_cl_check(clFlush(queue), "clFlush", device, err);
}

qp_status qp_launch(qp_device *device, const qp_program *program, qp_kernel_id kernel, const qp_arg *args,
                    uint32_t n_args, uint32_t groups, double *ms, qp_error *err) {
    return qp_launch_in_turn(device, program, kernel, args, n_args, groups, &(qp_turn){0}, ms, err);
}

qp_status qp_launch_in_turn(qp_device *device, const qp_program *program, qp_kernel_id kernel,
                            const qp_arg *args, uint32_t n_args, uint32_t groups, const qp_turn *turn,
                            double *ms, qp_error *err) {
    if (groups == 0) return QP_OK;
    if (n_args > MAX_ARGS)
        return qp_fail(err, QP_SYSTEM, "a kernel has more than %d arguments", (int)MAX_ARGS);
    if (device->host) {
        launch_host(program, kernel, args, n_args, groups, turn->event, ms);
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
    cl_event event = NULL;
    qp_status status = enqueue(device, object, local, global, turn, &event, err);
    if (event != NULL) device->pending[device->n_pending++] = (qp_pending){event, ms, turn->event};
    if (turn->event != NULL) *turn->event = (qp_event){.object = event};
    return status;
}

qp_status qp_device_finish(qp_device *device, qp_error *err) {
    if (device->host) return QP_OK;
    qp_status status = qp_cl_check(clFinish(device->queue), "clFinish", device, err);
    for (size_t i = 0; i < QP_QUEUES - 1; ++i) {
        if (device->more_queues[i] == NULL) continue;
        const cl_int code = clFinish(device->more_queues[i]);
        if (status == QP_OK) status = qp_cl_check(code, "clFinish", device, err);
    }
    for (size_t i = 0; i < device->n_pending; ++i) {
        cl_event event = device->pending[i].event;
        cl_int run = CL_COMPLETE;
        cl_ulong start = 0, end = 0;
        /* In Mesa 22.3 clFinish does not wait for what clFlush has sent on its way. Failures are found below. */
        clWaitForEvents(1, &event);
        if (status == QP_OK)
            status =
                qp_cl_check(clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof run, &run, NULL),
                            "clGetEventInfo", device, err);
        if (status == QP_OK && run < 0) status = qp_cl_check(run, "a kernel", device, err);
        /* A device without a clock leaves the time at 0. */
        if (clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof start, &start, NULL) ==
                CL_SUCCESS &&
            clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, NULL) == CL_SUCCESS &&
            end > start) {
            *device->pending[i].ms += (double)(end - start) * 1e-6;
            if (device->pending[i].asked != NULL) {
                device->pending[i].asked->start_ms = (double)start * 1e-6;
                device->pending[i].asked->end_ms = (double)end * 1e-6;
            }
        }
        clReleaseEvent(event);
    }
    device->n_pending = 0;
    return status;
}
