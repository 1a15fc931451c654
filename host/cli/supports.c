/* The options of scratch, ring and cache, and their counters. */
#include "host/cli/supports.h"

#include <inttypes.h>

static const char *const kinds[] = {"scratch", "ring", "cache"};
static const char *const schedules[] = {"fused", "streamed"};
static const char *const retirements[] = {"in-order", "out-of-order"};
static const char *const orders[] = {"plan", "patch"};
static const char *const policies[] = {"all", "direct", "clock", "shared"};

static qp_status only_with(const char *option, const char *with, qp_error *err) {
    return qp_fail(err, QP_BAD_INPUT, "%s goes with %s only", option, with);
}

qp_status cli_supports_get(const cli_supports_options *o, qp_supports_options *supports, qp_error *err) {
    const struct {
        const char *name;
        bool given;
        qp_supports_kind kind;
    } uses[] = {{"--ring-bytes", o->ring_given, QP_SUPPORTS_RING},
                {"--schedule", o->schedule_given, QP_SUPPORTS_RING},
                {"--retire", o->retirement_given, QP_SUPPORTS_RING},
                {"--canaries", o->canaries, QP_SUPPORTS_RING},
                {"--trace", o->trace != NULL, QP_SUPPORTS_RING},
                {"--cache-bytes", o->cache_given, QP_SUPPORTS_CACHE},
                {"--cache-policy", o->policy_given, QP_SUPPORTS_CACHE}};
    for (size_t i = 0; i < sizeof uses / sizeof uses[0]; ++i) {
        if (!uses[i].given || (qp_supports_kind)o->kind == uses[i].kind) continue;
        return only_with(uses[i].name,
                         uses[i].kind == QP_SUPPORTS_RING ? "--supports ring" : "--supports cache", err);
    }
    if (o->issue_given && o->kind == QP_SUPPORTS_SCRATCH)
        return only_with("--issue", "--supports ring or cache", err);
    if (o->cache_given && o->policy == QP_CACHE_ALL)
        return only_with("--cache-bytes", "--cache-policy direct, clock or shared", err);
    *supports = (qp_supports_options){
        .kind = (qp_supports_kind)o->kind,
        .ring_bytes = o->ring_bytes,
        .schedule = (qp_schedule)o->schedule,
        .retirement = (qp_retirement)o->retirement,
        .issue_order = (qp_issue_order)o->issue,
        .cache_bytes = o->cache_bytes,
        .cache_policy = (qp_cache_policy)o->policy,
        .canaries = o->canaries,
        .trace = o->trace != NULL,
    };
    return QP_OK;
}

static uint64_t misses(const qp_supports_report *r) {
    return r->misses_cold + r->misses_capacity + r->misses_conflict;
}

void cli_supports_json(qp_json *json, const cli_supports_options *o, const qp_supports_report *r) {
    qp_json_open_object(json, "supports");
    qp_json_text(json, "kind", kinds[r->kind]);
    if (r->kind == QP_SUPPORTS_RING) {
        qp_json_text(json, "schedule", schedules[o->schedule]);
        qp_json_text(json, "retirement", retirements[o->retirement]);
        qp_json_text(json, "issue", orders[o->issue]);
    }
    if (r->kind == QP_SUPPORTS_CACHE) qp_json_text(json, "policy", policies[o->policy]);
    qp_json_integer(json, "capacity_bytes", r->capacity_bytes);
    qp_json_integer(json, "worst_case_bytes", r->worst_case_bytes);
    qp_json_integer(json, "largest_bytes", r->largest_bytes);
    qp_json_integer(json, "peak_bytes", r->peak_bytes);
    qp_json_integer(json, "allocations", r->allocations);
    qp_json_integer(json, "allocated_bytes", r->allocated_bytes);
    qp_json_integer(json, "stalls", r->stalls);
    qp_json_real(json, "stall_ms", r->stall_ms);
    qp_json_integer(json, "wraps", r->wraps);
    qp_json_integer(json, "wasted_bytes", r->wasted_bytes);
    qp_json_integer(json, "in_flight", r->in_flight);
    qp_json_integer(json, "points_needed", r->points_needed);
    qp_json_integer(json, "points_computed", r->points_computed);
    qp_json_integer(json, "hits", r->hits);
    qp_json_integer(json, "misses", misses(r));
    qp_json_integer(json, "misses_cold", r->misses_cold);
    qp_json_integer(json, "misses_capacity", r->misses_capacity);
    qp_json_integer(json, "misses_conflict", r->misses_conflict);
    qp_json_integer(json, "duplicates", r->duplicates);
    qp_json_integer(json, "invalidated", r->invalidated);
    qp_json_integer(json, "index_bytes", r->index_bytes);
    qp_json_close(json);
}

void cli_supports_text(const cli_supports_options *o, const qp_supports_report *r) {
    printf("  %s", kinds[r->kind]);
    if (r->kind == QP_SUPPORTS_RING)
        printf(" (%s, retired %s, issued by %s)", schedules[o->schedule], retirements[o->retirement],
               orders[o->issue]);
    if (r->kind == QP_SUPPORTS_CACHE) printf(" (policy %s)", policies[o->policy]);
    printf(" of %" PRIu64 " bytes, at most %" PRIu64 " in use; the worst case is %" PRIu64
           ", one patch takes up to %" PRIu64 "\n",
           r->capacity_bytes, r->peak_bytes, r->worst_case_bytes, r->largest_bytes);
    if (r->kind != QP_SUPPORTS_CACHE)
        printf("  %" PRIu64 " patches allocated %" PRIu64 " bytes, at most %" PRIu64 " at one time\n",
               r->allocations, r->allocated_bytes, r->in_flight);
    if (r->kind == QP_SUPPORTS_RING)
        printf("  %" PRIu64 " waited for room, %.3f ms together; %" PRIu64 " times around, %" PRIu64
               " bytes left unused at the end\n",
               r->stalls, r->stall_ms, r->wraps, r->wasted_bytes);
    if (r->kind != QP_SUPPORTS_CACHE) return;
    printf("  %" PRIu64 " points asked for, %" PRIu64 " computed, %" PRIu64 " of them twice at one time\n",
           r->points_needed, r->points_computed, r->duplicates);
    printf("  %" PRIu64 " hits, %" PRIu64 " misses (%" PRIu64 " cold, %" PRIu64 " capacity, %" PRIu64
           " conflict), %" PRIu64 " made invalid; tables of %" PRIu64 " bytes\n",
           r->hits, misses(r), r->misses_cold, r->misses_capacity, r->misses_conflict, r->invalidated,
           r->index_bytes);
}
