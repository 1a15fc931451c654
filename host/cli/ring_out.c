/* What `quadplan ring` found: the table, JSON and CSV of it. */
#include "host/cli/ring.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const char *const retirements[] = {"in-order", "out-of-order"};
static const char *const orders[] = {"plan", "patch"};

static double stall_fraction(const ring_row *row) {
    if (!row->fits) return 1;
    return row->pipeline.cycles > 0 ? row->pipeline.stall_cycles / row->pipeline.cycles : 0;
}

static double percent_of(uint64_t part, uint64_t whole) {
    return whole == 0 ? 0 : 100.0 * (double)part / (double)whole;
}

/* "1.5 MB" and the like, of 2^20 bytes. */
static const char *size_text(uint64_t bytes, char text[24]) {
    if (bytes >= 10 << 20)
        snprintf(text, 24, "%.1f MB", (double)bytes / 1048576);
    else if (bytes >= 1 << 20)
        snprintf(text, 24, "%.2f MB", (double)bytes / 1048576);
    else
        snprintf(text, 24, "%.1f KB", (double)bytes / 1024);
    return text;
}

static void print_validation(const ring_run *run, FILE *file) {
    fprintf(file,
            "\nthe fused kernel on the host, %u slots, and the model of it (%.3g ns a weight, %.3g a vertex, "
            "%.3g a "
            "patch):\n",
            run->validation_slots, run->validation_hull_ns, run->validation_domain_ns,
            run->validation_patch_ns);
    fprintf(file, "%10s  %21s  %19s  %19s  %23s  %15s\n", "", "throughput", "stalls", "stalled, ms",
            "peak bytes", "in flight");
    fprintf(file, "%10s  %10s %10s  %9s %9s  %9s %9s  %11s %11s  %7s %7s\n", "ring", "model", "measured",
            "model", "measured", "model", "measured", "model", "measured", "model", "meas.");
    for (size_t i = 0; i < run->n_validation; ++i) {
        const ring_validation *v = &run->validation[i];
        fprintf(file,
                "%10" PRIu64 "  %10.4f %10.4f  %9" PRIu64 " %9" PRIu64 "  %9.3f %9.3f  %11" PRIu64
                " %11" PRIu64 "  %7" PRIu32 " %7" PRIu32 "\n",
                v->ring_bytes, v->model_relative, v->measured_relative, v->model_stalls, v->measured_stalls,
                v->model_stall_ms, v->measured_stall_ms, v->model_peak_bytes, v->measured_peak_bytes,
                v->model_in_flight, v->measured_in_flight);
    }
}

void ring_write_table(const void *result, FILE *file) {
    const ring_run *run = result;
    const qp_machine *m = &run->machine;
    char a[24], b[24];
    fprintf(file,
            "%s: %zu patches, %" PRIu64 " with %" PRIu64 " control points (%.1f each, at most %" PRIu64
            " bytes), %" PRIu64 " vertices\n",
            run->name, run->n_work, run->with_points, run->points,
            run->with_points == 0 ? 0 : (double)run->points / (double)run->with_points, run->largest_bytes,
            run->samples);
    fprintf(file,
            "machine %s: %" PRIu32 " SMs x %" PRIu32
            " warps, %g weights and %g vertices a cycle and SM, retirement %s\n",
            run->machine_name, m->sms, m->warps, m->hull_rate, m->domain_rate, retirements[m->out_of_order]);
    fprintf(file, "unlimited scratch: %.0f cycles, occupancy %.4f, at most %" PRIu64 " bytes live\n\n",
            run->scratch.cycles, run->scratch.occupancy, run->scratch.peak_bytes);
    fprintf(file, "%12s %10s %8s %9s %10s %12s %9s %8s\n", "ring bytes", "throughput", "stalled", "occupancy",
            "peak bytes", "skipped bytes", "in flight", "stalls");
    for (size_t i = 0; i < run->n_rows; ++i) {
        const ring_row *row = &run->rows[i];
        if (!row->fits) {
            fprintf(file, "%12" PRIu64 " too small for the largest patch\n", row->ring_bytes);
            continue;
        }
        fprintf(file,
                "%12" PRIu64 " %10.4f %8.4f %9.4f %10" PRIu64 " %13" PRIu64 " %9" PRIu32 " %8" PRIu64 "\n",
                row->ring_bytes, row->relative_throughput, stall_fraction(row), row->pipeline.occupancy,
                row->pipeline.peak_bytes, row->pipeline.wasted_bytes, row->pipeline.in_flight,
                row->pipeline.stalls);
    }
    fprintf(file, "\nworst-case scratch: %" PRIu64 " bytes (%s)\n", run->worst_case_bytes,
            size_text(run->worst_case_bytes, a));
    fprintf(file,
            "the paper's estimate (section 8.1; there 1 MB against 22 MB for Armor Guy): %" PRIu64
            " in flight x %.1f points x %" PRIu32 " bytes = %" PRIu64 " (%s)\n",
            run->at_once, run->with_points == 0 ? 0 : (double)run->points / (double)run->with_points,
            m->point_bytes, run->estimate_bytes, size_text(run->estimate_bytes, b));
    fprintf(file,
            "smallest ring with 99 percent of scratch's throughput: %" PRIu64
            " bytes (%s), %.1f percent of the worst case\n",
            run->smallest_bytes, size_text(run->smallest_bytes, a),
            percent_of(run->smallest_bytes, run->worst_case_bytes));
    if (run->n_validation != 0) print_validation(run, file);
}

