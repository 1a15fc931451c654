/* What the files of this folder share about OpenCL. */
#ifndef QP_DEVICE_OPENCL_H
#define QP_DEVICE_OPENCL_H

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include "host/device/device.h"

typedef struct qp_pending {
    cl_event event;
    double *ms;
    qp_event *asked; /* or NULL */
} qp_pending;

struct qp_device {
    qp_device_info info;
    bool host;
    cl_device_id id;
    cl_context context;
    cl_command_queue queue, more_queues[QP_QUEUES - 1]; /* the latter when they are first used */
    uint32_t lanes_float, lanes_double; /* of the device's registers; 1 where items are lanes themselves */
    uint32_t items;      /* work-items of every group, from QUADPLAN_GROUP_ITEMS; 0: as each kernel likes */
    qp_pending *pending; /* launches whose time is still to be read */
    size_t n_pending, pending_capacity;
};

/* "CL_OUT_OF_RESOURCES" and so on. */
const char *qp_cl_error_name(cl_int code);

/* QP_OK, or QP_SYSTEM with "CALL failed on DEVICE: NAME". device may be NULL. */
qp_status qp_cl_check(cl_int code, const char *call, const qp_device *device, qp_error *err);

#endif
