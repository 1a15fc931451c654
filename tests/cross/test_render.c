/* A picture of a scene: what was drawn is there, in its colours, twice the same; EGL draws what OSMesa draws. */
#define _GNU_SOURCE
#include "gl/render.h"
#include "tests/check.h"

#include <string.h>

typedef struct drawing {
    qp_scene *scene;
    qp_mesh *mesh;
    qp_surface *surface;
    qp_device *device;
    qp_frame *frame;
    qp_stream stream;
    float *factors;
    qp_tessellation tessellation;
} drawing;

static bool open_drawing(const char *text, drawing *d) {
    qp_error err;
    qp_frame_options options = {.want_triangles = 1};
    return CHECK_OK(qp_scene_parse("s.json", text, strlen(text), &d->scene, &err), err) &&
           CHECK_OK(qp_scene_mesh(d->scene, NULL, NULL, &d->mesh, &err), err) &&
           CHECK_OK(qp_surface_create(d->mesh, &d->scene->surface_options, &d->surface, &err), err) &&
           CHECK_OK(qp_device_open("host", &d->device, &err), err) &&
           CHECK_OK(qp_frame_create(d->device, d->surface, &options, &d->frame, &err), err) &&
           CHECK_OK(qp_scene_tessellation(d->scene, d->mesh, &d->tessellation, &d->factors, &err), err) &&
           CHECK_OK(qp_frame_eval(d->frame, &d->tessellation, &d->stream, &err), err);
}

static void close_drawing(drawing *d) {
    free(d->factors);
    qp_frame_free(d->frame);
    qp_device_free(d->device);
    qp_surface_free(d->surface);
    qp_mesh_free(d->mesh);
    qp_scene_free(d->scene);
}

static const char scene_text[] =
    "{\"why\": \"test\", \"mesh\": {\"generate\": \"cube\"}, \"tessellation\": {\"factor\": 8},"
    " \"camera\": {\"azimuth\": 30, \"elevation\": 20}, \"background\": {\"alpha\": 0},"
    " \"lights\": {\"shadow_samples\": 16}, \"image\": {\"width\": 96, \"height\": 64}}";

static size_t covered(const qp_image *image) {
    size_t n = 0;
    for (size_t k = 0; k < (size_t)image->width * image->height; k++) n += image->rgba[4 * k + 3] > 127;
    return n;
}

static void colours(drawing *d) {
    for (int mode = QP_COLOUR_MATERIAL; mode <= QP_COLOUR_COMPONENT; mode++) {
        qp_error err;
        qp_image image;
        char backend[128];
        d->scene->colour_by = (qp_colour)mode;
        d->scene->wire_width = mode % 2;
        if (!CHECK_OK(qp_render(d->scene, d->frame, &d->tessellation, &d->stream, QP_BACKEND_STREAM, &image,
                                backend, &err),
                      err))
            return;
        size_t n = covered(&image), bright = 0, bad = 0;
        for (size_t k = 0; k < 4 * (size_t)image.width * image.height; k++) bad += !(image.rgba_f[k] >= 0);
        for (size_t k = 0; k < (size_t)image.width * image.height; k++)
            bright += image.rgba[4 * k] + image.rgba[4 * k + 1] + image.rgba[4 * k + 2] > 120;
        CHECK(bad == 0);
        /* A ball that fits the picture's height covers pi/4 of its square. */
        CHECK(n > 64 * 64 / 2 && n < 64 * 64);
        CHECK(bright > n / 2);
        CHECK(image.rgba[3] == 0); /* a corner */
        qp_image_free(&image);
    }
    d->scene->colour_by = QP_COLOUR_MATERIAL;
    d->scene->wire_width = 0;
}

/* The middle of the "normal" picture holds the normal there: towards the eye. */
static void normals(drawing *d) {
    qp_error err;
    qp_image image;
    char backend[128];
    d->scene->colour_by = QP_COLOUR_NORMAL;
    if (!CHECK_OK(qp_render(d->scene, d->frame, &d->tessellation, &d->stream, QP_BACKEND_STREAM, &image,
                            backend, &err),
                  err))
        return;
    const uint8_t *middle = image.rgba + 4 * (32 * 96 + 48);
    const double degree = 3.14159265358979 / 180;
    const double toward[3] = {cos(20 * degree) * sin(30 * degree), sin(20 * degree),
                              cos(20 * degree) * cos(30 * degree)};
    double cosine = 0;
    for (int k = 0; k < 3; k++) {
        double s = middle[k] / 255.0;
        cosine += (2 * s - 1) * toward[k];
    }
    CHECK(cosine > 0.9);
    d->scene->colour_by = QP_COLOUR_MATERIAL;
    qp_image_free(&image);
}

static void same_again(drawing *d) {
    qp_error err;
    qp_image first, second;
    char backend[128];
    double difference = -1;
    setenv("QUADPLAN_GL", "osmesa", 1);
    if (!CHECK_OK(qp_render(d->scene, d->frame, &d->tessellation, &d->stream, QP_BACKEND_STREAM, &first,
                            backend, &err),
                  err))
        return;
    CHECK(strncmp(backend, "OSMesa", 6) == 0);
    if (CHECK_OK(qp_render(d->scene, d->frame, &d->tessellation, &d->stream, QP_BACKEND_STREAM, &second,
                           backend, &err),
                 err)) {
        CHECK_OK(qp_image_compare(&first, &second, &difference, &err), err);
        CHECK(difference == 0);
        qp_image_free(&second);
    }
    setenv("QUADPLAN_GL", "egl", 1);
    if (qp_render(d->scene, d->frame, &d->tessellation, &d->stream, QP_BACKEND_STREAM, &second, backend,
                  &err) == QP_OK) {
        CHECK(strncmp(backend, "EGL", 3) == 0);
        CHECK_OK(qp_image_compare(&first, &second, &difference, &err), err);
        printf("%s: differs by %g from OSMesa\n", backend, difference);
        CHECK(difference <= 8);
        qp_image_free(&second);
    } else {
        printf("EGL left out: %s\n", err.message);
    }
    setenv("QUADPLAN_GL", "vulkan", 1);
    CHECK(qp_render(d->scene, d->frame, &d->tessellation, &d->stream, QP_BACKEND_STREAM, &second, backend,
                    &err) == QP_BAD_INPUT);
    unsetenv("QUADPLAN_GL");
    qp_image_free(&first);
}

static void refuses(drawing *d) {
    qp_error err;
    qp_image image;
    char backend[128];
    qp_stream broken = d->stream;
    broken.triangles = NULL;
    CHECK(qp_render(d->scene, d->frame, &d->tessellation, &broken, QP_BACKEND_STREAM, &image, backend,
                    &err) == QP_BAD_INPUT);
    broken = d->stream;
    broken.n_samples = 3;
    CHECK(qp_render(d->scene, d->frame, &d->tessellation, &broken, QP_BACKEND_STREAM, &image, backend,
                    &err) == QP_BAD_INPUT);
    CHECK(image.rgba == NULL && image.rgba_f == NULL);
}

int main(void) {
    drawing d = {0};
    if (open_drawing(scene_text, &d)) {
        colours(&d);
        normals(&d);
        same_again(&d);
        refuses(&d);
    }
    close_drawing(&d);
    return check_report();
}
