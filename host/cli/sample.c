/* quadplan sample: position, derivatives and normal at any points. */
#include "host/cli/evaluation.h"
#include "host/cli/points_file.h"
#include "host/reference/reference.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static double element(const qp_stream *s, const void *reals, size_t i) {
    return s->precision == QP_DOUBLE ? ((const double *)reals)[i] : (double)((const float *)reals)[i];
}

static void put_vector(qp_json *json, const char *key, const double v[3]) {
    qp_json_open_array(json, key);
    for (int c = 0; c < 3; ++c) qp_json_real(json, NULL, v[c]);
    qp_json_close(json);
}

/* p, n, du, dv of sample i. */
static void read_sample(const qp_stream *s, size_t i, double out[4][3]) {
    for (size_t c = 0; c < 3; ++c) {
        out[0][c] = element(s, s->vertices, 6 * i + c);
        out[1][c] = element(s, s->vertices, 6 * i + 3 + c);
        out[2][c] = element(s, s->derivatives, 6 * i + c);
        out[3][c] = element(s, s->derivatives, 6 * i + 3 + c);
    }
}

static void print_json(const char *name, const cli_evaluation *e, const cli_points *points,
                       const qp_stream *s, const qp_reference_sample *exact) {
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_text(&json, "mesh", name);
    qp_json_text(&json, "precision", s->precision == QP_DOUBLE ? "double" : "float");
    qp_json_text(&json, "device", qp_device_name(e->device));
    if (s->bound > 0) qp_json_real(&json, "bound", s->bound);
    qp_json_open_array(&json, "samples");
    for (size_t i = 0; i < points->count; ++i) {
        double v[4][3];
        read_sample(s, i, v);
        qp_json_open_object(&json, NULL);
        qp_json_integer(&json, "patch", points->patch[i]);
        qp_json_real(&json, "u", points->uv[2 * i]);
        qp_json_real(&json, "v", points->uv[2 * i + 1]);
        put_vector(&json, "p", v[0]);
        put_vector(&json, "du", v[2]);
        put_vector(&json, "dv", v[3]);
        put_vector(&json, "n", v[1]);
        qp_json_integer(&json, "flags", s->flags[i]);
        if (exact != NULL) {
            qp_json_open_object(&json, "reference");
            put_vector(&json, "p", exact[i].p);
            put_vector(&json, "du", exact[i].du);
            put_vector(&json, "dv", exact[i].dv);
            put_vector(&json, "n", exact[i].n);
            qp_json_bool(&json, "normal_defined", exact[i].normal_defined);
            qp_json_close(&json);
        }
        qp_json_close(&json);
    }
    qp_json_finish(&json);
}

static void print_row(const char *name, const double v[3], int digits) {
    printf("  %-3s %.*g %.*g %.*g\n", name, digits, v[0], digits, v[1], digits, v[2]);
}

static void print_text(const cli_points *points, const qp_stream *s, const qp_reference_sample *exact) {
    if (s->bound > 0) printf("no position is off by more than %.3g of the diagonal\n", s->bound);
    const int digits = s->precision == QP_DOUBLE ? 17 : 9;
    for (size_t i = 0; i < points->count; ++i) {
        double v[4][3];
        read_sample(s, i, v);
        printf("patch %" PRIu32 " (%.17g, %.17g)%s%s%s\n", points->patch[i], points->uv[2 * i],
               points->uv[2 * i + 1], s->flags[i] & QP_SAMPLE_PAST_DEPTH ? ", past depth" : "",
               s->flags[i] & QP_SAMPLE_NO_NORMAL ? ", no tangent plane" : "",
               s->flags[i] & QP_SAMPLE_LIMIT_FRAME ? ", limit frame" : "");
        print_row("p", v[0], digits);
        print_row("du", v[2], digits);
        print_row("dv", v[3], digits);
        print_row("n", v[1], digits);
        if (exact == NULL) continue;
        printf("  reference%s\n", exact[i].normal_defined ? "" : ", no tangent plane");
        print_row("p", exact[i].p, 17);
        print_row("du", exact[i].du, 17);
        print_row("dv", exact[i].dv, 17);
        print_row("n", exact[i].n, 17);
    }
}

