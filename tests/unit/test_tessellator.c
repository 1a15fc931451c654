/* The tessellator by itself: its triangles tile the square, counter-clockwise; edges depend on their own factor
 * only and mirror; the level of a grid. What GL makes of the same factors: tests/cross/test_tessellator_gl.c. */
#include "host/frame/tessellator.h"
#include "tests/check.h"

static uint32_t state = 1;
static float random_factor(float high) {
    state = state * 1664525u + 1013904223u;
    return 1 + (high - 1) * (float)(state >> 8) / 16777216.0f;
}

static void tiles(qp_spacing spacing, const float *f, qp_tess_grid *g) {
    qp_error err;
    if (!CHECK_OK(qp_tessellate(spacing, f, f + 4, g, &err), err)) return;
    double area = 0;
    bool good = true;
    for (uint32_t t = 0; t < g->n_triangles; t++) {
        const uint32_t *i = g->triangles + 3 * t;
        double x[3], y[3];
        for (int k = 0; k < 3; k++) {
            good = good && i[k] < g->n_points;
            x[k] = g->uv[2 * i[k]], y[k] = g->uv[2 * i[k] + 1];
            good = good && x[k] >= 0 && x[k] <= 1 && y[k] >= 0 && y[k] <= 1;
        }
        double twice = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
        area += twice / 2;
        good = good && twice >= 0;
    }
    CHECK(good);
    CHECK_NEAR(area, 1, 1e-12);
}

/* Points of side u = 0, in rising v. */
static uint32_t left_side(const qp_tess_grid *g, float *v) {
    uint32_t n = 0;
    for (uint32_t k = 0; k < g->n_points && n < 80; k++)
        if (g->uv[2 * k] == 0) v[n++] = g->uv[2 * k + 1];
    for (uint32_t a = 1; a < n; a++)
        for (uint32_t b = a; b > 0 && v[b] < v[b - 1]; b--) {
            float swap = v[b];
            v[b] = v[b - 1], v[b - 1] = swap;
        }
    return n;
}

static void edges_agree(qp_spacing spacing, qp_tess_grid *g) {
    qp_error err;
    float a[80], b[80];
    for (int trial = 0; trial < 50; trial++) {
        float f = random_factor(64);
        float first[6] = {f, random_factor(64), random_factor(64), random_factor(64), 9, 5};
        float second[6] = {f, random_factor(64), random_factor(64), random_factor(64), 4.5f, 31};
        if (!CHECK_OK(qp_tessellate(spacing, first, first + 4, g, &err), err)) return;
        uint32_t n = left_side(g, a);
        if (!CHECK_OK(qp_tessellate(spacing, second, second + 4, g, &err), err)) return;
        bool same = left_side(g, b) == n;
        for (uint32_t k = 0; same && k < n; k++) same = a[k] == b[k] && a[k] == 1 - a[n - 1 - k];
        CHECK(same);
    }
}

int main(void) {
    qp_error err;
    qp_tess_grid g = {0};
    for (int s = 0; s < 3; s++) {
        for (int trial = 0; trial < 100; trial++) {
            float f[6];
            for (int k = 0; k < 6; k++) f[k] = random_factor(trial < 50 ? 64 : 4);
            tiles((qp_spacing)s, f, &g);
        }
        edges_agree((qp_spacing)s, &g);
    }
    for (int n = 1; n <= 64; n++) {
        float f[6] = {(float)n, (float)n, (float)n, (float)n, (float)n, (float)n};
        if (!CHECK_OK(qp_tessellate(QP_EQUAL, f, f + 4, &g, &err), err)) break;
        CHECK(g.n_points == (uint32_t)(n + 1) * (uint32_t)(n + 1) && g.n_triangles == (uint32_t)(2 * n * n));
        uint32_t level = 0;
        while (1 << level < n) level++;
        CHECK(qp_tess_grid_level(&g) == level);
    }
    const float none[6] = {4, 0, 4, 4, 4, 4};
    CHECK_OK(qp_tessellate(QP_EQUAL, none, none + 4, &g, &err), err);
    CHECK(g.n_points == 0 && g.n_triangles == 0 && qp_tess_grid_level(&g) == 0);
    qp_tess_grid_free(&g);
    return check_report();
}
