/* One source, two compilers: the kernels are OpenCL C 1.2, and through this header C11, so that the host can
 * run the very same lines (under sanitizers, in a debugger, or where there is no device) and make the same
 * bits.
 *
 * The host runs a work-group as one work-item: kernels stride over their work by get_local_size and so do all
 * of it. Nothing but correctly rounded operations is used: + - * fma, and / sqrt by way of qp_div and qp_sqrt
 * (real.h). Contraction is off in both languages.
 *
 * A program is the concatenation portable.h plan_layout.h frame_layout.h ring_layout.h ring.h real.h spline.h and the stages'
 * files. */
#ifndef QP_KERNELS_PORTABLE_H
#define QP_KERNELS_PORTABLE_H

/* Rounds that an item waits for others (qp_wait) before it makes room for them. */
#define QP_WAIT_ROUNDS 30u

#ifdef __OPENCL_VERSION__

#pragma OPENCL FP_CONTRACT OFF
#ifdef QP_REAL_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif
#define QP_NAME(name) name
#define QP_FUNCTION static inline __attribute__((always_inline))
/* A whole stage, which several kernels call: the host compiles it once. */
#define QP_STAGE QP_FUNCTION
#define QP_GROUP /* a kernel's last parameter on the host: which work-group it is */

/* Words that work-groups share. OpenCL 1.2's atomics order nothing else: qp_release() comes after the writes of a work-item
 * that others are to see, and before the atomic that tells them; qp_acquire() after the atomic that told, and before the reads. */
#ifdef QP_KERNEL_YIELD /* clang for this processor: its loads and stores will do */
#define qp_atomic_load(p) __atomic_load_n((p), __ATOMIC_ACQUIRE)
#define qp_atomic_store(p, value) __atomic_store_n((p), (value), __ATOMIC_RELEASE)
#else
#define qp_atomic_load(p) atomic_add((p), 0u)
#define qp_atomic_store(p, value) ((void)atomic_xchg((p), (value)))
#endif
#define qp_atomic_add(p, value) atomic_add((p), (value))
#define qp_atomic_sub(p, value) atomic_sub((p), (value))
#define qp_atomic_max(p, value) atomic_max((p), (value))
#define qp_atomic_exchange(p, value) atomic_xchg((p), (value))
#define qp_atomic_swap(p, expected, value) (atomic_cmpxchg((p), (expected), (value)) == (expected))
#define qp_release() mem_fence(CLK_GLOBAL_MEM_FENCE)
#define qp_acquire() mem_fence(CLK_GLOBAL_MEM_FENCE)
/* One word, whole, in no order with others but by qp_acquire and qp_release. */
#ifdef QP_WORD_ATOMICS /* for a checker of races, which takes words to be shared on purpose by their atomics */
#define qp_word_load(p) atomic_add((volatile __global uint *)(p), 0u)
#define qp_word_store(p, value) ((void)atomic_xchg((volatile __global uint *)(p), (value)))
#else
#define qp_word_load(p) (*(volatile __global const uint *)(p))
#define qp_word_store(p, value) ((void)(*(volatile __global uint *)(p) = (value)))
#endif
/* A word of local memory, to tell or count among the items of a group. */
#define qp_local_add(p, value) atomic_add((p), (value))
#define qp_popcount(x) popcount(x)
/* Once a round while an item waits for others, with the number of rounds so far. Where kernels run on Linux as code of the processor's
 * own (QP_KERNEL_YIELD: 24 is sched_yield), the thread makes room after some, for the one that is waited for may have been put aside
 * in its favour. */
#ifdef QP_KERNEL_YIELD
QP_FUNCTION void qp_wait(uint round) {
    long call = 24;
    if (round < QP_WAIT_ROUNDS)
        __asm__ volatile("pause" : : : "memory");
    else
        __asm__ volatile("syscall" : "+a"(call) : : "rcx", "r11", "memory");
}
#else
#define qp_wait(round) ((void)(round))
#endif
/* With QP_KERNEL_CLOCK: ticks of a clock that all work-groups share. */
#define qp_clock() ((ulong)__builtin_readcyclecounter())

#else

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif
#define __kernel static
#define __global
#define __local
#define CLK_LOCAL_MEM_FENCE 0
#define CLK_GLOBAL_MEM_FENCE 0
#define barrier(fence) ((void)0)
#define get_group_id(dimension) (qp_group)
#define get_local_id(dimension) 0u
#define get_local_size(dimension) 1u
/* Inlining all costs some time to compile and is worth a fifth of the run time; with sanitizers it would cost minutes. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define QP_FUNCTION static inline
#else
#define QP_FUNCTION static inline __attribute__((always_inline))
#endif
#define QP_STAGE static __attribute__((noinline))
#define QP_GROUP , size_t qp_group
#define qp_atomic_load(p) __atomic_load_n((p), __ATOMIC_ACQUIRE)
#define qp_atomic_store(p, value) __atomic_store_n((p), (value), __ATOMIC_RELEASE)
#define qp_atomic_add(p, value) __atomic_fetch_add((p), (value), __ATOMIC_ACQ_REL)
#define qp_atomic_sub(p, value) __atomic_fetch_sub((p), (value), __ATOMIC_ACQ_REL)
#define qp_atomic_exchange(p, value) __atomic_exchange_n((p), (value), __ATOMIC_ACQ_REL)
#define qp_atomic_max(p, value) qp_host_atomic_max((p), (value))
#define qp_atomic_swap(p, expected, value) qp_host_atomic_swap((p), (expected), (value))
#define qp_release() ((void)0)
#define qp_acquire() ((void)0)
#define qp_word_load(p) __atomic_load_n((p), __ATOMIC_ACQUIRE)
#define qp_word_store(p, value) __atomic_store_n((p), (value), __ATOMIC_RELEASE)
#define qp_local_add(p, value) (*(p) += (value))
#define qp_popcount(x) ((uint32_t)__builtin_popcount(x))
/* host_kernels.c */
void qp_host_wait(uint32_t round);
uint64_t qp_host_clock(void);
#define qp_wait(round) qp_host_wait(round)
#define QP_KERNEL_CLOCK 1
#define qp_clock() qp_host_clock()
static inline void qp_host_atomic_max(volatile uint32_t *p, uint32_t value) {
    uint32_t seen = __atomic_load_n(p, __ATOMIC_RELAXED);
    while (seen < value && !__atomic_compare_exchange_n(p, &seen, value, 0, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED)) {}
}
static inline int qp_host_atomic_swap(volatile uint32_t *p, uint32_t expected, uint32_t value) {
    return __atomic_compare_exchange_n(p, &expected, value, 0, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE);
}
#define uint uint32_t
#define ulong uint64_t
#define uchar uint8_t

#endif

/* What the surface's plans contain; a program is built without the rest. */
#ifndef QP_WITH_INTERNAL
#define QP_WITH_INTERNAL 1
#endif
#ifndef QP_WITH_CREASE
#define QP_WITH_CREASE 1
#endif
#ifndef QP_WITH_TERMINAL
#define QP_WITH_TERMINAL 1
#endif
#ifndef QP_WITH_CORNERS
#define QP_WITH_CORNERS 1
#endif
/* 0: the kernels `hull` and `domain` themselves are left out, where others call what they are made of. */
#ifndef QP_WITH_STAGES
#define QP_WITH_STAGES 1
#endif

#endif
