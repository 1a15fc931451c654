/* What subcommands say about a tolerance. */
#include "host/cli/cli.h"

#include <inttypes.h>

void cli_tolerance_json(qp_json *json, double tolerance, const qp_stream *s) {
    if (tolerance == 0) return;
    qp_json_real(json, "tolerance", tolerance);
    qp_json_real(json, "bound", s->bound);
    qp_json_integer(json, "patches_over_tolerance", s->over_tolerance);
    qp_json_real(json, "factor_min", (double)s->factor_min);
    qp_json_real(json, "factor_mean", (double)s->factor_mean);
    qp_json_real(json, "factor_max", (double)s->factor_max);
}

void cli_tolerance_text(double tolerance, const qp_stream *s) {
    if (tolerance == 0) return;
    printf("  tolerance %g of the diagonal: factors %g to %g, mean %.3g; no error exceeds %.3g\n", tolerance,
           (double)s->factor_min, (double)s->factor_max, (double)s->factor_mean, s->bound);
}

void cli_tolerance_warn(double tolerance, const qp_stream *s) {
    if (tolerance == 0 || s->over_tolerance == 0) return;
    fprintf(stderr,
            "quadplan: warning: %" PRIu64
            " patches need larger factors for a tolerance of %g; the bound is %.3g\n",
            s->over_tolerance, tolerance, s->bound);
}