/* Six digits are more than a model has. */
static void write_real(qp_json *json, const char *key, double value) {
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    qp_json_real(json, key, strtod(text, NULL));
}

static void write_machine(const ring_run *run, qp_json *json) {
    const qp_machine *m = &run->machine;
    qp_json_open_object(json, "machine");
    qp_json_text(json, "name", run->machine_name);
    qp_json_integer(json, "sm", m->sms);
    qp_json_integer(json, "warps_per_sm", m->warps);
    qp_json_integer(json, "fill", m->fill == 0 ? m->warps : m->fill);
    qp_json_integer(json, "point_bytes", m->point_bytes);
    write_real(json, "hull_rate", m->hull_rate);
    write_real(json, "tessellator_rate", m->tessellator_rate);
    qp_json_bool(json, "tessellator_shared", m->tessellator_shared);
    write_real(json, "domain_rate", m->domain_rate);
    write_real(json, "latency", m->latency);
    qp_json_text(json, "retirement", retirements[m->out_of_order]);
    qp_json_text(json, "issue", orders[run->issue]);
    qp_json_integer(json, "regular_points", run->regular_points);
    qp_json_close(json);
}

static void write_row(const ring_row *row, qp_json *json) {
    qp_json_open_object(json, NULL);
    qp_json_integer(json, "ring_bytes", row->ring_bytes);
    write_real(json, "relative_throughput", row->relative_throughput);
    write_real(json, "stall_fraction", stall_fraction(row));
    write_real(json, "occupancy", row->pipeline.occupancy);
    qp_json_integer(json, "peak_bytes", row->pipeline.peak_bytes);
    qp_json_integer(json, "in_flight", row->pipeline.in_flight);
    qp_json_bool(json, "fits", row->fits);
    qp_json_integer(json, "stalls", row->pipeline.stalls);
    qp_json_integer(json, "wraps", row->pipeline.wraps);
    qp_json_integer(json, "wasted_bytes", row->pipeline.wasted_bytes);
    qp_json_close(json);
}

/* ring_bytes 0: scratch */
static void write_live(qp_json *json, uint64_t ring_bytes, const qp_pipeline_result *r) {
    qp_json_open_object(json, NULL);
    qp_json_integer(json, "ring_bytes", ring_bytes);
    write_real(json, "cycles", r->cycles);
    write_real(json, "interval_cycles", r->live_cycles);
    qp_json_open_array(json, "bytes");
    for (uint32_t i = 0; i < r->live_bins; ++i) qp_json_integer(json, NULL, r->live_bytes[i]);
    qp_json_close(json);
    qp_json_close(json);
}

