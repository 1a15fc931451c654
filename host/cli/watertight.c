/* quadplan watertight: the same bits on both sides of every edge? */
#include "host/reference/watertight.h"
#include "host/base/random.h"
#include "host/cli/evaluation.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

static const char *const spacings[] = {"equal", "fractional_even", "fractional_odd"};

/* A factor in [1, most] an edge, evenly spread over its logarithm. NULL when memory is out. */
static float *random_factors(const qp_mesh *mesh, double most, uint64_t seed) {
    qp_random random = {seed};
    float *factors = qp_alloc(mesh->n_edges, sizeof *factors, false);
    for (uint32_t e = 0; factors != NULL && e < mesh->n_edges; ++e) {
        factors[e] = (float)exp2(qp_random_unit(&random) * log2(most));
        if (!(factors[e] <= (float)most)) factors[e] = (float)most;
    }
    return factors;
}

static void print_json(const char *name, const cli_evaluation *evaluation, const cli_evaluation_options *o,
                       const qp_watertight_report *r) {
    qp_json json;
    qp_json_begin(&json, stdout);
    qp_json_text(&json, "mesh", name);
    qp_json_real(&json, "tess", o->tess);
    qp_json_text(&json, "spacing", spacings[o->spacing]);
    qp_json_text(&json, "precision", o->precision == QP_DOUBLE ? "double" : "float");
    qp_json_integer(&json, "edges", r->edges);
    qp_json_integer(&json, "samples", r->samples);
    qp_json_integer(&json, "position_mismatches", r->position_mismatches);
    qp_json_integer(&json, "normal_mismatches", r->normal_mismatches);
    qp_json_integer(&json, "unmatched_samples", r->unmatched_samples);
    qp_json_integer(&json, "sharp_edges_skipped", r->sharp_edges_skipped);
    qp_json_real(&json, "worst_ulp", r->worst_ulp);
    qp_json_text(&json, "device", qp_device_name(evaluation->device));
    qp_json_finish(&json);
}

static void print_text(const char *name, const cli_evaluation *evaluation, const qp_watertight_report *r) {
    printf("%s on %s\n", name, qp_device_name(evaluation->device));
    printf("  %" PRIu64 " shared edges, %" PRIu64 " samples on the perimeters of patches\n", r->edges,
           r->samples);
    printf("  positions that differ: %" PRIu64 ", by %g units in the last place at most\n",
           r->position_mismatches, r->worst_ulp);
    printf("  normals that differ: %" PRIu64 " (%" PRIu64 " sharp edges left out)\n", r->normal_mismatches,
           r->sharp_edges_skipped);
    printf("  samples without a partner: %" PRIu64 "\n", r->unmatched_samples);
}

static qp_status check(const qp_watertight_report *r, qp_error *err) {
    if (qp_watertight_holds(r)) return QP_OK;
    return qp_fail(err, QP_CHECK_FAILED,
                   "not watertight: %" PRIu64 " positions and %" PRIu64 " normals differ, %" PRIu64
                   " samples are unmatched; the first at patch %" PRIu32 " (%.9g, %.9g)",
                   r->position_mismatches, r->normal_mismatches, r->unmatched_samples, r->worst_patch,
                   (double)r->worst_u, (double)r->worst_v);
}

static qp_status run(int argc, char **argv, qp_error *err) {
    cli_evaluation_options o = CLI_EVALUATION_DEFAULTS;
    uint64_t seed = 0;
    bool random = false, json = false;
    const cli_option options[] = {
        CLI_EVALUATION_OPTIONS(o),
        {"--random-factors", "SEED", "every edge gets a random factor of its own, from 1 to that of --tess",
         CLI_COUNT, &seed, 0, 18446744073709551615.0, &random},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    qp_status status = cli_parse(&cli_watertight, options, argc, argv, 1, &arguments, err);
    if (status != QP_OK || arguments.help) return status;

    cli_evaluation evaluation;
    status = cli_evaluation_open(arguments.values[0], &o, false, &evaluation, err);
    if (status != QP_OK) return status;
    float *factors = NULL;
    qp_stream stream;
    qp_watertight_report report;
    if (random && (factors = random_factors(evaluation.mesh, o.tess, seed)) == NULL)
        status = qp_fail_memory(err, evaluation.mesh->n_edges * sizeof *factors, "factors of edges");
    qp_tessellation tessellation = cli_evaluation_tessellation(&o);
    tessellation.edge_factors = factors;
    if (status == QP_OK) status = qp_frame_eval(evaluation.frame, &tessellation, &stream, err);
    if (status == QP_OK) status = qp_watertight_check(evaluation.mesh, &stream, &report, err);
    if (status == QP_OK) {
        if (json)
            print_json(arguments.values[0], &evaluation, &o, &report);
        else
            print_text(arguments.values[0], &evaluation, &report);
        status = check(&report, err);
    }
    free(factors);
    cli_evaluation_close(&evaluation);
    return status;
}

const cli_command cli_watertight = {
    "watertight", "MESH", "Checks that patches have the same bits where they meet.",
    CLI_MESH_HELP "\nCompares positions at every shared edge and vertex, and normals where the surface is "
                  "smooth, from the mesh's faces and the\n"
                  "vertex stream alone. Exit 1 when any differ, or when a patch lacks a sample that another "
                  "has on the same edge.",
    run};
