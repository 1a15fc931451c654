/* quadplan cache, inside: what it finds out, and who prints it. */
#ifndef QP_CLI_CACHE_H
#define QP_CLI_CACHE_H

#include "host/cli/supports.h"
#include "host/cli/views.h"

enum { CACHE_MOST_PASSES = 256, CACHE_MOST_REPEATS = 100 };

/* A cache after some passes from empty: sums over them. */
typedef struct cache_row {
    uint64_t cache_bytes;    /* as asked for; with policy all, what it takes */
    uint64_t capacity_bytes; /* what it takes, tags included */
    uint64_t passes;
    int policy; /* index into CLI_CACHE_POLICIES */
    uint64_t needed, computed, hits, cold, capacity, conflict, duplicates;
    uint64_t held_bytes, index_bytes;  /* points that it holds after these passes; tables beside it */
    double hull_ms, scratch_ms;        /* of these passes: sums of medians */
    double frame_ms, scratch_frame_ms; /* likewise, of whole frames */
} cache_row;

typedef struct cache_run {
    const char *name; /* of the mesh or scene */
    const char *device;
    int precision, issue; /* index into CLI_ISSUE_ORDERS */
    uint64_t repeats, n_passes;
    float factors[CACHE_MOST_PASSES];     /* of each pass, 0: chosen within a tolerance, or at random */
    const char *names[CACHE_MOST_PASSES]; /* of a scene's passes, or NULL */
    size_t n_rows;
    cache_row *rows;
} cache_run;

/* cache_out.c; of a cache_run */
void cache_write_table(const void *run, FILE *file);
void cache_write_json(const void *run, FILE *file);
void cache_write_csv(const void *run, FILE *file);

#endif
