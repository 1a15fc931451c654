/* Our tessellator against GL's own, for 500 random factor sextuples of each spacing and for the edge cases:
 * the same points and the same triangles, bit for bit; on llvmpipe in the same order as well. */
#include "gl/capture.h"
#include "host/frame/tessellator.h"
#include "tests/check.h"

#include <string.h>

static uint64_t random_state = 20161122;

static uint32_t random_bits(void) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(random_state >> 33);
}
static float random_unit(void) {
    return (float)(random_bits() & 0xffffffu) / 16777216.0f;
}

/* Uniform, integers, just off integers, small ones, out of range. */
static float random_factor(void) {
    float integer = (float)(1 + random_bits() % 64);
    switch (random_bits() % 8) {
    case 0:
        return integer;
    case 1:
        return integer + ldexpf(random_unit() - 0.5f, -(int)(random_bits() % 20));
    case 2:
        return exp2f(6 * random_unit());
    case 3:
        return 1 + 3 * random_unit();
    case 4:
        return random_bits() & 1 ? 64 + 100 * random_unit() : ldexpf(1 + random_unit(), -3);
    default:
        return 1 + 63 * random_unit();
    }
}

static int by_bytes(const void *a, const void *b, size_t n) {
    return memcmp(a, b, n);
}
static int compare_points(const void *a, const void *b) {
    return by_bytes(a, b, 2 * sizeof(float));
}
static int compare_triangles(const void *a, const void *b) {
    return by_bytes(a, b, 6 * sizeof(float));
}

/* Turns a triangle so that its least vertex comes first; its orientation stays. */
static void normalise(float *t) {
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (compare_points(t + 2 * k, t + 2 * least) < 0) least = k;
    float turned[6];
    for (int k = 0; k < 6; k++) turned[k] = t[(k + 2 * least) % 6];
    memcpy(t, turned, sizeof turned);
}

static void sort(float *points, size_t n_points, float *triangles, size_t n_triangles) {
    for (size_t k = 0; k < n_triangles; k++) normalise(triangles + 6 * k);
    qsort(points, n_points, 2 * sizeof(float), compare_points);
    qsort(triangles, n_triangles, 6 * sizeof(float), compare_triangles);
}

static unsigned long patches, points_seen, triangles_seen, in_order;

static void compare_one(qp_gl_capture *capture, qp_tess_grid *grid, qp_spacing spacing, const float *f) {
    qp_error err;
    qp_gl_captured gl;
    if (!CHECK_OK(qp_gl_capture_quad(capture, spacing, f, f + 4, &gl, &err), err)) exit(1);
    if (!CHECK_OK(qp_tessellate(spacing, f, f + 4, grid, &err), err)) exit(1);
    float *triangles = malloc(((size_t)grid->n_triangles + 1) * 6 * sizeof(float));
    float *points = malloc(((size_t)grid->n_points + 1) * 2 * sizeof(float));
    if (!CHECK(triangles != NULL && points != NULL)) exit(1);
    for (size_t k = 0; k < 3 * (size_t)grid->n_triangles; k++)
        memcpy(triangles + 2 * k, grid->uv + 2 * (size_t)grid->triangles[k], 2 * sizeof(float));
    memcpy(points, grid->uv, 2 * sizeof(float) * grid->n_points);
    bool counts = CHECK(gl.n_points == grid->n_points) && CHECK(gl.n_triangles == grid->n_triangles);
    if (counts) {
        size_t point_bytes = 2 * sizeof(float) * gl.n_points,
               triangle_bytes = 6 * sizeof(float) * gl.n_triangles;
        bool order = memcmp(points, gl.points, point_bytes) == 0 &&
                     memcmp(triangles, gl.triangles, triangle_bytes) == 0;
        sort(points, grid->n_points, triangles, grid->n_triangles);
        sort(gl.points, gl.n_points, gl.triangles, gl.n_triangles);
        CHECK(memcmp(points, gl.points, point_bytes) == 0);
        CHECK(memcmp(triangles, gl.triangles, triangle_bytes) == 0);
        in_order += order;
    } else {
        fprintf(stderr, "    spacing %d, outer %.9g %.9g %.9g %.9g, inner %.9g %.9g: %u/%u points\n", spacing,
                f[0], f[1], f[2], f[3], f[4], f[5], grid->n_points, gl.n_points);
    }
    patches++;
    points_seen += gl.n_points;
    triangles_seen += gl.n_triangles;
    free(points);
    free(triangles);
    qp_gl_captured_free(&gl);
}

