/* The kernels compiled as C into the library: the device "host". */
#ifndef QP_DEVICE_HOST_KERNELS_H
#define QP_DEVICE_HOST_KERNELS_H

#include "quadplan.h"

/* An argument of a kernel: memory, or a 32-bit number where memory is NULL. */
typedef struct qp_host_arg {
    void *memory;
    uint32_t number;
} qp_host_arg;

/* Runs work-group `group` of a kernel with its arguments in the order of the kernel's parameters. */
typedef void (*qp_host_kernel)(const qp_host_arg *args, size_t group);

/* One entry a qp_kernel_id (device.h). */
typedef struct qp_host_kernels {
    qp_host_kernel hull, domain, regular, fused, stream_hull, stream_domain, cached_hull, cache_forget;
} qp_host_kernels;

/* The best build of the kernels for this processor. All builds give the same bits. */
const qp_host_kernels *qp_host_kernels_for(qp_precision precision);

/* What kernels call when they wait for another work-group, with the number of rounds so far; and their clock, in nanoseconds. */
void qp_host_wait(uint32_t round);
uint64_t qp_host_clock(void);

/* Builds by instruction set, by qp_precision; the second one exists on x86-64 only. */
extern const qp_host_kernels qp_host_kernels_any[2];
extern const qp_host_kernels qp_host_kernels_fma[2];

#endif
