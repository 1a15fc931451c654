/* What `bench error-time` found: fronts, and the table, JSON and CSV of it. */
#include "host/cli/error_time.h"

#include <stdlib.h>
#include <string.h>

static bool is_finite(const et_configuration *c) {
    return c->measured && c->nonfinite == 0;
}

/* Is a at least as fast and as near as b, and better in one of the two? */
static bool dominates(const et_configuration *a, const et_configuration *b) {
    return is_finite(a) && a->ns <= b->ns && a->position_max <= b->position_max &&
           (a->ns < b->ns || a->position_max < b->position_max);
}

void et_mark_fronts(et_run *run) {
    for (size_t i = 0; i < run->n_configurations; ++i) {
        et_configuration *c = &run->configurations[i];
        bool by_any = false, by_quadplan = false;
        double fastest = 0;
        for (size_t k = 0; k < run->n_configurations; ++k) {
            const et_configuration *other = &run->configurations[k];
            const bool better = dominates(other, c);
            by_any = by_any || better;
            if (other->series != NULL || !is_finite(other)) continue;
            by_quadplan = by_quadplan || better;
            if (other->position_max <= c->position_max && (fastest == 0 || other->ns < fastest))
                fastest = other->ns;
        }
        c->front = is_finite(c) && !by_any;
        c->beats = c->series != NULL && is_finite(c) && !by_quadplan;
        c->ratio = c->series != NULL && fastest > 0 ? c->ns / fastest : 0;
    }
}

static const char *precision_name(const et_configuration *c) {
    return c->precision == QP_DOUBLE ? "double" : "float";
}

static const char *library_name(const et_configuration *c) {
    return c->series == NULL ? "quadplan" : c->series->library;
}

static unsigned threads_of(const et_run *run, const et_configuration *c) {
    return c->series == NULL || c->series->parallel ? run->task.threads : 1;
}

static unsigned long long count_beating(const et_run *run) {
    unsigned long long n = 0;
    for (size_t i = 0; i < run->n_configurations; ++i) n += run->configurations[i].beats;
    return n;
}

static void print_variant(const et_configuration *c, char text[16]) {
    /* Capital letters for what was left out. */
    snprintf(text, 16, "%s%s%s", c->crease_nodes ? "" : "C", c->terminal_nodes ? "" : "T",
             c->exact_tail ? "" : "E");
    if (c->tolerance > 0) snprintf(text, 16, "t %.0e", c->tolerance);
    if (c->series != NULL) text[0] = '\0';
}

void et_print_table(const void *result, FILE *file) {
    const et_run *run = result;
    fprintf(file,
            "%s: %llu samples, %llu a patch; medians of %llu; %u threads, %s; quadplan on %s\n"
            "without: C crease nodes, T terminal nodes, E exact tail; t: tolerance. * on the front; ! a peer "
            "that no "
            "configuration of\n"
            "quadplan is as fast and as near as; ratio: a peer's time over that of the fastest quadplan as "
            "near as it\n\n",
            run->mesh_name, (unsigned long long)run->count, (unsigned long long)run->options->samples,
            (unsigned long long)run->options->repeats, run->task.threads,
            run->options->processor_time ? "processor time of all" : "wall clock",
            qp_device_name(run->device));
    fprintf(file, "%-20s %5s %7s  %9s %7s  %9s %9s  %9s %9s  %9s %9s %8s\n", "", "level", "without",
            "ns/sample", "ratio", "pos. max", "pos. rms", "n. max", "n. rms", "set-up ms", "locate ms", "MB");
    for (size_t i = 0; i < run->n_configurations; ++i) {
        const et_configuration *c = &run->configurations[i];
        char variant[16], ratio[16] = "", bytes[16] = "", level[16] = "";
        print_variant(c, variant);
        if (c->ratio > 0) snprintf(ratio, sizeof ratio, "%.2f", c->ratio);
        if (c->bytes > 0) snprintf(bytes, sizeof bytes, "%.2f", (double)c->bytes / 1048576);
        if (c->level > 0) snprintf(level, sizeof level, "%u", c->level);
        fprintf(file, "%-20s %5s %7s %c%9.2f %7s  %9.2e %9.2e  %9.2e %9.2e  %9.2f %9.2f %8s\n", c->name,
                level, variant,
                c->beats   ? '!'
                : c->front ? '*'
                           : ' ',
                c->ns, ratio, c->position_max, c->position_rms, c->normal_max, c->normal_rms, c->setup_ms,
                c->locate_ms, bytes);
    }
    for (size_t i = 0; i < run->n_skips; ++i) {
        const et_skip *skip = &run->skips[i];
        if (skip->level > 0)
            fprintf(file, "left out: %s from level %u: %s\n", skip->name, skip->level, skip->reason);
        else
            fprintf(file, "left out: %s: %s\n", skip->name, skip->reason);
    }
    for (size_t i = 0; i < run->n_configurations; ++i) {
        const et_configuration *c = &run->configurations[i];
        if (c->apart > 0)
            fprintf(file,
                    "%s: errors without %llu samples, near vertices where its rules make another surface\n",
                    c->name, (unsigned long long)c->apart);
    }
    fprintf(file, "peers below or left of quadplan's front: %llu\n", count_beating(run));
}

