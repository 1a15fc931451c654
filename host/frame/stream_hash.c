/* The hash of a vertex stream: a hash of the hashes of its blocks of a megabyte, so that threads can share the work, and so that it
 * can be taken of a stream that comes in pieces. */
#include "host/base/status.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCK = 1 << 20 };

struct qp_stream_hasher {
    uint64_t length;  /* bytes so far */
    uint64_t *hashes; /* [length / BLOCK] of the blocks that are whole, with room for one more */
    size_t capacity;
    char *rest; /* the bytes behind those */
};

qp_status qp_stream_hasher_create(qp_stream_hasher **hasher, qp_error *err) {
    *hasher = NULL;
    qp_stream_hasher *h = qp_alloc(1, sizeof *h, true);
    if (h != NULL) h->rest = qp_alloc(BLOCK, 1, false);
    if (h == NULL || h->rest == NULL || !qp_grow((void **)&h->hashes, &h->capacity, 1, sizeof *h->hashes)) {
        qp_stream_hasher_free(h);
        return qp_fail_memory(err, BLOCK, "hashes");
    }
    *hasher = h;
    return QP_OK;
}

void qp_stream_hasher_free(qp_stream_hasher *hasher) {
    if (hasher == NULL) return;
    free(hasher->hashes);
    free(hasher->rest);
    free(hasher);
}

typedef struct hash_job {
    const char *first; /* block 0, where it is not the first of `bytes` */
    const char *bytes; /* the other blocks */
    uint64_t number;   /* of block 0 in the stream */
    uint64_t *hashes;
} hash_job;

static void hash_blocks(void *context, size_t begin, size_t end, unsigned worker) {
    const hash_job *job = context;
    (void)worker;
    for (size_t b = begin; b < end; ++b) {
        const size_t skip = job->first != NULL;
        const char *block = skip && b == 0 ? job->first : job->bytes + (b - skip) * (size_t)BLOCK;
        job->hashes[b] = qp_hash(block, BLOCK, job->number + b);
    }
}

qp_status qp_stream_hasher_add(qp_stream_hasher *h, const void *bytes, size_t length, qp_error *err) {
    const size_t done = (size_t)(h->length / BLOCK), have = (size_t)(h->length % BLOCK);
    const size_t blocks = length / BLOCK + (have + length % BLOCK) / BLOCK;
    const char *from = bytes;
    if (length == 0) return QP_OK;
    if (!qp_grow((void **)&h->hashes, &h->capacity, done + blocks + 1, sizeof *h->hashes))
        return qp_fail_memory(err, (done + blocks + 1) * sizeof *h->hashes, "hashes");
    const size_t missing = have == 0 ? 0 : BLOCK - have, head = missing < length ? missing : length;
    if (head != 0) memcpy(h->rest + have, from, head);
    hash_job job = {have != 0 ? h->rest : NULL, from + head, done, h->hashes + done};
    qp_parallel(blocks, 1, hash_blocks, &job);
    h->length += length;
    const size_t tail = blocks == 0 && have != 0 ? 0 : (size_t)(h->length % BLOCK);
    if (tail != 0) memcpy(h->rest, from + (length - tail), tail);
    return QP_OK;
}

uint64_t qp_stream_hasher_value(const qp_stream_hasher *h) {
    const size_t rest = (size_t)(h->length % BLOCK);
    size_t blocks = (size_t)(h->length / BLOCK);
    if (rest != 0) {
        h->hashes[blocks] = qp_hash(h->rest, rest, blocks);
        ++blocks;
    }
    return qp_hash(h->hashes, blocks * sizeof *h->hashes, h->length);
}