static const float edge_cases[][6] = {
    {1, 1, 1, 1, 1, 1},
    {2, 2, 2, 2, 2, 2},
    {3, 3, 3, 3, 3, 3},
    {64, 64, 64, 64, 64, 64},
    {63, 63, 63, 63, 63, 63},
    {1, 1, 1, 1, 64, 64},
    {64, 64, 64, 64, 1, 1},
    {64, 1, 64, 1, 1, 64},
    {1, 1, 1, 1, 1, 2},
    {1, 1, 1, 1, 2, 1},
    {1, 1, 1, 1, 1, 3},
    {1, 1, 1, 1, 3, 1},
    {2, 1, 1, 1, 1, 1},
    {1, 1, 1, 3, 1, 1},
    {5, 5, 5, 5, 4, 7},
    {5, 5, 5, 5, 7, 4},
    {8, 8, 8, 8, 8, 5},
    {8, 8, 8, 8, 5, 8},
    {7, 7, 7, 7, 3, 9},
    {7, 7, 7, 7, 9, 3},
    {1, 1, 1, 1, 1.00000762939453125f, 1}, /* 1 + 2^-17: rounds to 1 in 16.16 */
    {1, 1, 1, 1, 1.0000078678131104f, 1},  /* the next float: rounds to 1 + 2^-16 */
    {1.0000152587890625f, 1, 1, 1, 1, 1},
    {1, 1, 1, 1, 0, 0},
    {3, 3, 3, 3, -5, 0},
    {3, 3, 3, 3, NAN, NAN},
    {3, 3, 3, 3, INFINITY, 2},
    {INFINITY, 2, 2, 2, 2, 2},
    {1e-30f, 1e30f, 2, 2, 2, 2},
    {0, 4, 4, 4, 4, 4},
    {4, -1, 4, 4, 4, 4},
    {4, 4, NAN, 4, 4, 4},
    {4, 4, 4, -0.0f, 4, 4},
    {2.5f, 3.5f, 4.5f, 5.5f, 6.5f, 7.5f},
};

int main(void) {
    qp_error err;
    qp_gl *gl;
    if (!CHECK_OK(qp_gl_open(&gl, &err), err)) return check_report();
    printf("GL: %s\n", gl->backend);
    qp_gl_capture capture;
    if (!CHECK_OK(qp_gl_capture_open(gl, &capture, &err), err)) return check_report();
    qp_tess_grid grid = {0};
    for (int spacing = QP_EQUAL; spacing <= QP_FRACTIONAL_ODD; spacing++) {
        for (size_t k = 0; k < sizeof edge_cases / sizeof edge_cases[0]; k++)
            compare_one(&capture, &grid, (qp_spacing)spacing, edge_cases[k]);
        for (int k = 1; k <= 64; k++) {
            float f = (float)k;
            compare_one(&capture, &grid, (qp_spacing)spacing, (const float[6]){f, f, f, f, f, f});
        }
        for (int k = 0; k < 500; k++) {
            float f[6];
            for (int j = 0; j < 6; j++) f[j] = random_factor();
            if (k % 10 == 0) f[random_bits() % 6] = 1;
            compare_one(&capture, &grid, (qp_spacing)spacing, f);
        }
    }
    printf("%lu patches, %lu points, %lu triangles; in the same order: %lu patches\n", patches, points_seen,
           triangles_seen, in_order);
    if (strstr(gl->backend, "llvmpipe") != NULL) CHECK(in_order == patches);
    qp_tess_grid_free(&grid);
    qp_gl_capture_close(&capture);
    qp_gl_close(gl);
    return check_report();
}