/* The reference at every point, malloced. */
static qp_status evaluate_reference(const qp_mesh *mesh, const cli_points *points,
                                    qp_reference_sample **exact, qp_error *err) {
    *exact = qp_alloc(points->count, sizeof **exact, false);
    if (*exact == NULL) return qp_fail_memory(err, points->count * sizeof **exact, "the reference");
    qp_status status = QP_OK;
    for (size_t i = 0; i < points->count && status == QP_OK; ++i)
        status = qp_reference_eval(mesh, mesh->positions, points->patch[i], 1, points->uv + 2 * i,
                                   &(*exact)[i], err);
    return status;
}

static qp_status sample(const char *name, const cli_evaluation *e, const cli_points *points, bool reference,
                        bool json, qp_error *err) {
    qp_stream stream;
    qp_reference_sample *exact = NULL;
    qp_status status = qp_frame_eval_points(e->frame, points->count, points->patch, points->uv, &stream, err);
    if (status == QP_OK && reference) status = evaluate_reference(e->mesh, points, &exact, err);
    if (status == QP_OK && json) print_json(name, e, points, &stream, exact);
    if (status == QP_OK && !json) print_text(points, &stream, exact);
    free(exact);
    return status;
}

static qp_status read_points(const char *uv, bool patch_given, uint64_t patch, const char *path,
                             cli_points *points, qp_error *err) {
    if ((path == NULL) == (uv == NULL) || patch_given != (uv != NULL))
        return qp_fail(err, QP_BAD_INPUT, "give either --patch and --uv, or --points");
    if (path != NULL) return cli_points_read(path, points, err);
    double at[2];
    if (!cli_uv_read(uv, uv + strlen(uv), at))
        return qp_fail(err, QP_BAD_INPUT, "--uv: '%s' is not of the form U,V", uv);
    return cli_points_add(points, (uint32_t)patch, at[0], at[1], err);
}

static qp_status run(int argc, char **argv, qp_error *err) {
    cli_evaluation_options o = CLI_EVALUATION_DEFAULTS;
    const char *uv = NULL, *path = NULL;
    uint64_t patch = 0;
    bool patch_given = false, json = false, reference = false;
    const cli_option options[] = {
        {"--patch", "P", "patch of the point, in ptex order", CLI_COUNT, &patch, 0, 4294967294.0,
         &patch_given},
        {"--uv", "U,V", "the point, each in [0,1]", CLI_TEXT, &uv, 0, 0, NULL},
        {"--points", "FILE", "points as lines \"patch,u,v\"; - for standard input", CLI_TEXT, &path, 0, 0,
         NULL},
        {"--reference", NULL, "add the exact values, by refinement in extended precision", CLI_FLAG,
         &reference, 0, 0, NULL},
        {"--tolerance", "T", "positions may be off by T times the bounding box's diagonal, for shallower plans",
         CLI_REAL, &o.tolerance, 1e-300, 1e300, NULL},
        CLI_SAMPLING_OPTIONS(o),
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_sample, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    cli_points points = {0};
    cli_evaluation evaluation = {0};
    o.derivatives = true;
    status = read_points(uv, patch_given, patch, path, &points, err);
    if (status == QP_OK) status = cli_evaluation_open(arguments.values[0], &o, false, &evaluation, err);
    if (status == QP_OK) status = sample(arguments.values[0], &evaluation, &points, reference, json, err);
    cli_evaluation_close(&evaluation);
    cli_points_free(&points);
    return status;
}

const cli_command cli_sample = {
    "sample", "MESH", "Evaluates position, derivatives and normal at any points.",
    CLI_MESH_HELP
    "\nFlags: 1 past the plans' depth (--no-exact-tail and --tolerance only), 2 no tangent plane there (the normal is the patch's middle's), 4 "
    "du and dv are a\n"
    "limit frame: tangents that span the tangent plane where derivatives need not exist. Any (u,v) is exact.",
    run};
