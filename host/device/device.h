/* Devices: OpenCL or the host itself, behind one small set of calls (buffers, programs, launches), so that a
 * frame is written once. OpenCL names stay inside this folder. */
#ifndef QP_DEVICE_DEVICE_H
#define QP_DEVICE_DEVICE_H

#include "host/base/status.h"

/* ---- Choice ---- */

typedef struct qp_device_info {
    char id[32]; /* "P.D", or "host" */
    char name[256], platform[256], version[256];
    bool has_double, is_cpu, rounds_correctly; /* divides and takes roots in float correctly rounded */
    bool slow_fma; /* has no fma in hardware, and its own program for it is to be avoided (kernels/real.h) */
    bool checks_races; /* Oclgrind */
    bool has_clock; /* that kernels can read: qp_device_ticks */
    bool is_native; /* kernels are x86-64 code that Linux runs, so that they can make system calls */
    uint32_t compute_units;
    uint64_t memory_bytes, max_buffer_bytes;
} qp_device_info;

/* Every OpenCL device and, last, the host. *list is malloced for the caller. Never fails for want of OpenCL.
 */
qp_status qp_device_list(qp_device_info **list, size_t *count, qp_error *err);

/* Index of the OpenCL device that `which` means among n, or n when there is none such. "" is the default: PoCL's CPU device, else
 * the first that has double and divides correctly rounded, else the first that has double, else the first; so that it does not
 * depend on the order in which the loader finds drivers. */
size_t qp_device_choose(const qp_device_info *list, size_t n, const char *which);

/* Filled in when the device was opened; owned by it. */
const qp_device_info *qp_device_get_info(const qp_device *device);
bool qp_device_is_host(const qp_device *device);
/* The clock that kernels of this device read, now; 0 where they have none. */
uint64_t qp_device_ticks(const qp_device *device);

/* ---- Memory ---- */

/* Zero-initialise; free with qp_buffer_free. */
typedef struct qp_buffer {
    size_t bytes;
    void *host;   /* host device, or wrapped memory */
    void *owned;  /* host, where the buffer allocated it */
    void *object; /* cl_mem */
    void *mapped; /* wrapped memory while the host may read it */
} qp_buffer;

/* Room for `bytes`, contents undefined; an existing buffer that is large enough is kept. `what` is for
 * messages. */
qp_status qp_buffer_reserve(qp_device *device, qp_buffer *buffer, size_t bytes, const char *what,
                            qp_error *err);
/* Copies bytes from host memory to the start of the buffer. */
qp_status qp_buffer_write(qp_device *device, qp_buffer *buffer, const void *from, size_t bytes,
                          qp_error *err);
/* Waits, and copies `bytes` from `offset` on to host memory. */
qp_status qp_buffer_read(qp_device *device, const qp_buffer *buffer, size_t offset, void *to, size_t bytes,
                         qp_error *err);
/* Makes host memory, which must outlive the buffer, the store of a buffer that kernels write. */
qp_status qp_buffer_wrap(qp_device *device, qp_buffer *buffer, void *memory, size_t bytes, const char *what,
                         qp_error *err);
/* Waits, and makes what kernels wrote to a wrapped buffer visible in its memory, until qp_buffer_unmap. */
qp_status qp_buffer_map(qp_device *device, qp_buffer *buffer, qp_error *err);
/* Must come before kernels write again. Does nothing for a buffer that is not mapped. */
qp_status qp_buffer_unmap(qp_device *device, qp_buffer *buffer, qp_error *err);
void qp_buffer_free(qp_device *device, qp_buffer *buffer);

/* ---- Kernels ---- */

typedef enum qp_kernel_id {
    QP_KERNEL_HULL,
    QP_KERNEL_DOMAIN,
    QP_KERNEL_REGULAR,
    QP_KERNEL_FUSED,
    QP_KERNEL_STREAM_HULL,
    QP_KERNEL_STREAM_DOMAIN,
    QP_KERNEL_CACHED_HULL,
    QP_KERNEL_CACHE_FORGET,
    QP_KERNELS
} qp_kernel_id;

/* Zero-initialise; free with qp_program_free. */
typedef struct qp_program {
    qp_precision precision;
    void *object; /* cl_program */
    void *kernels[QP_KERNELS];
    const struct qp_host_kernels *host;
} qp_program;

/* Compiles the kernels whose bits (1 << qp_kernel_id) are set, with the code that plans of these QP_PLAN_*
 * flags need. Sources are those built into the library, or the files in the folder that QUADPLAN_KERNELS
 * names. */
qp_status qp_program_build(qp_device *device, qp_precision precision, unsigned kernels, uint32_t plan_flags,
                           qp_program *program, qp_error *err);
void qp_program_free(qp_program *program);

/* An argument of a kernel: a buffer, or a 32-bit number where buffer is NULL. */
typedef struct qp_arg {
    const qp_buffer *buffer;
    uint32_t number;
} qp_arg;

/* Starts groups work-groups; nothing when groups is 0. The time it takes is added to *ms by qp_device_finish
 * (by the device's own clock; by the wall clock on the host): *ms must live until then. */
qp_status qp_launch(qp_device *device, const qp_program *program, qp_kernel_id kernel, const qp_arg *args,
                    uint32_t n_args, uint32_t groups, double *ms, qp_error *err);

/* Launches that others wait for, in several queues. A queue runs its launches one after the other; those of different queues run in
 * any order, or at one time, but for what they wait for. Everything else of this file is in queue 0. On the host a launch is done when
 * the call returns, whatever the queue: launches run in the order in which they are given. */
enum { QP_QUEUES = 3 };
/* A launch that was given. Must live until qp_device_finish, which fills in when it ran, by the clock that times launches, in
 * milliseconds; both 0 where the device has none. */
typedef struct qp_event {
    void *object; /* cl_event, of the device */
    double start_ms, end_ms;
} qp_event;
/* Where a launch goes, and what it waits for: launches that were given before, in any queue. Zero-initialise for queue 0. */
typedef struct qp_turn {
    unsigned queue;               /* below QP_QUEUES */
    const qp_event *const *after; /* [n_after] */
    uint32_t n_after;
    qp_event *event; /* or NULL */
} qp_turn;
qp_status qp_launch_in_turn(qp_device *device, const qp_program *program, qp_kernel_id kernel,
                            const qp_arg *args, uint32_t n_args, uint32_t groups, const qp_turn *turn,
                            double *ms, qp_error *err);

/* Waits for everything that was started. */
qp_status qp_device_finish(qp_device *device, qp_error *err);

#endif
