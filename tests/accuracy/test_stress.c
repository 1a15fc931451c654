/* The stress families, on the host, in both precisions: nothing is NaN or infinite, normals are of unit length, positions lie
 * within 8 units in the last place of the reference. QUADPLAN_FULL=1 takes all cases with 1,000 samples each. */
#include "host/reference/stress.h"
#include "tests/check.h"

#include <string.h>

/* Cases that once were wrong, beyond the first ones: vertices on creases of non-manifold edges, fans beside them, Chaikin's rule
 * over several fans. */
static const struct {
    const char *family;
    uint32_t number;
} special[] = {{"non-manifold", 69}, {"non-manifold", 154}, {"non-manifold", 312}, {"everything", 47},
               {"everything", 67},   {"everything", 294},   {"far-scaled", 22}};

static void one_family(const qp_stress_family *family, qp_device *device, qp_precision precision, int full) {
    qp_stress_report report = {0};
    qp_error err = {0};
    const uint32_t most = CHECK_SANITIZED ? 4 : 10; /* some case of each has a surface */
    const uint32_t cases = full || family->cases < most ? family->cases : most;
    /* Fans of 2000 faces, number 1, take seconds: in one precision. */
    const uint32_t first = precision == QP_DOUBLE && !full ? 2 : 0;
    for (uint32_t number = first; number < cases; ++number) {
        qp_stress_case tried;
        const uint64_t samples = full ? 1000 : CHECK_SANITIZED ? 20 : 40;
        if (!CHECK_OK(qp_stress_case_make(family, number, 0, samples, &tried, &err), err)) return;
        CHECK_OK(qp_stress_measure(&tried, number, device, precision, &report, NULL, NULL, &err), err);
        qp_stress_case_free(&tried);
    }
    printf("%s, %s: %llu samples, %.3g ulp (case %u, patch %u, %.17g,%.17g), normals %.3g degrees\n",
           family->name, precision == QP_DOUBLE ? "double" : "float", (unsigned long long)report.samples,
           report.worst_ulp, report.worst.number, report.worst.patch, report.worst.uv[0], report.worst.uv[1],
           report.worst_normal_deg);
    CHECK(report.cases == (cases > first ? cases - first : 0));
    CHECK(report.samples > 0 || cases <= first);
    CHECK(report.nonfinite == 0);
    CHECK(report.normals_not_unit == 0);
    CHECK(report.past_depth == 0);
    /* In double the sums over fans of 2000 faces count (docs/stress.md). */
    CHECK(report.worst_ulp <= (precision == QP_DOUBLE && strcmp(family->name, "valence") == 0 ? 40 : 8));
}

static void special_cases(qp_device *device, qp_precision precision) {
    size_t count;
    const qp_stress_family *families = qp_stress_families(&count);
    for (size_t s = 0; s < sizeof special / sizeof special[0]; ++s) {
        for (size_t i = 0; i < count; ++i) {
            qp_stress_report report = {0};
            qp_error err = {0};
            qp_stress_case tried;
            if (strcmp(families[i].name, special[s].family) != 0) continue;
            if (!CHECK_OK(qp_stress_case_make(&families[i], special[s].number, 0, 100, &tried, &err), err))
                continue;
            CHECK_OK(
                qp_stress_measure(&tried, special[s].number, device, precision, &report, NULL, NULL, &err),
                err);
            CHECK(report.samples == 100 && report.nonfinite == 0);
            if (!CHECK(report.worst_ulp <= 8))
                printf("%s %u: %g ulp\n", special[s].family, special[s].number, report.worst_ulp);
            qp_stress_case_free(&tried);
        }
    }
}

/* The same case twice is the same case, and other seeds and numbers are others. */
static void check_deterministic(const qp_stress_family *family) {
    qp_error err = {0};
    qp_stress_case a, b, c;
    if (!CHECK_OK(qp_stress_case_make(family, 5, 1, 50, &a, &err), err)) return;
    if (!CHECK_OK(qp_stress_case_make(family, 5, 1, 50, &b, &err), err)) return;
    if (!CHECK_OK(qp_stress_case_make(family, 5, 2, 50, &c, &err), err)) return;
    CHECK(a.count == b.count && a.mesh->n_vertices == b.mesh->n_vertices && a.depth == b.depth);
    CHECK(memcmp(a.mesh->positions, b.mesh->positions, 24 * (size_t)a.mesh->n_vertices) == 0);
    CHECK(memcmp(a.uv, b.uv, 2 * (size_t)a.count * sizeof *a.uv) == 0);
    CHECK(a.count != c.count || memcmp(a.uv, c.uv, 2 * (size_t)a.count * sizeof *a.uv) != 0);
    for (uint64_t i = 0; i < 2 * a.count; ++i) CHECK(a.uv[i] >= 0 && a.uv[i] <= 1);
    qp_stress_case_free(&a);
    qp_stress_case_free(&b);
    qp_stress_case_free(&c);
}

/* Errors as found, against those counted: a float cannot be nearer than half a unit everywhere. */
typedef struct seen {
    uint64_t count;
    double ulp, error;
} seen;

static void see(void *context, const qp_stress_sample *s) {
    seen *most = context;
    most->count++;
    most->ulp = fmax(most->ulp, s->ulp);
    for (int k = 0; k < 3; ++k) most->error = fmax(most->error, fabs(s->got[k] - s->p[k]));
}

static void check_units(qp_device *device) {
    size_t count;
    qp_error err = {0};
    qp_stress_case tried;
    const qp_stress_family *families = qp_stress_families(&count);
    for (int precision = 0; precision < 2; ++precision) {
        const double unit = precision == QP_DOUBLE ? 0x1p-53 : 0x1p-24; /* of numbers from 1/2 on */
        qp_stress_report report = {0};
        seen most = {0};
        if (!CHECK_OK(qp_stress_case_make(&families[0], 3, 0, 400, &tried, &err), err)) return;
        CHECK_OK(qp_stress_measure(&tried, 3, device, (qp_precision)precision, &report, see, &most, &err),
                 err);
        CHECK(most.count == 400 && report.samples == 400 && report.cases == 1);
        CHECK(most.ulp == report.worst_ulp && report.worst_ulp > 0.4);
        /* Its coordinates reach 1, their last place 2^-23, that of smaller ones is less. */
        CHECK(most.error > 0 && most.error <= 2 * unit * report.worst_ulp);
        CHECK(report.worst.ulp == report.worst_ulp && report.worst.number == 3);
        qp_stress_case_free(&tried);
    }
}

int main(void) {
    size_t count;
    qp_error err = {0};
    qp_device *device = NULL;
    const qp_stress_family *families = qp_stress_families(&count);
    const char *full = getenv("QUADPLAN_FULL");
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    for (size_t i = 0; i < count; ++i) {
        check_deterministic(&families[i]);
        one_family(&families[i], device, QP_FLOAT, full != NULL && full[0] == '1');
        one_family(&families[i], device, QP_DOUBLE, full != NULL && full[0] == '1');
    }
    special_cases(device, QP_FLOAT);
    special_cases(device, QP_DOUBLE);
    check_units(device);
    qp_device_free(device);
    return check_report();
}
