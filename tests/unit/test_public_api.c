/* What a stranger's C99 program does: nothing but the public header, a mesh from memory, known limit points. */
#include "quadplan.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int checks, failures;

static void check(int good, const char *what) {
    ++checks;
    if (good) return;
    ++failures;
    fprintf(stderr, "failed: %s\n", what);
}

static void check_point(const double *got, double x, double y, double z, double tolerance, const char *what) {
    /* Written so that NaN fails. */
    int good =
        fabs(got[0] - x) <= tolerance && fabs(got[1] - y) <= tolerance && fabs(got[2] - z) <= tolerance;
    check(good, what);
    if (!good)
        fprintf(stderr, "    (%.17g, %.17g, %.17g), not (%.17g, %.17g, %.17g)\n", got[0], got[1], got[2], x,
                y, z);
}

static const char cube[] =
    "v -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 -1\nv 1 -1 -1\n"
    "f 1 2 4 3\nf 3 4 6 5\nf 5 6 8 7\nf 7 8 2 1\nf 2 8 6 4\nf 7 1 3 5\n";

/* The limit surface of a cube: corners of valence 3 go to (9 + 4 - 1) / 24 = 1/2 of themselves; the middle of a face
 * goes to (16 + 4 * 4 * 3/4 + 4 * 5/9) / 36 = 68/81. */