static void write_validation(const ring_run *run, qp_json *json) {
    qp_json_open_object(json, "validation");
    qp_json_integer(json, "slots", run->validation_slots);
    write_real(json, "hull_ns_per_weight", run->validation_hull_ns);
    write_real(json, "domain_ns_per_vertex", run->validation_domain_ns);
    write_real(json, "ns_per_patch", run->validation_patch_ns);
    qp_json_open_array(json, "rows");
    for (size_t i = 0; i < run->n_validation; ++i) {
        const ring_validation *v = &run->validation[i];
        qp_json_open_object(json, NULL);
        qp_json_integer(json, "ring_bytes", v->ring_bytes);
        write_real(json, "model_ms", v->model_ms);
        write_real(json, "measured_ms", v->measured_ms);
        write_real(json, "model_relative_throughput", v->model_relative);
        write_real(json, "measured_relative_throughput", v->measured_relative);
        qp_json_integer(json, "model_stalls", v->model_stalls);
        qp_json_integer(json, "measured_stalls", v->measured_stalls);
        write_real(json, "model_stall_ms", v->model_stall_ms);
        write_real(json, "measured_stall_ms", v->measured_stall_ms);
        qp_json_integer(json, "model_peak_bytes", v->model_peak_bytes);
        qp_json_integer(json, "measured_peak_bytes", v->measured_peak_bytes);
        qp_json_integer(json, "model_wraps", v->model_wraps);
        qp_json_integer(json, "measured_wraps", v->measured_wraps);
        qp_json_integer(json, "model_in_flight", v->model_in_flight);
        qp_json_integer(json, "measured_in_flight", v->measured_in_flight);
        qp_json_close(json);
    }
    qp_json_close(json);
    qp_json_close(json);
}

/* Without the folder: results are to be the same wherever the models lie. */
static const char *base_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

void ring_write_json(const void *result, FILE *file) {
    const ring_run *run = result;
    qp_json json;
    qp_json_begin(&json, file);
    qp_json_text(&json, "mesh", base_name(run->name));
    if (run->factor != 0)
        qp_json_real(&json, "tess", run->factor);
    else if (run->tessellation->tolerance != 0)
        qp_json_real(&json, "tolerance", run->tessellation->tolerance);
    else
        qp_json_text(&json, "tess", NULL);
    write_machine(run, &json);
    qp_json_integer(&json, "patches", run->n_work);
    qp_json_integer(&json, "patches_with_points", run->with_points);
    qp_json_integer(&json, "points", run->points);
    qp_json_integer(&json, "samples", run->samples);
    write_real(&json, "weights", run->weights);
    qp_json_integer(&json, "largest_bytes", run->largest_bytes);
    qp_json_integer(&json, "worst_case_bytes", run->worst_case_bytes);
    qp_json_integer(&json, "estimate_bytes", run->estimate_bytes);
    qp_json_integer(&json, "smallest_ring_bytes_at_99_percent", run->smallest_bytes);
    qp_json_open_object(&json, "scratch");
    write_real(&json, "cycles", run->scratch.cycles);
    write_real(&json, "occupancy", run->scratch.occupancy);
    qp_json_integer(&json, "peak_bytes", run->scratch.peak_bytes);
    qp_json_integer(&json, "in_flight", run->scratch.in_flight);
    qp_json_close(&json);
    qp_json_open_array(&json, "rows");
    for (size_t i = 0; i < run->n_rows; ++i) {
        fputs("\n ", file);
        write_row(&run->rows[i], &json);
    }
    qp_json_close(&json);
    qp_json_open_object(&json, "histogram");
    qp_json_integer(&json, "points_per_bin", run->histogram_width);
    qp_json_open_array(&json, "patches");
    for (uint32_t i = 0; i < run->histogram_bins; ++i) qp_json_integer(&json, NULL, run->histogram[i]);
    qp_json_close(&json);
    qp_json_close(&json);
    qp_json_open_array(&json, "live");
    write_live(&json, 0, &run->scratch);
    if (run->smallest_bytes != 0) write_live(&json, run->smallest_bytes, &run->at_smallest);
    qp_json_close(&json);
    if (run->n_validation != 0) write_validation(run, &json);
    qp_json_finish(&json);
}

void ring_write_csv(const void *result, FILE *file) {
    const ring_run *run = result;
    fputs("ring_bytes,relative_throughput,stall_fraction,occupancy,peak_bytes,in_flight,fits,stalls,wraps,"
          "wasted_bytes\n",
          file);
    for (size_t i = 0; i < run->n_rows; ++i) {
        const ring_row *row = &run->rows[i];
        fprintf(file,
                "%" PRIu64 ",%.6g,%.6g,%.6g,%" PRIu64 ",%" PRIu32 ",%d,%" PRIu64 ",%" PRIu64 ",%" PRIu64 "\n",
                row->ring_bytes, row->relative_throughput, stall_fraction(row), row->pipeline.occupancy,
                row->pipeline.peak_bytes, row->pipeline.in_flight, row->fits, row->pipeline.stalls,
                row->pipeline.wraps, row->pipeline.wasted_bytes);
    }
}
