/* The second derivatives of a Bezier patch are Bezier patches themselves, and stay in the convex hull of their control points: at the
 * points (X, Y, Z) = (S_uu, S_uv, S_vv), all raised to degree (3,3), whatever is convex in X, Y, Z is largest. Of the two bounds here,
 *   |X du^2 + 2 Y du dv + Z dv^2| <= (|X| + r |Y|) du^2 + (|Z| + |Y| / r) dv^2,
 * and, with du^2 = c^2 / r, dv^2 = r s^2 for an angle's cosine c and sine s,
 *   |X c^2 / r + 2 Y c s + Z s^2 r| = |m + p cos + q sin| of twice the angle <= |m| + largest singular value of (p, q),
 *   m = (X / r + Z r) / 2, p = (X / r - Z r) / 2, q = Y,
 * the second is half of the first where the surface runs like a complex power, as it does about extraordinary corners; the first is less
 * where one direction bends much more than the other. */
#include "host/frame/bends.h"

#include <math.h>
#include <string.h>

static double larger(double a, double b) { /* fmax() is a call */
    return a > b ? a : b;
}

/* One cubic's B-spline points to its Bezier points; `step` between points, in vectors. */
static void bezier_row(double (*p)[3], int step) {
    for (int x = 0; x < 3; ++x) {
        const double a = p[0][x], b = p[step][x], c = p[2 * step][x], d = p[3 * step][x];
        p[0][x] = (a + 4 * b + c) / 6;
        p[step][x] = (2 * b + c) / 3;
        p[2 * step][x] = (b + 2 * c) / 3;
        p[3 * step][x] = (b + 4 * c + d) / 6;
    }
}

/* Half of a cubic, by de Casteljau's steps. */
static void halve_row(double (*p)[3], int step, int upper) {
    for (int x = 0; x < 3; ++x) {
        const double a = p[0][x], b = p[step][x], c = p[2 * step][x], d = p[3 * step][x];
        const double ab = 0.5 * (a + b), bc = 0.5 * (b + c), cd = 0.5 * (c + d);
        const double abc = 0.5 * (ab + bc), bcd = 0.5 * (bc + cd), middle = 0.5 * (abc + bcd);
        p[0][x] = upper ? middle : a;
        p[step][x] = upper ? bcd : ab;
        p[2 * step][x] = upper ? cd : abc;
        p[3 * step][x] = upper ? d : middle;
    }
}

/* Second derivatives along each line of points, linear, raised to cubic. */
static void second_rows(double (*b)[3], int step, int other, double scale, double (*out)[3]) {
    for (int j = 0; j < 4; ++j) {
        double(*in)[3] = b + j * other, (*to)[3] = out + j * other;
        for (int x = 0; x < 3; ++x) {
            const double first = scale * (in[0][x] - 2 * in[step][x] + in[2 * step][x]);
            const double last = scale * (in[step][x] - 2 * in[2 * step][x] + in[3 * step][x]);
            to[0][x] = first;
            to[step][x] = (2 * first + last) / 3;
            to[2 * step][x] = (first + 2 * last) / 3;
            to[3 * step][x] = last;
        }
    }
}

/* The mixed derivative, biquadratic, raised to bicubic. */
static void mixed(double (*b)[3], double scale, double (*out)[3]) {
    for (int x = 0; x < 3; ++x) {
        double d[4][4];
        for (int j = 0; j < 3; ++j) {
            double e[3];
            for (int i = 0; i < 3; ++i) {
                const int at = 4 * j + i;
                e[i] = scale * (b[at][x] - b[at + 1][x] - b[at + 4][x] + b[at + 5][x]);
            }
            d[j][0] = e[0];
            d[j][1] = (e[0] + 2 * e[1]) / 3;
            d[j][2] = (2 * e[1] + e[2]) / 3;
            d[j][3] = e[2];
        }
        for (int i = 0; i < 4; ++i) {
            out[i][x] = d[0][i];
            out[4 + i][x] = (d[0][i] + 2 * d[1][i]) / 3;
            out[8 + i][x] = (2 * d[1][i] + d[2][i]) / 3;
            out[12 + i][x] = d[2][i];
        }
    }
}

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static qp_bend bezier_bend(double b[16][3], double width_u, double width_v, double r) {
    double uu[16][3], uv[16][3], vv[16][3], most_uu = 0, most_uv = 0, most_vv = 0, most = 0;
    second_rows(b, 1, 4, 6 / (width_u * width_u), uu);
    second_rows(b, 4, 1, 6 / (width_v * width_v), vv);
    mixed(b, 9 / (width_u * width_v), uv);
    for (int k = 0; k < 16; ++k) {
        most_uu = larger(most_uu, dot(uu[k], uu[k]));
        most_uv = larger(most_uv, dot(uv[k], uv[k]));
        most_vv = larger(most_vv, dot(vv[k], vv[k]));
    }
    most_uu = sqrt(most_uu);
    most_uv = sqrt(most_uv);
    most_vv = sqrt(most_vv);
    /* Scaled so that both are alike. */
    const double s = fmin(fmax(sqrt(most_uu) / sqrt(most_vv + 1e-300), r / 32), r * 32);
    for (int k = 0; k < 16; ++k) {
        double m[3], p[3];
        for (int x = 0; x < 3; ++x) {
            m[x] = 0.5 * (uu[k][x] / s + vv[k][x] * s);
            p[x] = 0.5 * (uu[k][x] / s - vv[k][x] * s);
        }
        const double pp = dot(p, p), qq = dot(uv[k], uv[k]), pq = dot(p, uv[k]);
        most =
            larger(most, sqrt(dot(m, m)) + sqrt(0.5 * (pp + qq + sqrt((pp - qq) * (pp - qq) + 4 * pq * pq))));
    }
    const qp_bend first = {most_uu + r * most_uv, most_vv + most_uv / r}, second = {most * s, most / s};
    return first.u / r + first.v * r < second.u / r + second.v * r ? first : second;
}

void qp_spline_bends(double p[16][3], double width_u, double width_v, double r, qp_bend quarters[4]) {
    double whole[16][3], part[16][3];
    memcpy(whole, p, sizeof whole);
    for (int k = 0; k < 4; ++k) bezier_row(whole + 4 * k, 1);
    for (int k = 0; k < 4; ++k) bezier_row(whole + k, 4);
    for (int quarter = 0; quarter < 4; ++quarter) {
        memcpy(part, whole, sizeof part);
        for (int k = 0; k < 4; ++k) halve_row(part + 4 * k, 1, quarter & 1);
        for (int k = 0; k < 4; ++k) halve_row(part + k, 4, quarter >> 1);
        quarters[quarter] = bezier_bend(part, 0.5 * width_u, 0.5 * width_v, r);
    }
}

qp_bend qp_spline_mean_bend(double p[16][3], double width_u, double width_v) {
    double u[3], v[3];
    for (int x = 0; x < 3; ++x) {
        u[x] = 0.25 * (p[4][x] - p[5][x] - p[6][x] + p[7][x] + p[8][x] - p[9][x] - p[10][x] + p[11][x]);
        v[x] = 0.25 * (p[1][x] - p[5][x] - p[9][x] + p[13][x] + p[2][x] - p[6][x] - p[10][x] + p[14][x]);
    }
    return (qp_bend){sqrt(dot(u, u)) / (width_u * width_u), sqrt(dot(v, v)) / (width_v * width_v)};
}
