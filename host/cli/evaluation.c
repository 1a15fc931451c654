#include "host/cli/evaluation.h"

#include <stdlib.h>

qp_status cli_evaluation_open(const char *argument, const cli_evaluation_options *options,
                              bool want_triangles, cli_evaluation *evaluation, qp_error *err) {
    *evaluation = (cli_evaluation){0};
    qp_surface_options surface_options = {.depth = (uint32_t)options->depth};
    qp_frame_options frame_options = {
        .precision = (qp_precision)options->precision,
        .want_triangles = want_triangles && !options->no_triangles,
        .want_hash = want_triangles,
        .want_derivatives = options->derivatives,
        .no_regular_pass = options->no_regular_pass,
        .no_sharing = options->no_sharing,
        .no_exact_tail = options->no_exact_tail,
        .tolerance = options->tolerance,
    };
    qp_status status = cli_supports_get(&options->supports, &frame_options.supports, err);
    if (status == QP_OK) status = cli_mesh_open(argument, &options->mesh, &evaluation->mesh, err);
    if (status == QP_OK)
        status = qp_surface_create(evaluation->mesh, &surface_options, &evaluation->surface, err);
    if (status == QP_OK) status = qp_device_open(options->device, &evaluation->device, err);
    if (status == QP_OK)
        status =
            qp_frame_create(evaluation->device, evaluation->surface, &frame_options, &evaluation->frame, err);
    if (status != QP_OK) cli_evaluation_close(evaluation);
    return status;
}

void cli_evaluation_close(cli_evaluation *evaluation) {
    qp_frame_free(evaluation->frame);
    qp_device_free(evaluation->device);
    qp_surface_free(evaluation->surface);
    qp_mesh_free(evaluation->mesh);
    *evaluation = (cli_evaluation){0};
}

qp_tessellation cli_evaluation_tessellation(const cli_evaluation_options *o) {
    const bool largest = o->tolerance != 0 && !o->tess_given;
    return (qp_tessellation){
        .spacing = (qp_spacing)o->spacing, .factor = largest ? 64 : (float)o->tess, .tolerance = o->tolerance};
}
