/* Memory of a device. */
#include "host/device/opencl.h"

#include <stdlib.h>
#include <string.h>

static qp_status too_large(const qp_device *device, size_t bytes, const char *what, qp_error *err) {
    return qp_fail(err, QP_SYSTEM, "%s needs %zu bytes, and a buffer of %s may have %llu", what, bytes,
                   device->info.name, (unsigned long long)device->info.max_buffer_bytes);
}

qp_status qp_buffer_reserve(qp_device *device, qp_buffer *buffer, size_t bytes, const char *what,
                            qp_error *err) {
    if (bytes == 0) bytes = 1; /* OpenCL has no empty buffers */
    if (bytes <= buffer->bytes) return QP_OK;
    qp_buffer_free(device, buffer);
    if (bytes > device->info.max_buffer_bytes) return too_large(device, bytes, what, err);
    if (device->host) {
        size_t rounded = bytes > SIZE_MAX - 63 ? bytes : (bytes + 63) & ~(size_t)63;
        buffer->host = buffer->owned = aligned_alloc(64, rounded);
        if (buffer->host == NULL) return qp_fail_memory(err, bytes, what);
    } else {
        cl_int code;
        buffer->object = clCreateBuffer(device->context, CL_MEM_READ_WRITE, bytes, NULL, &code);
        if (code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_HOST_MEMORY)
            return qp_fail_memory(err, bytes, what);
        if (code != CL_SUCCESS) return qp_cl_check(code, "clCreateBuffer", device, err);
    }
    buffer->bytes = bytes;
    return QP_OK;
}

qp_status qp_buffer_write(qp_device *device, qp_buffer *buffer, const void *from, size_t bytes,
                          qp_error *err) {
    if (bytes == 0) return QP_OK;
    if (device->host) {
        memcpy(buffer->host, from, bytes);
        return QP_OK;
    }
    cl_int code = clEnqueueWriteBuffer(device->queue, buffer->object, CL_TRUE, 0, bytes, from, 0, NULL, NULL);
    return qp_cl_check(code, "clEnqueueWriteBuffer", device, err);
}

qp_status qp_buffer_read(qp_device *device, const qp_buffer *buffer, size_t offset, void *to, size_t bytes,
                         qp_error *err) {
    if (bytes == 0) return QP_OK;
    if (device->host) {
        memcpy(to, (const char *)buffer->host + offset, bytes);
        return QP_OK;
    }
    cl_int code =
        clEnqueueReadBuffer(device->queue, buffer->object, CL_TRUE, offset, bytes, to, 0, NULL, NULL);
    return qp_cl_check(code, "clEnqueueReadBuffer", device, err);
}

qp_status qp_buffer_wrap(qp_device *device, qp_buffer *buffer, void *memory, size_t bytes, const char *what,
                         qp_error *err) {
    qp_buffer_free(device, buffer);
    if (bytes > device->info.max_buffer_bytes) return too_large(device, bytes, what, err);
    if (!device->host) {
        cl_int code;
        buffer->object =
            clCreateBuffer(device->context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes, memory, &code);
        if (code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_HOST_MEMORY)
            return qp_fail_memory(err, bytes, what);
        if (code != CL_SUCCESS) return qp_cl_check(code, "clCreateBuffer", device, err);
    }
    buffer->host = memory;
    buffer->bytes = bytes;
    return QP_OK;
}

qp_status qp_buffer_map(qp_device *device, qp_buffer *buffer, qp_error *err) {
    if (device->host || buffer->mapped != NULL) return QP_OK;
    cl_int code;
    buffer->mapped = clEnqueueMapBuffer(device->queue, buffer->object, CL_TRUE, CL_MAP_READ, 0, buffer->bytes,
                                        0, NULL, NULL, &code);
    return qp_cl_check(code, "clEnqueueMapBuffer", device, err);
}

qp_status qp_buffer_unmap(qp_device *device, qp_buffer *buffer, qp_error *err) {
    if (buffer->mapped == NULL) return QP_OK;
    cl_int code = clEnqueueUnmapMemObject(device->queue, buffer->object, buffer->mapped, 0, NULL, NULL);
    buffer->mapped = NULL;
    return qp_cl_check(code, "clEnqueueUnmapMemObject", device, err);
}

void qp_buffer_free(qp_device *device, qp_buffer *buffer) {
    if (buffer->object != NULL) {
        qp_buffer_unmap(device, buffer, NULL);
        clFinish(device->queue); /* wrapped memory may go as soon as we return */
        clReleaseMemObject(buffer->object);
    } else if (device->host) {
        free(buffer->owned);
    }
    *buffer = (qp_buffer){0};
}
