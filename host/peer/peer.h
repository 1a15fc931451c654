/* Other libraries that evaluate Catmull-Clark surfaces, behind one C face, for benchmarks. They are loaded as modules
 * when they are needed: one for OpenSubdiv, one for Embree. Each is a list of *series*: a way to evaluate, mostly at
 * several levels. */
#ifndef QP_PEER_PEER_H
#define QP_PEER_PEER_H

#ifdef __cplusplus
extern "C" {
#endif

#include "host/mesh/mesh.h" /* inside: the house's own headers are plain C */

/* Samples' (u,v) are multiples of this, so that each peer's own coordinates of the children of n-gons hold them exactly.
 */
#define QP_PEER_GRID 0x1p-20

/* What is to be evaluated; lives as long as the peers that were made of it. */
typedef struct qp_peer_task {
    const qp_mesh *mesh;
    uint64_t count;        /* samples, patch after patch, none of a patch without surface */
    const uint32_t *patch; /* [count] as ours are numbered */
    const float *uv;       /* [2 * count] */
    unsigned threads;      /* for series that use more than one */
    /* Where evaluations put position and both derivatives, however a peer arranges them: all peers share it.
     * QP_PEER_OUT_BYTES(count) bytes, 64-byte aligned. */
    void *out;
} qp_peer_task;

enum { QP_PEER_BLOCK = 4096 }; /* room for count rounded up to whole blocks of this */
#define QP_PEER_OUT_BYTES(count)                                                                             \
    (((uint64_t)(count) / QP_PEER_BLOCK + 1) * QP_PEER_BLOCK * 9 * sizeof(double))

typedef struct qp_peer_series qp_peer_series;

/* One configuration, set up. Implementations begin with this. */
typedef struct qp_peer {
    const qp_peer_series *series;
    const qp_peer_task *task;
    double setup_ms;  /* topology: refinement, tables */
    double locate_ms; /* finding the samples' places in them */
    uint64_t bytes;   /* of tables and points, 0 where the library does not tell */
    /* [count] 1 for samples where the peer's rules make another surface, which say nothing about its error; NULL: there
     * are none. */
    const uint8_t *apart;
} qp_peer;

struct qp_peer_series {
    const char *name, *library;
    unsigned first_level, last_level; /* both 0: there are no levels */
    bool parallel;                    /* uses task->threads, else one */
    bool in_double;
    int variant; /* what the series' functions tell series apart by */
    /* Sets one level up. QP_BAD_INPUT when the peer cannot take the mesh, or would make another surface of it; the
     * message says why. */
    qp_status (*create)(const qp_peer_series *series, const qp_peer_task *task, unsigned level,
                        qp_peer **peer, qp_error *err);
    /* One frame: whatever follows from the mesh's positions, then all samples into task->out. */
    qp_status (*evaluate)(qp_peer *peer, qp_error *err);
    /* Sample i of what the last evaluation put into task->out. */
    void (*read)(const qp_peer *peer, uint64_t i, double p[3], double du[3], double dv[3]);
    void (*free)(qp_peer *peer);
};

enum { QP_PEER_LISTS = 2 };
typedef struct qp_peer_module {
    struct {
        const qp_peer_series *series;
        unsigned count;
    } lists[QP_PEER_LISTS];
} qp_peer_module;

/* The one symbol of a module, of type `const qp_peer_module`. */
#define QP_PEER_MODULE_SYMBOL "qp_peer_module_table"
extern QP_API const qp_peer_module qp_peer_module_table;

/* Runs body(context, begin, end) over ranges of at most `chunk` of [0, count) on `threads` threads, kept from call to
 * call where the compiler has OpenMP. (ranges.c) */
void qp_peer_ranges(uint64_t count, uint64_t chunk, unsigned threads,
                    void (*body)(void *context, uint64_t begin, uint64_t end), void *context);

#ifdef __cplusplus
}
#endif
#endif
