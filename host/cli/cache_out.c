/* What `quadplan cache` found: the table, JSON and CSV of it. */
#include "host/cli/cache.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char *const policies[] = {"all", "direct", "clock", "shared"};
static const char *const orders[] = {"plan", "patch"};

static double hit_rate(const cache_row *row) {
    return row->needed == 0 ? 0 : (double)row->hits / (double)row->needed;
}

static double relative(double ms, double scratch_ms) {
    return scratch_ms > 0 ? ms / scratch_ms : 1;
}

void cache_write_table(const void *result, FILE *file) {
    const cache_run *run = result;
    fprintf(file, "%s on %s, issued by %s; passes at", run->name, run->device, orders[run->issue]);
    for (uint64_t p = 0; p < run->n_passes; ++p) {
        const char *comma = p == 0 ? "" : ",";
        if (run->factors[p] != 0)
            fprintf(file, "%s factor %g", comma, (double)run->factors[p]);
        else
            fprintf(file, "%s various factors", comma);
        if (run->names[p] != NULL) fprintf(file, " (%s)", run->names[p]);
    }
    fprintf(file, "\n\n%-7s %10s %6s %10s %10s %8s %10s %10s %10s %10s %9s\n", "policy", "bytes", "passes",
            "needed", "computed", "hit rate", "cold", "capacity", "conflict", "hull ms", "relative");
    for (size_t i = 0; i < run->n_rows; ++i) {
        const cache_row *r = &run->rows[i];
        fprintf(file,
                "%-7s %10" PRIu64 " %6" PRIu64 " %10" PRIu64 " %10" PRIu64 " %8.4f %10" PRIu64 " %10" PRIu64
                " %10" PRIu64 " %10.3f %9.3f\n",
                policies[r->policy], r->cache_bytes, r->passes, r->needed, r->computed, hit_rate(r), r->cold,
                r->capacity, r->conflict, r->hull_ms, relative(r->hull_ms, r->scratch_ms));
    }
}

/* Six digits are more than measurements have. */
static void write_real(qp_json *json, const char *key, double value) {
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    qp_json_real(json, key, strtod(text, NULL));
}

static void write_row(const cache_row *r, qp_json *json) {
    qp_json_open_object(json, NULL);
    qp_json_integer(json, "cache_bytes", r->cache_bytes);
    qp_json_integer(json, "passes", r->passes);
    qp_json_text(json, "policy", policies[r->policy]);
    write_real(json, "hit_rate", hit_rate(r));
    qp_json_integer(json, "points_computed", r->computed);
    qp_json_integer(json, "points_needed", r->needed);
    write_real(json, "relative_hull_time", relative(r->hull_ms, r->scratch_ms));
    qp_json_integer(json, "capacity_bytes", r->capacity_bytes);
    qp_json_integer(json, "held_bytes", r->held_bytes);
    qp_json_integer(json, "index_bytes", r->index_bytes);
    qp_json_integer(json, "hits", r->hits);
    qp_json_integer(json, "misses_cold", r->cold);
    qp_json_integer(json, "misses_capacity", r->capacity);
    qp_json_integer(json, "misses_conflict", r->conflict);
    qp_json_integer(json, "duplicates", r->duplicates);
    write_real(json, "hull_ms", r->hull_ms);
    write_real(json, "scratch_hull_ms", r->scratch_ms);
    write_real(json, "frame_ms", r->frame_ms);
    write_real(json, "scratch_frame_ms", r->scratch_frame_ms);
    qp_json_close(json);
}

/* Without the folder: results are to be the same wherever the models lie. */
static const char *base_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

void cache_write_json(const void *result, FILE *file) {
    const cache_run *run = result;
    qp_json json;
    qp_json_begin(&json, file);
    qp_json_text(&json, "mesh", base_name(run->name));
    qp_json_text(&json, "device", run->device);
    qp_json_text(&json, "precision", run->precision == QP_DOUBLE ? "double" : "float");
    qp_json_text(&json, "issue", orders[run->issue]);
    qp_json_integer(&json, "repeat", run->repeats);
    qp_json_open_array(&json, "passes");
    for (uint64_t p = 0; p < run->n_passes; ++p) {
        qp_json_open_object(&json, NULL);
        qp_json_text(&json, "name", run->names[p]);
        if (run->factors[p] != 0)
            qp_json_real(&json, "tess", (double)run->factors[p]);
        else
            qp_json_text(&json, "tess", NULL);
        qp_json_close(&json);
    }
    qp_json_close(&json);
    qp_json_open_array(&json, "rows");
    for (size_t i = 0; i < run->n_rows; ++i) {
        fputs("\n ", file);
        write_row(&run->rows[i], &json);
    }
    qp_json_finish(&json);
}

void cache_write_csv(const void *result, FILE *file) {
    const cache_run *run = result;
    fputs("cache_bytes,passes,policy,hit_rate,points_computed,points_needed,relative_hull_time,capacity_"
          "bytes,held_bytes,"
          "index_bytes,hits,misses_cold,misses_capacity,misses_conflict,duplicates,hull_ms,scratch_hull_ms\n",
          file);
    for (size_t i = 0; i < run->n_rows; ++i) {
        const cache_row *r = &run->rows[i];
        fprintf(file, "%" PRIu64 ",%" PRIu64 ",%s,%.6g,%" PRIu64 ",%" PRIu64 ",%.6g,", r->cache_bytes,
                r->passes, policies[r->policy], hit_rate(r), r->computed, r->needed,
                relative(r->hull_ms, r->scratch_ms));
        fprintf(file,
                "%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64
                ",%" PRIu64,
                r->capacity_bytes, r->held_bytes, r->index_bytes, r->hits, r->cold, r->capacity, r->conflict,
                r->duplicates);
        fprintf(file, ",%.6g,%.6g\n", r->hull_ms, r->scratch_ms);
    }
}