/* Six digits are more than measurements have. */
static void write_real(qp_json *json, const char *key, double value) {
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    qp_json_real(json, key, strtod(text, NULL));
}

static void write_configuration(const et_run *run, const et_configuration *c, qp_json *json) {
    qp_json_open_object(json, NULL);
    qp_json_text(json, "series", c->name);
    qp_json_text(json, "library", library_name(c));
    qp_json_text(json, "precision", precision_name(c));
    qp_json_integer(json, "level", c->level);
    if (c->series == NULL) {
        qp_json_bool(json, "crease_nodes", c->crease_nodes);
        qp_json_bool(json, "terminal_nodes", c->terminal_nodes);
        qp_json_bool(json, "exact_tail", c->exact_tail);
        if (c->tolerance > 0) {
            write_real(json, "tolerance", c->tolerance);
            write_real(json, "bound", c->bound);
        }
        write_real(json, "plans_ms",
                   c->surface_ms); /* of setup_ms; the rest is mostly the runtime's, for kernels */
    }
    qp_json_integer(json, "threads", threads_of(run, c));
    write_real(json, "ns_per_sample", c->ns);
    write_real(json, "setup_ms", c->setup_ms);
    write_real(json, "locate_ms", c->locate_ms);
    if (c->bytes > 0) qp_json_integer(json, "bytes", c->bytes);
    write_real(json, "position_max", c->position_max);
    write_real(json, "position_rms", c->position_rms);
    write_real(json, "normal_max_deg", c->normal_max);
    write_real(json, "normal_rms_deg", c->normal_rms);
    qp_json_integer(json, "nonfinite", c->nonfinite);
    if (c->series != NULL) qp_json_integer(json, "apart", c->apart);
    qp_json_bool(json, "front", c->front);
    if (c->series != NULL) {
        qp_json_bool(json, "beats_quadplan", c->beats);
        write_real(json, "ratio", c->ratio);
    }
    qp_json_close(json);
}

/* Without the folder: results are to be the same wherever the models lie. */
static const char *base_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

void et_write_json(const void *result, FILE *file) {
    const et_run *run = result;
    qp_json json;
    qp_json_begin(&json, file);
    qp_json_text(&json, "mesh", base_name(run->mesh_name));
    qp_json_integer(&json, "faces", run->mesh->n_faces);
    qp_json_integer(&json, "patches", run->mesh->n_patches);
    qp_json_integer(&json, "samples", run->count);
    qp_json_integer(&json, "samples_per_patch", run->options->samples);
    qp_json_integer(&json, "seed", run->options->seed);
    qp_json_integer(&json, "repeats", run->options->repeats);
    qp_json_integer(&json, "threads", run->task.threads);
    qp_json_text(&json, "clock", run->options->processor_time ? "processor" : "wall");
    qp_json_text(&json, "device", qp_device_name(run->device));
    qp_json_integer(&json, "normals_undefined", run->normals_undefined);
    qp_json_integer(&json, "normals_ill", run->normals_ill);
    qp_json_integer(&json, "peers_beyond_front", count_beating(run));
    qp_json_open_array(&json, "configurations");
    for (size_t i = 0; i < run->n_configurations; ++i) {
        fputs("\n ", file);
        write_configuration(run, &run->configurations[i], &json);
    }
    qp_json_close(&json);
    qp_json_open_array(&json, "left_out");
    for (size_t i = 0; i < run->n_skips; ++i) {
        qp_json_open_object(&json, NULL);
        qp_json_text(&json, "series", run->skips[i].name);
        qp_json_integer(&json, "from_level", run->skips[i].level);
        qp_json_text(&json, "reason", run->skips[i].reason);
        qp_json_close(&json);
    }
    qp_json_finish(&json);
}

void et_write_csv(const void *result, FILE *file) {
    const et_run *run = result;
    fputs("series,library,precision,level,crease_nodes,terminal_nodes,exact_tail,tolerance,threads,ns_per_"
          "sample,setup_"
          "ms,locate_ms,"
          "bytes,position_max,position_rms,normal_max_deg,normal_rms_deg,nonfinite,apart,front,ratio\n",
          file);
    for (size_t i = 0; i < run->n_configurations; ++i) {
        const et_configuration *c = &run->configurations[i];
        const bool ours = c->series == NULL;
        fprintf(file, "%s,%s,%s,%u,%s,%s,%s,%g,%u,%.6g,%.6g,%.6g,%llu,%.6g,%.6g,%.6g,%.6g,%llu,%llu,%d,",
                c->name, library_name(c), precision_name(c), c->level,
                ours ? (c->crease_nodes ? "1" : "0") : "", ours ? (c->terminal_nodes ? "1" : "0") : "",
                ours ? (c->exact_tail ? "1" : "0") : "", c->tolerance, threads_of(run, c), c->ns, c->setup_ms,
                c->locate_ms, (unsigned long long)c->bytes, c->position_max, c->position_rms, c->normal_max,
                c->normal_rms, (unsigned long long)c->nonfinite, (unsigned long long)c->apart, c->front);
        if (c->ratio > 0) fprintf(file, "%.6g", c->ratio);
        fputc('\n', file);
    }
}
