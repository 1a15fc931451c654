/* Where control points live, on the command line: --supports and its fellows, and what comes of it. */
#ifndef QP_CLI_SUPPORTS_H
#define QP_CLI_SUPPORTS_H

#include "host/cli/cli.h"

#define CLI_SUPPORTS "scratch|ring|cache"
#define CLI_SCHEDULES "fused|streamed"
#define CLI_RETIREMENTS "in-order|out-of-order"
#define CLI_ISSUE_ORDERS "plan|patch"
#define CLI_CACHE_POLICIES "all|direct|clock|shared"

typedef struct cli_supports_options {
    int kind, schedule, retirement, issue, policy; /* indices into the words above, which are the API's values */
    uint64_t ring_bytes, cache_bytes;
    bool canaries;
    bool ring_given, schedule_given, retirement_given, issue_given, cache_given, policy_given;
    const char *trace; /* file to write, or NULL; an option of `eval` only */
} cli_supports_options;

/* The paper's estimate for the one; as much for the other. */
#define CLI_SUPPORTS_DEFAULTS                                                                                \
    { .ring_bytes = 1 << 20, .cache_bytes = 1 << 20 }
/* clang-format off */
#define CLI_SUPPORTS_OPTIONS(o)                                                                              \
    {"--supports", CLI_SUPPORTS, "where control points are kept; all give the same bits (default scratch)",  \
     CLI_CHOICE, &(o).kind, 0, 0, NULL},                                                                     \
    {"--ring-bytes", "N", "size of the ring buffer (default 1M)",                                            \
     CLI_BYTES, &(o).ring_bytes, 0, 0x1p40, &(o).ring_given},                                                \
    {"--schedule", CLI_SCHEDULES, "of the ring: one launch for both stages, or two streams (default fused)", \
     CLI_CHOICE, &(o).schedule, 0, 0, &(o).schedule_given},                                                  \
    {"--retire", CLI_RETIREMENTS, "when a patch gives the ring its place back (default in-order)",           \
     CLI_CHOICE, &(o).retirement, 0, 0, &(o).retirement_given},                                              \
    {"--issue", CLI_ISSUE_ORDERS, "patches by their plans, or in the mesh's order (default plan)",           \
     CLI_CHOICE, &(o).issue, 0, 0, &(o).issue_given},                                                        \
    {"--canaries", NULL, "watch the ring for writes out of place; exit 1 when there are any",                \
     CLI_FLAG, &(o).canaries, 0, 0, NULL},                                                                   \
    {"--cache-bytes", "N", "size of a bounded cache, tags included (default 1M)",                            \
     CLI_BYTES, &(o).cache_bytes, 0, 0x1p40, &(o).cache_given},                                              \
    {"--cache-policy", CLI_CACHE_POLICIES, "a place for every point, or which one goes (default all)",       \
     CLI_CHOICE, &(o).policy, 0, 0, &(o).policy_given}
/* clang-format on */

/* The options of the API. Errors: QP_BAD_INPUT for one that the kind has no use for. */
qp_status cli_supports_get(const cli_supports_options *options, qp_supports_options *supports, qp_error *err);

/* An object "supports", and lines of text. */
void cli_supports_json(qp_json *json, const cli_supports_options *options, const qp_supports_report *report);
void cli_supports_text(const cli_supports_options *options, const qp_supports_report *report);

/* The stream's trace as a Chrome trace (trace.c), for chrome://tracing and Perfetto; the file is there as a whole or not at all.
 * Errors: QP_SYSTEM when it cannot be written, or when the stream has no trace. */
qp_status cli_trace_write(const cli_supports_options *options, const qp_stream *stream, const char *path,
                          qp_error *err);

#endif
