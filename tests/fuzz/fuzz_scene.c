/* Fuzz target: any bytes are a scene whose every value is in range, or refused with one line. Run as fuzz_obj is.
 */
#include "host/scene/image.h"
#include "host/scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static void demand(bool good, const char *what) {
    if (good) return;
    fprintf(stderr, "fuzz_scene: %s\n", what);
    abort();
}

/* NaN is outside every range. */
static bool within(double x, double low, double high) {
    return x >= low && x <= high;
}

static void check_scene(const qp_scene *s) {
    demand(s->why != NULL && (s->mesh_path == NULL) != (s->generate_kind == NULL), "texts");
    demand(within(s->factor, 1, 64) && (unsigned)s->spacing <= QP_FRACTIONAL_ODD, "tessellation");
    demand(s->factor_min >= 1 && s->factor_min <= s->factor_max && s->factor_max <= 64, "random factors");
    demand(s->surface_options.depth <= QP_DEPTH_LIMIT, "depth");
    demand(within(s->fov, 1, 150) && within(s->zoom, 0.01, 100), "camera");
    for (int k = 0; k < 3; k++) {
        demand(within(s->eye[k], -1e9, 1e9) && within(s->target[k], -1e9, 1e9) && within(s->up[k], -1e9, 1e9),
               "camera");
        demand(within(s->colour[k], 0, 100) && within(s->key.colour[k], 0, 100), "colours");
    }
    demand(s->width >= 1 && s->width <= QP_IMAGE_SIDE_MAX && s->height >= 1 && s->height <= QP_IMAGE_SIDE_MAX,
           "image size");
    demand(qp_colour_name(s->colour_by) != NULL, "colour mode");
    demand(s->palette_count >= 1 && s->palette_count <= QP_PALETTE_MAX, "palette");
    demand(within(s->wire_width, 0, 20) && s->shadow_samples <= 256, "lines and lights");
    demand(s->n_passes <= QP_PASSES_MAX && (s->n_passes == 0 || s->passes != NULL), "passes");
    for (uint32_t i = 0; i < s->n_passes; ++i) {
        demand(s->passes[i].name != NULL && s->passes[i].n_passes == 0, "a pass");
        check_scene(&s->passes[i]);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
    qp_scene *scene = NULL;
    qp_error err = {0};
    const qp_status status = qp_scene_parse("fuzz", (const char *)bytes, size, &scene, &err);
    demand(status == QP_OK || status == QP_BAD_INPUT, "neither good nor bad input");
    demand((status == QP_OK) == (scene != NULL), "status and scene disagree");
    if (status == QP_OK)
        check_scene(scene);
    else
        demand(strncmp(err.message, "fuzz:", 5) == 0 && strpbrk(err.message, "\n\r") == NULL,
               "the message is not one line with the file's name");
    qp_scene_free(scene);
    return 0;
}
