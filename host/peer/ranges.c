#include "host/peer/peer.h"

typedef void range_body(void *context, uint64_t begin, uint64_t end);

#ifdef _OPENMP

void qp_peer_ranges(uint64_t count, uint64_t chunk, unsigned threads, range_body *body, void *context) {
    const int64_t chunks = (int64_t)((count + chunk - 1) / chunk);
#pragma omp parallel for schedule(dynamic) num_threads((int)threads)
    for (int64_t i = 0; i < chunks; ++i) {
        const uint64_t begin = (uint64_t)i * chunk, left = count - begin;
        body(context, begin, begin + (left < chunk ? left : chunk));
    }
}

#else

typedef struct job {
    range_body *body;
    void *context;
} job;

static void run(void *context, size_t begin, size_t end, unsigned worker) {
    const job *j = context;
    (void)worker;
    j->body(j->context, begin, end);
}

void qp_peer_ranges(uint64_t count, uint64_t chunk, unsigned threads, range_body *body, void *context) {
    job j = {body, context};
    if (threads <= 1)
        body(context, 0, count);
    else
        qp_parallel((size_t)count, (size_t)chunk, run, &j);
}

#endif
