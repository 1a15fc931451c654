/* The tessellation path against the vertex stream: GL's tessellator makes the same points, bit for bit, and shaders that share nothing
 * with the kernels but the plans' bytes the same surface, to 4 units in the last place of the largest coordinate. */
#include "gl/compare.h"
#include "tests/check.h"
#include "tests/unit/mesh_files.h"

#include <stdlib.h>

static qp_gl *gl;
static qp_device *device;
static struct {
    double ulp, degrees;
    unsigned long long points, unjudged;
} all;

static void compare(const char *name, const qp_mesh *mesh, qp_spacing spacing, float factor) {
    qp_error err = {0};
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_gl_surface *drawn = NULL;
    qp_stream stream;
    qp_gl_difference d = {0};
    const qp_tessellation tess = {.spacing = spacing, .factor = factor};
    if (CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, NULL, &frame, &err), err) &&
        CHECK_OK(qp_frame_eval(frame, &tess, &stream, &err), err) &&
        CHECK_OK(qp_gl_surface_open(gl, frame, &tess, NULL, &drawn, &err), err) &&
        CHECK_OK(qp_gl_compare(drawn, frame, &stream, &d, &err), err)) {
        const int good = CHECK(d.points == stream.n_samples && d.missing == 0 && d.added == 0) &
                         CHECK(d.position_ulp <= 4) & CHECK(d.normal_max_deg <= 0.02);
        if (!good)
            printf("  %s, spacing %d, factor %g: %llu points (%llu missing, %llu added), %.2f ulp at patch "
                   "%u (%g, %g), "
                   "%.4f degrees at patch %u (%g, %g)\n",
                   name, (int)spacing, (double)factor, (unsigned long long)d.points,
                   (unsigned long long)d.missing, (unsigned long long)d.added, d.position_ulp, d.worst_patch,
                   d.worst_u, d.worst_v, d.normal_max_deg, d.worst_normal_patch, d.worst_normal_u,
                   d.worst_normal_v);
        all.points += d.points;
        all.unjudged += d.unjudged;
        all.ulp = fmax(all.ulp, d.position_ulp);
        all.degrees = fmax(all.degrees, d.normal_max_deg);
    }
    qp_gl_surface_close(drawn);
    qp_frame_free(frame);
    qp_surface_free(surface);
}

static void report(const char *what) {
    printf("%s: %llu points, at most %.2f ulp and %.4f degrees apart, %llu normals not judged\n", what,
           all.points, all.ulp, all.degrees, all.unjudged);
    all.ulp = all.degrees = 0;
    all.points = all.unjudged = 0;
}

static void compare_generated(const char *kind, qp_generate_options options, qp_spacing spacing,
                              float factor) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    if (CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err)) compare(kind, mesh, spacing, factor);
    qp_mesh_free(mesh);
}

static void compare_file(const char *name, qp_mesh *mesh) {
    static int count = 0;
    const int first = check_full() ? 0 : count++ % 3, last = check_full() ? 2 : first;
    const float factor = mesh->n_faces > 1000 && !check_full() ? 3.4f : 7.3f;
    for (int s = first; s <= last; ++s) compare(name, mesh, (qp_spacing)s, factor);
}

int main(void) {
    qp_error err = {0};
    if (qp_gl_open(&gl, &err) != QP_OK) {
        printf("skipped: %s\n", err.message);
        return 77;
    }
    printf("%s\n", gl->backend);
    if (CHECK_OK(qp_device_open("host", &device, &err), err)) {
        static const char *const kinds[] = {"cube", "torus", "creased-torus", "fan", "prism", "terrain"};
        for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; ++k)
            for (int s = 0; s < 3; ++s)
                compare_generated(kinds[k], (qp_generate_options){.sharpness = -1}, (qp_spacing)s,
                                  k == 0 ? 64 : 9.7f);
        report("generated meshes");
        const uint64_t count = check_full() ? 500 : CHECK_SANITIZED ? 6 : 24;
        for (uint64_t seed = 0; seed < count; ++seed)
            compare_generated(seed % 2 ? "random-open" : "random-closed",
                              (qp_generate_options){.sharpness = -1, .seed = seed, .faces = 60},
                              (qp_spacing)(seed % 3), (float)(1 + seed % 16) + 0.3f * (float)(seed % 4));
        report("random meshes");
        if (!CHECK_SANITIZED && visit_models(compare_file)) report("models");
    }
    qp_device_free(device);
    qp_gl_close(gl);
    return check_report();
}