static void test_cube(qp_device *device) {
    qp_error err;
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream stream;
    qp_frame_options options;
    const uint32_t patch[4] = {0, 0, 0, 1};
    const double uv[8] = {0, 0, 0.5, 0.5, 1, 1, 0.5, 0.5};
    const double *p;
    memset(&options, 0, sizeof options);
    options.precision = QP_DOUBLE;
    check(qp_mesh_parse_obj("cube", cube, strlen(cube), NULL, &mesh, &err) == QP_OK, "the cube is read");
    if (mesh == NULL) return;
    check(qp_mesh_vertex_count(mesh) == 8 && qp_mesh_face_count(mesh) == 6 && qp_mesh_patch_count(mesh) == 6,
          "the cube is counted");
    if (qp_surface_create(mesh, NULL, &surface, &err) == QP_OK &&
        qp_frame_create(device, surface, &options, &frame, &err) == QP_OK &&
        qp_frame_eval_points(frame, 4, patch, uv, &stream, &err) == QP_OK) {
        p = stream.vertices;
        check(stream.n_samples == 4 && stream.precision == QP_DOUBLE, "four samples come back");
        check_point(p, -0.5, -0.5, 0.5, 1e-14, "limit of a corner of the cube");
        check_point(p + 3, -1 / sqrt(3.0), -1 / sqrt(3.0), 1 / sqrt(3.0), 1e-12, "normal there");
        check_point(p + 6, 0, 0, 68.0 / 81.0, 1e-14, "limit of the middle of a face");
        check_point(p + 9, 0, 0, 1, 1e-14, "normal there");
        check_point(p + 12, 0.5, 0.5, 0.5, 1e-14, "limit of the opposite corner");
        check_point(p + 18, 0, 68.0 / 81.0, 0, 1e-14, "limit of the middle of the second face");
    } else {
        check(0, err.message);
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* A flat 5 x 5 grid of unit quads: Catmull-Clark surfaces reproduce planes, and straight boundaries stay where the
 * boundary is interpolated. */
static void test_plane(qp_device *device) {
    enum { N = 5 };
    double positions[3 * (N + 1) * (N + 1)];
    uint32_t sizes[N * N], vertices[4 * N * N];
    qp_mesh_desc desc;
    qp_error err;
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream stream;
    qp_frame_options options;
    qp_tessellation tessellation;
    uint32_t i, x, y;
    memset(&desc, 0, sizeof desc);
    memset(&options, 0, sizeof options);
    memset(&tessellation, 0, sizeof tessellation);
    for (i = 0; i < (N + 1) * (N + 1); ++i) {
        positions[3 * i] = i % (N + 1);
        positions[3 * i + 1] = i / (N + 1);
        positions[3 * i + 2] = 2;
    }
    for (i = 0; i < N * N; ++i) {
        uint32_t corner = i / N * (N + 1) + i % N;
        sizes[i] = 4;
        vertices[4 * i] = corner;
        vertices[4 * i + 1] = corner + 1;
        vertices[4 * i + 2] = corner + N + 2;
        vertices[4 * i + 3] = corner + N + 1;
    }
    desc.n_vertices = (N + 1) * (N + 1);
    desc.n_faces = N * N;
    desc.positions = positions;
    desc.face_sizes = sizes;
    desc.face_vertices = vertices;
    desc.boundary = QP_BOUNDARY_EDGE_AND_CORNER;
    options.want_triangles = 1;
    options.want_hash = 1;
    tessellation.factor = 4;
    if (qp_mesh_create(&desc, &mesh, &err) != QP_OK ||
        qp_surface_create(mesh, NULL, &surface, &err) != QP_OK ||
        qp_frame_create(device, surface, &options, &frame, &err) != QP_OK ||
        qp_frame_eval(frame, &tessellation, &stream, &err) != QP_OK) {
        check(0, err.message);
    } else {
        const float *v = stream.vertices;
        uint64_t s, hash = stream.hash;
        check(stream.n_samples == 25 * N * N, "25 samples a patch at factor 4");
        check(stream.n_triangles == 32 * N * N, "32 triangles a patch at factor 4");
        for (s = 0; s < stream.n_samples; ++s, v += 6) {
            double p[3], n[3], at[2];
            p[0] = v[0], p[1] = v[1], p[2] = v[2];
            n[0] = v[3], n[1] = v[4], n[2] = v[5];
            x = stream.sample_patch[s] % N, y = stream.sample_patch[s] / N;
            at[0] = x + stream.uv[2 * s], at[1] = y + stream.uv[2 * s + 1];
            /* Away from the boundary the grid maps to itself; by it, to its own plane and box. */
            if (x > 0 && x < N - 1 && y > 0 && y < N - 1)
                check_point(p, at[0], at[1], 2, 1e-5, "a plane is reproduced");
            check(fabs(p[2] - 2) <= 1e-6 && p[0] >= -1e-6 && p[0] <= N + 1e-6, "the plane is kept");
            check_point(n, 0, 0, 1, 1e-5, "its normal");
            if (stream.sample_patch[s] == 0 && stream.uv[2 * s] == 0 && stream.uv[2 * s + 1] == 0)
                check_point(p, 0, 0, 2, 1e-6, "the sharp corner stays");
        }
        for (s = 0; s < 3 * stream.n_triangles; ++s)
            check(stream.triangles[s] < stream.n_samples, "triangles index samples");
        check(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_OK && stream.hash == hash && hash != 0,
              "a second evaluation gives the same bits");
        tessellation.factor = 65;
        check(qp_frame_eval(frame, &tessellation, &stream, &err) == QP_BAD_INPUT &&
                  strchr(err.message, '\n') == NULL,
              "a factor of 65 is refused");
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    qp_error err;
    qp_device *device = NULL;
    if (qp_device_open("host", &device, &err) != QP_OK) {
        fprintf(stderr, "%s\n", err.message);
        return 1;
    }
    check(strcmp(qp_device_name(device), "host") == 0 && qp_device_has_double(device), "the host has double");
    test_cube(device);
    test_plane(device);
    qp_device_free(device);
    check(qp_device_open("no such device", &device, &err) == QP_SYSTEM && device == NULL,
          "an unknown device is refused");
    qp_frame_free(NULL);
    qp_surface_free(NULL);
    qp_mesh_free(NULL);
    printf("%d checks, %d failed\n", checks, failures);
    return failures != 0;
}
