/* quadplan stress: families of hard cases against the reference. */
#include "host/reference/stress.h"
#include "host/cli/evaluation.h"
#include "host/cli/points_file.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

typedef struct stress_options {
    const char *family, *device, *uv, *write;
    uint64_t cases, number, seed, samples, patch;
    bool cases_given, number_given, patch_given, list, json;
    int precision;
} stress_options;

static void list_families(void) {
    size_t count;
    const qp_stress_family *families = qp_stress_families(&count);
    for (size_t i = 0; i < count; ++i)
        printf("%-17s %3" PRIu32 " cases: %s\n", families[i].name, families[i].cases, families[i].summary);
}

static qp_status find_family(const char *name, const qp_stress_family **family, qp_error *err) {
    size_t count;
    const qp_stress_family *families = qp_stress_families(&count);
    *family = NULL;
    for (size_t i = 0; i < count && name != NULL; ++i)
        if (strcmp(families[i].name, name) == 0) *family = &families[i];
    if (name == NULL || *family != NULL) return QP_OK;
    return qp_fail(err, QP_BAD_INPUT, "--family: '%s' is none of those of `quadplan stress --list`", name);
}

/* The command that evaluates exactly one sample; empty when there is none. */
static void command_of(const char *family, const stress_options *o, const qp_stress_sample *s, bool any,
                       char *text, size_t size) {
    text[0] = '\0';
    if (!any) return;
    int at = snprintf(text, size, "quadplan stress --family %s --case %" PRIu32, family, s->number);
    if (o->seed != 0) at += snprintf(text + at, size - (size_t)at, " --seed %" PRIu64, o->seed);
    if (o->precision == QP_DOUBLE) at += snprintf(text + at, size - (size_t)at, " --precision double");
    if (o->device != NULL && strlen(o->device) < 100)
        at += snprintf(text + at, size - (size_t)at, " --device '%s'", o->device);
    snprintf(text + at, size - (size_t)at, " --patch %" PRIu32 " --uv %.17g,%.17g", s->patch, s->uv[0],
             s->uv[1]);
}

/* ---- One family ---- */

static void print_header(void) {
    printf("%-17s %6s %8s %10s %9s %10s %7s %8s %9s %8s %6s\n", "family", "cases", "samples", "ulp",
           "nonfinite", "normal deg", "no norm", "missing", "not unit", "ill", "past");
}

static void print_family(const char *name, const qp_stress_report *r, const char *command) {
    printf("%-17s %6" PRIu64 " %8" PRIu64 " %10.3g %9" PRIu64 " %10.3g %7" PRIu64 " %8" PRIu64 " %9" PRIu64
           " %8" PRIu64 " %6" PRIu64 "\n",
           name, r->cases, r->samples, r->worst_ulp, r->nonfinite, r->worst_normal_deg, r->no_normal,
           r->normals_missing, r->normals_not_unit, r->normals_ill, r->past_depth);
    if (command[0] != '\0') printf("  %s\n", command);
    fflush(stdout);
}

static void print_json(qp_json *json, const char *name, const qp_stress_report *r, const char *command,
                       const char *normal_command, const char *missing_command) {
    qp_json_open_object(json, NULL);
    qp_json_text(json, "name", name);
    qp_json_integer(json, "cases", r->cases);
    qp_json_integer(json, "samples", r->samples);
    qp_json_real(json, "worst_ulp", r->worst_ulp);
    qp_json_integer(json, "nonfinite", r->nonfinite);
    qp_json_text(json, "command", command);
    qp_json_real(json, "worst_normal_deg", r->worst_normal_deg);
    qp_json_text(json, "normal_command", normal_command);
    qp_json_integer(json, "no_normal", r->no_normal);
    qp_json_integer(json, "normals_missing", r->normals_missing);
    qp_json_text(json, "missing_command", missing_command);
    qp_json_integer(json, "normals_not_unit", r->normals_not_unit);
    qp_json_integer(json, "normals_ill", r->normals_ill);
    qp_json_integer(json, "past_depth", r->past_depth);
    qp_json_close(json);
}

