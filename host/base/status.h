/* Errors with one line of text, checked allocation, warnings. */
#ifndef QP_BASE_STATUS_H
#define QP_BASE_STATUS_H

#include "quadplan.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Fills *err (when not NULL) and returns status, so that a caller can write `return qp_fail(...)`. */
qp_status qp_fail(qp_error *err, qp_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* "out of memory (N bytes for WHAT)" */
qp_status qp_fail_memory(qp_error *err, size_t bytes, const char *what);

/* count * size bytes, zeroed when `zero`; NULL on overflow or when memory is out. A count of 0 gives a
 * non-NULL block. */
void *qp_alloc(size_t count, size_t size, bool zero);

/* Grows *block so that it holds at least `need` elements; *capacity is kept. False when memory is out (block
 * kept). */
bool qp_grow(void **block, size_t *capacity, size_t need, size_t size);

/* Wall clock in milliseconds from an arbitrary origin (CLOCK_MONOTONIC). */
double qp_now_ms(void);

/* Processors this process may use (at least 1; QUADPLAN_THREADS overrides). */
unsigned qp_thread_count(void);

/* Runs body(context, begin, end, worker) over [0, count) in chunks on qp_thread_count() threads and waits.
 * body must not fail across threads other than by recording into context. */
void qp_parallel(size_t count, size_t chunk,
                 void (*body)(void *context, size_t begin, size_t end, unsigned worker), void *context);

/* 64-bit hash of bytes (FNV-1a folded by a multiply-xor finaliser); for tables and stream hashes. */
uint64_t qp_hash(const void *bytes, size_t length, uint64_t seed);

#ifdef __cplusplus
}
#endif
#endif
