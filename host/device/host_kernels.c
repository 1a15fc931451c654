/* The kernels for any processor; fma may be a call of the C library here. */
#define _GNU_SOURCE
#define QP_HOST_TABLE qp_host_kernels_any
#include "host/device/host_kernels_body.h"

#include <sched.h>
#include <stdbool.h>
#include <stdlib.h>
#include <time.h>

/* Another thread has what this one waits for, and there may be more threads than processors. */
void qp_host_wait(uint32_t round) {
    if (round >= QP_WAIT_ROUNDS) sched_yield();
}

uint64_t qp_host_clock(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

const qp_host_kernels *qp_host_kernels_for(qp_precision precision) {
#ifdef __x86_64__
    const char *plain = getenv("QUADPLAN_HOST_PLAIN");
    const bool any = plain != NULL && plain[0] != '\0';
    if (!any && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return &qp_host_kernels_fma[precision];
#endif
    return &qp_host_kernels_any[precision];
}