static qp_status run_family(const qp_stress_family *family, const stress_options *o, qp_device *device,
                            qp_json *json, uint64_t *nonfinite, qp_error *err) {
    qp_stress_report report = {0};
    const uint64_t first = o->number_given ? o->number : 0, end = o->number_given  ? o->number + 1
                                                                  : o->cases_given ? o->cases
                                                                                   : family->cases;
    for (uint64_t number = first; number < end; ++number) {
        qp_stress_case tried;
        qp_status status = qp_stress_case_make(family, (uint32_t)number, o->seed, o->samples, &tried, err);
        if (status == QP_OK)
            status = qp_stress_measure(&tried, (uint32_t)number, device, (qp_precision)o->precision, &report,
                                       NULL, NULL, err);
        qp_stress_case_free(&tried);
        if (status != QP_OK) {
            qp_error inner = *err;
            return qp_fail(err, status, "%s, case %" PRIu64 ": %s", family->name, number, inner.message);
        }
    }
    char command[512], normal_command[512], missing_command[512];
    command_of(family->name, o, &report.worst, report.worst_ulp > 0 || report.nonfinite > 0, command,
               sizeof command);
    command_of(family->name, o, &report.worst_normal, report.worst_normal_deg > 0, normal_command,
               sizeof normal_command);
    command_of(family->name, o, &report.missing, report.normals_missing > 0, missing_command,
               sizeof missing_command);
    if (o->json)
        print_json(json, family->name, &report, command, normal_command, missing_command);
    else
        print_family(family->name, &report, command);
    *nonfinite += report.nonfinite;
    return QP_OK;
}

static qp_status run_families(const stress_options *o, const qp_stress_family *only, qp_device *device,
                              qp_error *err) {
    size_t count;
    const qp_stress_family *families = qp_stress_families(&count);
    qp_json json;
    uint64_t nonfinite = 0;
    qp_status status = QP_OK;
    if (o->json) {
        qp_json_begin(&json, stdout);
        qp_json_text(&json, "precision", o->precision == QP_DOUBLE ? "double" : "float");
        qp_json_text(&json, "device", qp_device_name(device));
        qp_json_integer(&json, "seed", o->seed);
        qp_json_open_array(&json, "families");
    } else {
        print_header();
    }
    for (size_t i = 0; i < count && status == QP_OK; ++i)
        if (only == NULL || only == &families[i])
            status = run_family(&families[i], o, device, &json, &nonfinite, err);
    if (o->json) qp_json_finish(&json);
    if (status == QP_OK && nonfinite > 0)
        status = qp_fail(err, QP_CHECK_FAILED, "%" PRIu64 " samples are not finite", nonfinite);
    return status;
}

/* ---- One sample ---- */

static void print_vector(const char *name, const double v[3], int digits) {
    printf("  %-9s %.*g %.*g %.*g\n", name, digits, v[0], digits, v[1], digits, v[2]);
}

static void print_sample(void *context, const qp_stress_sample *s) {
    const int digits = *(const int *)context;
    printf("case %" PRIu32 ", patch %" PRIu32 " (%.17g, %.17g): %.4g ulp, flags %u\n", s->number, s->patch,
           s->uv[0], s->uv[1], s->ulp, s->flags);
    print_vector("p", s->got, digits);
    print_vector("reference", s->p, 17);
    print_vector("n", s->got + 3, digits);
    print_vector("reference", s->n, 17);
    if (s->n[0] != 0 || s->n[1] != 0 || s->n[2] != 0) printf("  normal off by %.4g degrees\n", s->normal_deg);
}

static qp_status run_sample(const qp_stress_family *family, const stress_options *o, qp_device *device,
                            qp_error *err) {
    qp_stress_case tried;
    qp_stress_report report = {0};
    double uv[2];
    if (!cli_uv_read(o->uv, o->uv + strlen(o->uv), uv))
        return qp_fail(err, QP_BAD_INPUT, "--uv: '%s' is not of the form U,V", o->uv);
    qp_status status = qp_stress_case_make(family, (uint32_t)o->number, o->seed, 1, &tried, err);
    if (status != QP_OK) return status;
    if (o->patch >= tried.mesh->n_patches || tried.count == 0) {
        status = qp_fail(err, QP_BAD_INPUT, "--patch: the case has %" PRIu32 " patches%s",
                         tried.mesh->n_patches, tried.count == 0 ? ", all of them holes" : "");
    } else {
        int digits = o->precision == QP_DOUBLE ? 17 : 9;
        tried.patch[0] = (uint32_t)o->patch;
        memcpy(tried.uv, uv, sizeof uv);
        status = qp_stress_measure(&tried, (uint32_t)o->number, device, (qp_precision)o->precision, &report,
                                   o->json ? NULL : print_sample, &digits, err);
    }
    if (status == QP_OK && o->json) {
        char command[512];
        qp_json json;
        command_of(family->name, o, &report.worst, report.samples > 0, command, sizeof command);
        qp_json_begin(&json, stdout);
        qp_json_open_array(&json, "families");
        print_json(&json, family->name, &report, command, command, report.normals_missing > 0 ? command : "");
        qp_json_finish(&json);
    }
    if (status == QP_OK && report.nonfinite > 0)
        status = qp_fail(err, QP_CHECK_FAILED, "the sample is not finite");
    qp_stress_case_free(&tried);
    return status;
}

