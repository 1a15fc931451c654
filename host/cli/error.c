/* quadplan error: the vertex stream against the reference. */
#include "host/cli/evaluation.h"
#include "host/reference/reference.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define SETS "grid|corner|random"
static const char *const set_names[] = {"grid", "corner", "random"};

typedef struct thresholds {
    double position, normal; /* infinite: none */
} thresholds;

static void print_place(qp_json *json, const char *key, uint32_t patch, double u, double v) {
    qp_json_open_object(json, key);
    qp_json_integer(json, "patch", patch);
    qp_json_real(json, "u", u);
    qp_json_real(json, "v", v);
    qp_json_close(json);
}

static void print_json(const char *name, const char *set, const cli_evaluation *evaluation,
                       const cli_evaluation_options *options, const qp_error_report *r) {
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_text(&json, "mesh", name);
    qp_json_text(&json, "set", set);
    qp_json_text(&json, "precision", options->precision == QP_DOUBLE ? "double" : "float");
    qp_json_integer(&json, "samples", r->samples);
    qp_json_real(&json, "position_max", r->position_max);
    qp_json_real(&json, "position_rms", r->position_rms);
    qp_json_real(&json, "normal_max_deg", r->normal_max_deg);
    qp_json_real(&json, "normal_rms_deg", r->normal_rms_deg);
    print_place(&json, "worst", r->worst_patch, r->worst_u, r->worst_v);
    print_place(&json, "worst_normal", r->worst_normal_patch, r->worst_normal_u, r->worst_normal_v);
    qp_json_integer(&json, "nonfinite", r->nonfinite);
    qp_json_integer(&json, "normals_undefined", r->normals_undefined);
    qp_json_integer(&json, "normals_ill", r->normals_ill);
    qp_json_real(&json, "ill_normal_max_deg", r->ill_normal_max_deg);
    qp_json_real(&json, "ill_normal_deg_per_condition", r->ill_normal_deg_per_condition);
    qp_json_integer(&json, "past_depth", r->past_depth);
    qp_json_real(&json, "past_position_max", r->past_position_max);
    qp_json_real(&json, "past_normal_max_deg", r->past_normal_max_deg);
    qp_json_text(&json, "device", qp_device_name(evaluation->device));
    qp_json_finish(&json);
}

static void print_text(const char *name, const char *set, const cli_evaluation *evaluation,
                       const qp_error_report *r) {
    printf("%s on %s, set %s: %" PRIu64 " samples\n", name, qp_device_name(evaluation->device), set,
           r->samples);
    printf("  position  max %.3e  rms %.3e  of the diagonal; worst at patch %" PRIu32 " (%.9g, %.9g)\n",
           r->position_max, r->position_rms, r->worst_patch, r->worst_u, r->worst_v);
    printf("  normal    max %.3e  rms %.3e  degrees; worst at patch %" PRIu32 " (%.9g, %.9g)\n",
           r->normal_max_deg, r->normal_rms_deg, r->worst_normal_patch, r->worst_normal_u, r->worst_normal_v);
    printf("  %" PRIu64 " not finite, %" PRIu64 " without a normal\n", r->nonfinite, r->normals_undefined);
    printf("  %" PRIu64 " whose tangents have a condition above %d, left out above: normal max %.3e, over "
                        "the condition %.3e\n",
           r->normals_ill, (int)QP_WELL_CONDITIONED, r->ill_normal_max_deg, r->ill_normal_deg_per_condition);
    printf("  %" PRIu64 " past the plans' depth, left out above: position max %.3e, normal max %.3e\n",
           r->past_depth, r->past_position_max, r->past_normal_max_deg);
}

static qp_status evaluate(const cli_evaluation *evaluation, const cli_evaluation_options *o, const char *set,
                          uint64_t samples, uint64_t seed, qp_error_report *report, qp_error *err) {
    qp_stream stream = {0};
    if (strcmp(set, "grid") == 0) {
        const qp_tessellation tessellation = cli_evaluation_tessellation(o);
        qp_status status = qp_frame_eval(evaluation->frame, &tessellation, &stream, err);
        if (status != QP_OK) return status;
        return qp_reference_compare(evaluation->mesh, &stream, NULL, report, err);
    }
    qp_sample_set points = {0};
    qp_status status = qp_sample_set_make(evaluation->mesh, set, samples, seed, &points, err);
    if (status == QP_OK)
        status = qp_frame_eval_points(evaluation->frame, points.count, points.patch, points.uv, &stream, err);
    if (status == QP_OK) status = qp_reference_compare(evaluation->mesh, &stream, points.uv, report, err);
    qp_sample_set_free(&points);
    return status;
}

/* Values that are not finite fail whatever the thresholds are. */
static qp_status check(const qp_error_report *r, const thresholds *most, qp_error *err) {
    if (r->nonfinite > 0)
        return qp_fail(err, QP_CHECK_FAILED, "%" PRIu64 " samples are not finite", r->nonfinite);
    if (!(r->position_max <= most->position))
        return qp_fail(err, QP_CHECK_FAILED, "position error %g exceeds %g", r->position_max, most->position);
    if (!(r->normal_max_deg <= most->normal))
        return qp_fail(err, QP_CHECK_FAILED, "normal error %g degrees exceeds %g", r->normal_max_deg,
                       most->normal);
    return QP_OK;
}

static qp_status run(int argc, char **argv, qp_error *err) {
    cli_evaluation_options o = CLI_EVALUATION_DEFAULTS;
    thresholds most = {INFINITY, INFINITY};
    uint64_t samples = 20000, seed = 0;
    int set = 0;
    bool json = false;
    const cli_option options[] = {
        CLI_EVALUATION_OPTIONS(o),
        {"--set", SETS,
         "where to sample: the tessellator's points, 2^-k about corners, anywhere (default grid)", CLI_CHOICE,
         &set, 0, 0, NULL},
        {"--samples", "N", "of the random set (default 20000)", CLI_COUNT, &samples, 1, 1e9, NULL},
        {"--seed", "N", "of the random set (default 0)", CLI_COUNT, &seed, 0, 18446744073709551615.0, NULL},
        {"--max-position", "E", "exit 1 when the position error, over the diagonal, exceeds E", CLI_REAL,
         &most.position, 0, 1e300, NULL},
        {"--max-normal", "DEG", "exit 1 when the normal error exceeds DEG degrees", CLI_REAL, &most.normal, 0,
         180, NULL},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_error, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;

    cli_evaluation evaluation;
    status = cli_evaluation_open(arguments.values[0], &o, false, &evaluation, err);
    if (status != QP_OK) return status;
    qp_error_report report = {0};
    status = evaluate(&evaluation, &o, set_names[set], samples, seed, &report, err);
    if (status == QP_OK) {
        if (json) {
            print_json(arguments.values[0], set_names[set], &evaluation, &o, &report);
        } else {
            print_text(arguments.values[0], set_names[set], &evaluation, &report);
        }
        status = check(&report, &most, err);
    }
    cli_evaluation_close(&evaluation);
    return status;
}

const cli_command cli_error = {"error", "MESH",
                               "Compares the vertex stream of a mesh with the exact limit surface.",
                               CLI_MESH_HELP "\nPosition errors are relative to the diagonal of the mesh's "
                                             "bounding box. Below --depth, deeper plans are made on\n"
                                             "demand, so that it changes time and memory, not errors.",
                               run};
