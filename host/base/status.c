#define _GNU_SOURCE
#include "host/base/status.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

qp_status qp_fail(qp_error *err, qp_status status, const char *format, ...) {
    if (err != NULL) {
        va_list args;
        va_start(args, format);
        vsnprintf(err->message, sizeof err->message, format, args);
        va_end(args);
        err->status = status;
        /* One line, whatever a file name or a tag contained. */
        for (char *c = err->message; *c != '\0'; ++c) {
            if ((unsigned char)*c < 0x20 || *c == 0x7f) *c = '?';
        }
    }
    return status;
}

qp_status qp_fail_memory(qp_error *err, size_t bytes, const char *what) {
    return qp_fail(err, QP_SYSTEM, "out of memory (%zu bytes for %s)", bytes, what);
}

void *qp_alloc(size_t count, size_t size, bool zero) {
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes)) return NULL;
    if (bytes == 0) bytes = 1;
    return zero ? calloc(1, bytes) : malloc(bytes);
}

bool qp_grow(void **block, size_t *capacity, size_t need, size_t size) {
    if (need <= *capacity) return true;
    size_t wanted = *capacity + *capacity / 2 + 16;
    if (wanted < need) wanted = need;
    size_t bytes;
    if (__builtin_mul_overflow(wanted, size, &bytes)) return false;
    void *grown = realloc(*block, bytes);
    if (grown == NULL) return false;
    *block = grown;
    *capacity = wanted;
    return true;
}

double qp_now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

unsigned qp_thread_count(void) {
    const char *wish = getenv("QUADPLAN_THREADS");
    if (wish != NULL) {
        long n = strtol(wish, NULL, 10);
        if (n >= 1 && n <= 1024) return (unsigned)n;
    }
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) {
        int n = CPU_COUNT(&set);
        if (n >= 1) return (unsigned)n;
    }
    return 1;
}

typedef struct parallel_job {
    atomic_size_t next;
    atomic_uint worker;
    size_t count, chunk;
    void (*body)(void *, size_t, size_t, unsigned);
    void *context;
} parallel_job;

static void *parallel_run(void *argument) {
    parallel_job *job = argument;
    unsigned worker = atomic_fetch_add(&job->worker, 1u);
    for (;;) {
        size_t begin = atomic_fetch_add(&job->next, job->chunk);
        if (begin >= job->count) return NULL;
        size_t end = job->count - begin < job->chunk ? job->count : begin + job->chunk;
        job->body(job->context, begin, end, worker);
    }
}

void qp_parallel(size_t count, size_t chunk, void (*body)(void *, size_t, size_t, unsigned), void *context) {
    parallel_job job = {.count = count, .chunk = chunk == 0 ? 1 : chunk, .body = body, .context = context};
    unsigned wanted = qp_thread_count();
    size_t chunks = count / job.chunk + (count % job.chunk != 0);
    if (wanted > chunks) wanted = (unsigned)chunks;
    pthread_t threads[64];
    unsigned started = 0;
    /* A thread that cannot be had is no error: the others take its chunks. */
    while (started + 1 < wanted && started < 64) {
        if (pthread_create(&threads[started], NULL, parallel_run, &job) != 0) break;
        ++started;
    }
    parallel_run(&job);
    for (unsigned i = 0; i < started; ++i) pthread_join(threads[i], NULL);
}

uint64_t qp_hash(const void *bytes, size_t length, uint64_t seed) {
    const unsigned char *p = bytes;
    uint64_t h = 0xcbf29ce484222325ull ^ seed;
    while (length >= 8) {
        uint64_t word;
        memcpy(&word, p, 8);
        h = (h ^ word) * 0x9e3779b97f4a7c15ull;
        h ^= h >> 29;
        p += 8;
        length -= 8;
    }
    while (length-- > 0) h = (h ^ *p++) * 0x100000001b3ull;
    h ^= h >> 32;
    h *= 0xd6e8feb86659fd93ull;
    return h ^ (h >> 32);
}
