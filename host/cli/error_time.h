/* quadplan bench error-time, inside: configurations of quadplan and of its peers, measured on the same samples. */
#ifndef QP_CLI_ERROR_TIME_H
#define QP_CLI_ERROR_TIME_H

#include "host/cli/cli.h"
#include "host/peer/peer.h"
#include "host/reference/reference.h"

enum { ET_MOST_REPEATS = 99, ET_MOST_SERIES = 64, ET_MOST_LEVEL = 10 };

typedef struct et_options {
    cli_mesh_options mesh;
    uint64_t samples; /* a patch */
    uint64_t repeats, max_level, threads, seed;
    uint64_t memory_mb;    /* of configurations that are kept set up from round to round */
    bool processor_time;   /* time frames by that of all threads, rather than by the wall clock */
    double setup_limit_ms; /* a peer's series ends with the level whose set-up exceeds it */
    const char *peers, *device, *json, *csv, *chart;
} et_options;

/* One configuration of quadplan, or one level of a series of a peer. */
typedef struct et_configuration {
    const char *name;             /* series: "quadplan-float", "osd-omp/gregory" ... */
    const qp_peer_series *series; /* NULL: quadplan */
    unsigned level;               /* depth of plans; 0 where a peer's series has no levels */
    qp_precision precision;
    bool crease_nodes, terminal_nodes, exact_tail; /* quadplan's */
    double tolerance, bound; /* quadplan's; 0: none. Bound of the error that it promises */

    /* While it is set up. */
    qp_peer *peer;
    const qp_surface *surface; /* shared by the configurations of the same plans */
    double surface_ms;
    uint64_t plan_bytes;
    qp_frame *frame;
    uint64_t held_bytes; /* counted against the memory limit while it is kept */

    /* Milliseconds of each repeat; their medians in the end. */
    uint64_t n_frames, n_setups;
    double frames[ET_MOST_REPEATS], setups[ET_MOST_REPEATS], locates[ET_MOST_REPEATS];
    double frame_ms, setup_ms, locate_ms, ns; /* ns a sample */
    uint64_t bytes;                           /* of tables and points; 0 where a peer does not tell */
    double position_max, position_rms, normal_max, normal_rms;
    uint64_t nonfinite;
    uint64_t apart; /* samples where a peer means another surface, left out of its errors */
    bool measured;  /* errors are there */
    bool dropped;   /* was left out after all: see skips */
    bool front;     /* no configuration of anyone is as fast and as near */
    bool beats;     /* a peer's: no configuration of quadplan is as fast and as near */
    double ratio; /* a peer's: its time over that of the fastest quadplan that is as near; 0: there is none */
} et_configuration;

/* What was left out, and why. */
typedef struct et_skip {
    char name[48], reason[480];
    unsigned level; /* first one that is left out; 0: all of it */
} et_skip;

typedef struct et_run {
    const et_options *options;
    const char *mesh_name;
    qp_mesh *mesh;
    qp_device *device;
    uint64_t count; /* samples */
    uint32_t *patch;
    double *uv;
    float *peer_uv;
    qp_peer_task task;
    uint64_t normals_undefined, normals_ill; /* samples that normal errors leave out */
    struct et_known *known;                       /* the reference's samples, by the positions it was given */
    struct et_surface *surfaces;
    size_t n_configurations, capacity;
    et_configuration *configurations;
    size_t n_skips, skip_capacity;
    et_skip *skips;
    uint64_t held_bytes;
} et_run;

/* ---- error_time_run.c ---- */
/* Samples, peers, configurations; R rounds over all of them; medians. *run is zeroed first; free it in any case. */
qp_status et_measure(et_run *run, const char *mesh_name, const et_options *options, qp_error *err);
void et_free(et_run *run);
/* Adds a line to what was left out. */
qp_status et_skip_add(et_run *run, const char *name, unsigned level, const char *reason, qp_error *err);

/* ---- error_time_sets.c: what is measured ---- */
/* count samples a patch, off every grid, the same for a seed. */
qp_status et_make_samples(et_run *run, qp_error *err);
/* Every configuration of quadplan that differs from the others on this mesh, and the levels of the chosen peers. */
qp_status et_list_quadplan(et_run *run, qp_error *err);
qp_status et_list_peers(et_run *run, qp_error *err);
void et_free_surfaces(et_run *run);
/* Is name, or what it begins with up to - or /, in the list a,b,c? "all" and NULL choose everything, "none" nothing. */
bool et_peer_chosen(const char *list, const char *name);

/* ---- error_time_errors.c ---- */
/* Evaluates the reference at all samples. */
qp_status et_know(et_run *run, qp_error *err);
/* Errors of what a configuration has just evaluated. */
qp_status et_quadplan_errors(et_run *run, et_configuration *c, const qp_stream *stream, qp_error *err);
qp_status et_peer_errors(et_run *run, et_configuration *c, qp_error *err);
void et_free_known(et_run *run);

/* ---- error_time_out.c ---- */
/* Marks the fronts and the ratios, once all is measured. */
void et_mark_fronts(et_run *run);
/* Of an et_run. */
void et_print_table(const void *run, FILE *file);
void et_write_json(const void *run, FILE *file);
void et_write_csv(const void *run, FILE *file);

#endif