static qp_status write_mesh(const qp_stress_family *family, const stress_options *o, qp_error *err) {
    qp_stress_case tried;
    qp_status status = qp_stress_case_make(family, (uint32_t)o->number, o->seed, 1, &tried, err);
    if (status != QP_OK) return status;
    status = qp_mesh_write_obj(tried.mesh, o->write, err);
    if (status == QP_OK)
        fprintf(stderr, "quadplan: %s: depth of its plans %" PRIu32 "%s\n", o->write, tried.depth,
                tried.depth == 0 ? " (the default)" : "");
    qp_stress_case_free(&tried);
    return status;
}

static qp_status run(int argc, char **argv, qp_error *err) {
    stress_options o = {.samples = 200};
    const cli_option options[] = {
        {"--family", "NAME", "one family only", CLI_TEXT, &o.family, 0, 0, NULL},
        {"--list", NULL, "list the families", CLI_FLAG, &o.list, 0, 0, NULL},
        {"--cases", "N", "cases a family (default: as --list says)", CLI_COUNT, &o.cases, 1, 1e9,
         &o.cases_given},
        {"--samples", "N", "samples a case (default 200)", CLI_COUNT, &o.samples, 1, 1e8, NULL},
        {"--seed", "S", "of what is random (default 0)", CLI_COUNT, &o.seed, 0, 18446744073709551615.0, NULL},
        {"--precision", CLI_PRECISIONS, "of stencils and kernels (default float)", CLI_CHOICE, &o.precision,
         0, 0, NULL},
        {"--device", "D", "host, P.D, or part of a name, as `quadplan devices` lists them", CLI_TEXT,
         &o.device, 0, 0, NULL},
        {"--case", "I", "one case only, of --family", CLI_COUNT, &o.number, 0, 1e9, &o.number_given},
        {"--patch", "P", "one sample only, of --case: its patch", CLI_COUNT, &o.patch, 0, 4294967294.0,
         &o.patch_given},
        {"--uv", "U,V", "and its place", CLI_TEXT, &o.uv, 0, 0, NULL},
        {"--write", "FILE.obj", "write the mesh of --case instead", CLI_TEXT, &o.write, 0, 0, NULL},
        {"--json", NULL, "print one JSON object", CLI_FLAG, &o.json, 0, 0, NULL},
        {0},
    };
    cli_arguments arguments;
    const qp_stress_family *family;
    qp_device *device = NULL;
    qp_status status = cli_parse(&cli_stress, options, argc, argv, 0, &arguments, err);
    if (status != QP_OK || arguments.help) return status;
    if (o.list) {
        list_families();
        return QP_OK;
    }
    status = find_family(o.family, &family, err);
    if (status != QP_OK) return status;
    if (o.number_given && family == NULL) return qp_fail(err, QP_BAD_INPUT, "--case needs --family");
    if (o.patch_given != (o.uv != NULL) || (o.patch_given && !o.number_given))
        return qp_fail(err, QP_BAD_INPUT, "--patch and --uv go together, and need --case");
    if (o.write != NULL && !o.number_given) return qp_fail(err, QP_BAD_INPUT, "--write needs --case");
    if (o.write != NULL) return write_mesh(family, &o, err);
    status = qp_device_open(o.device, &device, err);
    if (status == QP_OK)
        status = o.patch_given ? run_sample(family, &o, device, err) : run_families(&o, family, device, err);
    qp_device_free(device);
    return status;
}

const cli_command cli_stress = {
    "stress", "", "Evaluates families of hard cases and compares them with the exact limit surface.",
    "Columns, by family: the worst position error in units of the last place (ulp); samples with NaN or Inf; "
    "the worst "
    "error of\n"
    "well-conditioned normals in degrees; samples flagged as without a normal, and of these such as have "
    "one, well "
    "conditioned;\n"
    "normals that are not of unit length; normals not measured as they are ill conditioned; samples past the "
    "plans' "
    "depth.\n"
    "A unit is, on each axis, that of the largest absolute coordinate in the patch's 1-ring: all vertices of "
    "the base "
    "faces that\n"
    "touch the patch's base face. Errors are those from the surface of the mesh's double coordinates. A "
    "normal is well "
    "conditioned\n"
    "where a unit in the last place of every coordinate turns it by no more than 1e-3 degrees (double: "
    "1e-11) and its "
    "tangents\n"
    "have a condition number of 100 at the most. Below each family stands the command of its worst sample. Exit 1 when one is "
    "not finite.",
    run};
