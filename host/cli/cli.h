/* What the subcommands share: options, the mesh argument, messages. */
#ifndef QP_CLI_CLI_H
#define QP_CLI_CLI_H

#include "host/base/json.h"
#include "host/mesh/mesh.h"

typedef struct cli_command {
    const char *name, *arguments, *summary;                 /* "eval", "MESH", one sentence */
    const char *details;                                    /* more lines for --help, or NULL */
    qp_status (*run)(int argc, char **argv, qp_error *err); /* argv[0] is the subcommand's name */
} cli_command;

extern const cli_command cli_watertight, cli_info, cli_gen, cli_eval, cli_error, cli_sample, cli_stress,
    cli_render, cli_devices, cli_bench, cli_ring, cli_cache;
/* Of `bench`; its name is "bench NAME". */
extern const cli_command cli_error_time;

/* ---- Options (options.c) ---- */
typedef enum cli_kind {
    CLI_FLAG,   /* bool */
    CLI_TEXT,   /* const char *, not copied */
    CLI_COUNT,  /* uint64_t in [low, high] */
    CLI_REAL,   /* double in [low, high] */
    CLI_CHOICE, /* int: index into the words of `argument`, separated by | */
    CLI_SIZES,  /* cli_sizes: AxBxC */
    CLI_BYTES,  /* uint64_t in [low, high]: 64K, 1M, 2G are 2^10, 2^20, 2^30 */
    CLI_BYTE_RANGE /* cli_byte_range in [low, high]: 64K..32M, or one number */
} cli_kind;

typedef struct cli_byte_range {
    uint64_t first, last; /* first <= last */
} cli_byte_range;

typedef struct cli_sizes {
    unsigned count;
    uint32_t n[3];
} cli_sizes;

typedef struct cli_option {
    const char *name;     /* "--tess"; or "-o" */
    const char *argument; /* name of the value in help; NULL for a flag */
    const char *help;
    cli_kind kind;
    void *value;      /* default on entry */
    double low, high; /* for numbers */
    bool *given;      /* set when the option was there; may be NULL */
} cli_option;

typedef struct cli_arguments {
    int count; /* positional ones, order kept */
    const char *values[4];
    bool help; /* --help was there and is answered: return QP_OK at once */
} cli_arguments;

/* Parses argv[1 ..]; options (ended by a NULL name) and arguments may mix; "--" ends the options.
 * QP_BAD_INPUT unless exactly `expected` positional arguments were given. */
qp_status cli_parse(const cli_command *command, const cli_option *options, int argc, char **argv,
                    int expected, cli_arguments *arguments, qp_error *err);

/* Index of word in "a|b|c", or -1. */
int cli_choice(const char *choices, const char *word);
/* "12", "12x12x10": 1 to 3 numbers, each from 0 to 2^31. */
bool cli_sizes_read(const char *text, cli_sizes *sizes);
/* The whole of text as a number; false on anything else, NaN and infinity included. */
bool cli_real_read(const char *text, double *value);
bool cli_count_read(const char *text, uint64_t *value);
/* "65536", "64K", "1M", "2G", "1T". */
bool cli_bytes_read(const char *text, uint64_t *value);
/* "64K..32M", or "1M" for a range of one. */
bool cli_byte_range_read(const char *text, cli_byte_range *range);

/* ---- The mesh argument (mesh_argument.c) ---- */
typedef struct cli_mesh_options {
    bool boundary_given, creases_given, triangles_given;
    int boundary, creases, triangles; /* indices into the words of CLI_MESH_OPTIONS */
} cli_mesh_options;

/* clang-format off */
#define CLI_MESH_OPTIONS(o)                                                                                  \
    {"--boundary", "none|edge-and-corner|edge", "boundary rule, whatever the file says",                     \
     CLI_CHOICE, &(o).boundary, 0, 0, &(o).boundary_given},                                                  \
    {"--creases", "uniform|chaikin", "crease rule, whatever the file says",                                  \
     CLI_CHOICE, &(o).creases, 0, 0, &(o).creases_given},                                                    \
    {"--triangles", "catmark|smooth", "triangle rule, whatever the file says",                               \
     CLI_CHOICE, &(o).triangles, 0, 0, &(o).triangles_given}
/* clang-format on */

/* An OBJ file, or "gen:KIND[,n=AxBxC][,sharpness=S][,seed=N][,faces=N]". Warnings go to stderr. */
qp_status cli_mesh_open(const char *argument, const cli_mesh_options *options, qp_mesh **mesh, qp_error *err);
#define CLI_MESH_HELP                                                                                        \
    "MESH is an OBJ file with OpenSubdiv's tags, or gen:KIND[,n=AxBxC][,sharpness=S][,seed=N][,faces=N]\n"   \
    "(the meshes of `quadplan gen`)."

/* A mesh's warning: one line on stderr. */
void cli_print_warning(void *context, const char *line);

/* ---- Vertex streams to files (write_stream.c) ---- */
/* By extension: .obj (positions, normals, triangles), .ply (binary), .npy (n x 6). QP_BAD_INPUT for others.
 */
qp_status cli_stream_check_name(const char *path, qp_error *err);
qp_status cli_stream_write(const qp_stream *stream, const char *path, qp_error *err);

/* ---- What a tolerance came to (tolerance.c) ---- nothing where `tolerance` is 0 */
void cli_tolerance_json(qp_json *json, double tolerance, const qp_stream *stream);
void cli_tolerance_text(double tolerance, const qp_stream *stream);
/* A line on stderr where the largest factors are not enough. */
void cli_tolerance_warn(double tolerance, const qp_stream *stream);

#define CLI_PRECISIONS "float|double"
#define CLI_SPACINGS "equal|fractional_even|fractional_odd"

#endif
