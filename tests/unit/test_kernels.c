/* Kernels on plans made by hand: the C build of the kernels against polynomials and a semi-sharp curve refined by
 * brute force, and OpenCL against the C build bit for bit. */
#include "tests/unit/hand_made.h"

typedef long double wide;

static hand_plan plan;

/* ---- Polynomials: value by powers, control points by blossoms ---- */

/* Blossom of x^power at (a, b, c). */
static wide blossom(int power, wide a, wide b, wide c) {
    if (power == 0) return 1;
    if (power == 1) return (a + b + c) / 3;
    return power == 2 ? (a * b + b * c + c * a) / 3 : a * b * c;
}

/* The control point about (x, y) of the uniform bicubic grid with spacing step, minus the value at `corner` where
 * that is given. */
static uint32_t control_point(wide x, wide y, wide step, const wide corner[2]) {
    double *row;
    uint32_t index = hand_point(&plan, &row);
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
            wide w = blossom(i, x - step, x, x + step) * blossom(j, y - step, y, y + step);
            if (corner != NULL) w -= powl(corner[0], i) * powl(corner[1], j);
            row[1 + 4 * j + i] = (double)w;
        }
    }
    return index;
}

/* A point of the surface itself. */
static uint32_t value_point(wide x, wide y, int du, int dv) {
    double *row;
    uint32_t index = hand_point(&plan, &row);
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i) {
            wide fu = du ? (i == 0 ? 0 : i * powl(x, i - 1)) : powl(x, i);
            wide fv = dv ? (j == 0 ? 0 : j * powl(y, j - 1)) : powl(y, j);
            row[1 + 4 * j + i] = (double)(fu * fv);
        }
    }
    return index;
}

/* A regular leaf over [x, x + size] x [y, y + size]. */
static void regular_leaf(wide x, wide y, wide size, int with_origin) {
    uint32_t indices[16], origin = QP_NO_POINT;
    wide corner[2] = {x, y};
    if (with_origin) origin = value_point(x, y, 0, 0);
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 4; ++i)
            indices[4 * j + i] =
                control_point(x + (i - 1) * size, y + (j - 1) * size, size, with_origin ? corner : NULL);
    }
    hand_word(&plan, QP_NODE_REGULAR);
    hand_word(&plan, origin);
    hand_indices(&plan, indices, 16);
}

/* Where the patch-frame point (u,v) of a node turned by r lies when its node-local rotated point is (a, b). */
static void unrotate(uint32_t r, wide a, wide b, wide *u, wide *v) {
    /* plan (u,v) of patch (u,v): r=1: (v,1-u), r=2: (1-u,1-v), r=3: (1-v,u); these are the inverses. */
    *u = r == 0 ? a : r == 1 ? 1 - b : r == 2 ? 1 - a : b;
    *v = r == 0 ? b : r == 1 ? a : r == 2 ? 1 - b : 1 - a;
}

static uint32_t tail_word;

/* A terminal over [x, x + size]^2 with its corner where rotation r puts it, and an extraordinary leaf below. The
 * first `absolute` rings are not relative to the corner. */
static void terminal(wide x, wide y, wide size, uint32_t r, uint32_t rings, uint32_t absolute) {
    wide u, v;
    unrotate(r, 0, 0, &u, &v);
    wide corner[2] = {x + size * u, y + size * v};
    uint32_t origin = value_point(corner[0], corner[1], 0, 0);
    uint32_t du = value_point(corner[0], corner[1], 1, 0), dv = value_point(corner[0], corner[1], 0, 1);
    hand_word(&plan, QP_NODE_TERMINAL | r << 3 | rings << 8 | absolute << 16);
    hand_word(&plan, origin);
    uint32_t next = plan.plan.tree_words;
    hand_word(&plan, 0);
    for (uint32_t k = 0; k < rings; ++k) {
        uint32_t indices[24], n = 0;
        wide step = ldexpl(1, -(int)k - 1);
        for (int j = 0; j < 5; ++j) {
            for (int i = j == 0; i < 5; ++i) {
                unrotate(r, (i - 1) * step, (j - 1) * step, &u, &v);
                indices[n++] =
                    control_point(x + size * u, y + size * v, size * step, k < absolute ? NULL : corner);
                plan.scales[indices[n - 1]] = k < absolute ? 0 : (uint8_t)k;
            }
        }
        hand_indices(&plan, indices, 24);
    }
    plan.tree[next] = plan.plan.tree_words;
    hand_word(&plan, QP_NODE_EXTRAORDINARY | r << 3);
    hand_word(&plan, origin);
    hand_word(&plan, du);
    hand_word(&plan, dv);
    hand_word(&plan, 0); /* offset of the ratio, once all points are known */
    tail_word = plan.plan.tree_words - 1;
    hand_word(&plan, QP_NO_POINT); /* no mode */
    plan.constants[plan.plan.constant_count++] = 0.5;
}

static void irregular(wide x, wide y, wide size) {
    const wide at[4][2] = {{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}};
    uint32_t indices[12];
    for (int c = 0; c < 4; ++c) {
        for (int k = 0; k < 3; ++k) indices[3 * c + k] = value_point(at[c][0], at[c][1], k == 1, k == 2);
    }
    /* The last corner has no tangent plane. */
    indices[10] = indices[11] = QP_NO_POINT;
    hand_word(&plan, QP_NODE_IRREGULAR);
    hand_indices(&plan, indices, 12);
}

/* The polynomial at the plan's (u,v). */
static void polynomial(wide u, wide v, wide p[3], wide n[3]) {
    wide du[3] = {0}, dv[3] = {0}, length = 0;
    for (int c = 0; c < 3; ++c) {
        p[c] = 0;
        for (int j = 0; j < 4; ++j) {
            for (int i = 0; i < 4; ++i) {
                wide a = plan.positions[3 * (1 + 4 * j + i) + c];
                p[c] += a * powl(u, i) * powl(v, j);
                if (i > 0) du[c] += a * i * powl(u, i - 1) * powl(v, j);
                if (j > 0) dv[c] += a * j * powl(u, i) * powl(v, j - 1);
            }
        }
    }
    for (int c = 0; c < 3; ++c) {
        n[c] = du[(c + 1) % 3] * dv[(c + 2) % 3] - du[(c + 2) % 3] * dv[(c + 1) % 3];
        length += n[c] * n[c];
    }
    for (int c = 0; c < 3; ++c) n[c] /= sqrtl(length);
}

enum { SAMPLES = 4000 };
static uint32_t patches[SAMPLES];
static double uvs[2 * SAMPLES];

static void scatter(void) {
    for (int i = 0; i < SAMPLES; ++i) {
        patches[i] = (uint32_t)((hand_random() + 1) * 2) % 4;
        uvs[2 * i] = (double)hand_coordinate();
        uvs[2 * i + 1] = (double)hand_coordinate();
    }
}

/* Plan (u,v) of sample i. */
static void plan_uv(int i, wide *u, wide *v) {
    wide a = uvs[2 * i], b = uvs[2 * i + 1];
    uint32_t r = plan.rotation[patches[i]];
    *u = r == 0 ? a : r == 1 ? b : r == 2 ? 1 - a : 1 - b;
    *v = r == 0 ? b : r == 1 ? 1 - a : r == 2 ? 1 - b : a;
}

static void compare_with_polynomial(const qp_stream *s, double position, double normal) {
    for (int i = 0; i < SAMPLES; ++i) {
        wide u, v, p[3], n[3];
        if ((s->flags[i] & QP_SAMPLE_PAST_DEPTH) != 0) continue;
        plan_uv(i, &u, &v);
        polynomial(u, v, p, n);
        for (int c = 0; c < 3; ++c) {
            CHECK_NEAR(hand_value(s, (uint64_t)i, c), (double)p[c], position);
            if ((s->flags[i] & QP_SAMPLE_NO_NORMAL) == 0)
                CHECK_NEAR(hand_value(s, (uint64_t)i, 3 + c), (double)n[c], normal);
        }
    }
}

/* The same plan on the host (both precisions, against the polynomial where asked) and on OpenCL. */
static void run_both(qp_device *host, qp_device *opencl, int is_polynomial) {
    for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
        qp_frame *a = NULL, *b = NULL;
        qp_stream on_host, on_device;
        if (!hand_eval(host, &plan, (qp_precision)precision, 0, SAMPLES, patches, uvs, &a, &on_host)) return;
        if (is_polynomial)
            compare_with_polynomial(&on_host, precision == QP_DOUBLE ? 1e-13 : 1e-5,
                                    precision == QP_DOUBLE ? 1e-11 : 5e-3);
        if (opencl != NULL && (precision == QP_FLOAT || qp_device_has_double(opencl)) &&
            hand_eval(opencl, &plan, (qp_precision)precision, 0, SAMPLES, patches, uvs, &b, &on_device))
            CHECK(hand_same_bits(&on_host, &on_device));
        qp_frame_free(a);
        qp_frame_free(b);
    }
}

/* Ends the hand-made plan as the regular one: 16 identity rows, one regular node. */
static void end_regular(void) {
    uint32_t indices[16];
    for (uint32_t i = 0; i < 16; ++i) {
        double *row;
        indices[i] = hand_point(&plan, &row);
        row[i] = 1;
    }
    hand_word(&plan, QP_NODE_REGULAR);
    hand_word(&plan, QP_NO_POINT);
    hand_indices(&plan, indices, 16);
    hand_end(&plan, QP_PLAN_REGULAR);
    plan.surface.regular_plan = 0;
}

/* Regular plan: fast pass and general kernels give the same bits, and the uniform B-spline. */
static void test_regular(qp_device *host, qp_device *opencl) {
    hand_begin(&plan, 16);
    for (uint32_t i = 0; i < 3; ++i) plan.positions[i] = hand_random(); /* an origin that is not zero */
    end_regular();
    scatter();
    run_both(host, opencl, 0);
    for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
        qp_frame *a = NULL, *b = NULL;
        qp_stream fast, general;
        if (!hand_eval(host, &plan, (qp_precision)precision, 0, SAMPLES, patches, uvs, &a, &fast)) return;
        if (!hand_eval(host, &plan, (qp_precision)precision, 1, SAMPLES, patches, uvs, &b, &general)) return;
        CHECK(hand_same_bits(&fast, &general));
        for (int i = 0; i < SAMPLES; ++i) {
            /* Cox and de Boor's recursion for the basis functions over knots 0..7, at u + 3. */
            wide u, v, weight[2][4], p[3] = {0};
            plan_uv(i, &u, &v);
            for (int d = 0; d < 2; ++d) {
                wide t = (d == 0 ? u : v) + 3, n[7];
                for (int k = 0; k < 7; ++k) n[k] = k == 3;
                for (int degree = 1; degree <= 3; ++degree) {
                    for (int k = 0; k + degree < 7; ++k)
                        n[k] = (t - k) / degree * n[k] + (k + degree + 1 - t) / degree * n[k + 1];
                }
                memcpy(weight[d], n, sizeof weight[d]);
            }
            for (int k = 0; k < 16; ++k) {
                for (int c = 0; c < 3; ++c)
                    p[c] += weight[0][k % 4] * weight[1][k / 4] *
                            (precision == QP_FLOAT ? (float)plan.positions[3 * k + c]
                                                   : plan.positions[3 * k + c]);
            }
            for (int c = 0; c < 3; ++c)
                CHECK_NEAR(hand_value(&fast, (uint64_t)i, c), (double)p[c],
                           precision == QP_FLOAT ? 1e-6 : 1e-14);
        }
        qp_frame_free(a);
        qp_frame_free(b);
    }
}

/* An internal root over a regular leaf with an origin, one without, a terminal and an irregular leaf. */
static void test_tree(qp_device *host, qp_device *opencl, uint32_t rotation) {
    hand_begin(&plan, 17);
    hand_word(&plan, QP_NODE_INTERNAL);
    for (int c = 0; c < 4; ++c) hand_word(&plan, 0);
    plan.tree[1] = plan.plan.tree_words;
    regular_leaf(0, 0, 0.5L, 1);
    plan.tree[2] = plan.plan.tree_words;
    regular_leaf(0.5L, 0, 0.5L, 0);
    plan.tree[3] = plan.plan.tree_words;
    terminal(0, 0.5L, 0.5L, rotation, 5, rotation);
    plan.tree[4] = plan.plan.tree_words;
    irregular(0.5L, 0.5L, 0.5L);
    plan.tree[tail_word] = plan.plan.point_count * plan.plan.ring_size;
    hand_end(&plan, QP_PLAN_INTERNAL | QP_PLAN_TERMINAL | QP_PLAN_CORNERS);
    scatter();
    /* The corners of the irregular leaf, in plan coordinates through patch 0, and the terminal's. */
    const float at[8][2] = {{0.5f, 0.5f}, {1, 0.5f}, {1, 1},         {0.5f, 1},
                            {0, 0.5f},    {0, 1},    {0.25f, 0.75f}, {0, 0}};
    for (int i = 0; i < 8; ++i) {
        patches[i] = 0;
        uvs[2 * i] = (double)at[i][0];
        uvs[2 * i + 1] = (double)at[i][1];
    }
    run_both(host, opencl, 1);
    qp_frame *frame = NULL;
    qp_stream s;
    if (!hand_eval(host, &plan, QP_DOUBLE, 0, SAMPLES, patches, uvs, &frame, &s)) return;
    for (int i = 0; i < 8; ++i) {
        CHECK((s.flags[i] & QP_SAMPLE_PAST_DEPTH) == 0);
        CHECK((s.flags[i] & QP_SAMPLE_NO_NORMAL) == (i == 3 ? QP_SAMPLE_NO_NORMAL : 0));
    }
    unsigned past = 0;
    for (int i = 0; i < SAMPLES; ++i) {
        wide u, v, p[3], n[3];
        if ((s.flags[i] & QP_SAMPLE_PAST_DEPTH) == 0) continue;
        plan_uv(i, &u, &v);
        ++past;
        /* Past the last level: inside the irregular leaf, where bilinear; near the terminal's corner, close. */
        if (u >= 0.5L && v >= 0.5L) continue;
        polynomial(u, v, p, n);
        for (int c = 0; c < 3; ++c) CHECK_NEAR(hand_value(&s, (uint64_t)i, c), (double)p[c], 0.02);
    }
    CHECK(past > 0);
    qp_frame_free(frame);
}

/* Where an internal node's tie bits send u = 1/2 or v = 1/2: leaves that are constant, each at its own point. */
static void test_ties(qp_device *host, qp_device *opencl) {
    for (uint32_t ties = 0; ties < 4; ++ties) {
        hand_begin(&plan, 5);
        hand_word(&plan, QP_NODE_INTERNAL | ties << 5);
        for (int c = 0; c < 4; ++c) hand_word(&plan, 0);
        for (uint32_t c = 0; c < 4; ++c) {
            double *row;
            uint32_t indices[16], point = hand_point(&plan, &row);
            row[1 + c] = 1;
            for (int i = 0; i < 16; ++i) indices[i] = point;
            plan.tree[1 + c] = plan.plan.tree_words;
            hand_word(&plan, QP_NODE_REGULAR);
            hand_word(&plan, QP_NO_POINT);
            hand_indices(&plan, indices, 16);
        }
        hand_end(&plan, QP_PLAN_INTERNAL);
        scatter();
        const float at[5][2] = {{0.5f, 0.25f}, {0.5f, 0.75f}, {0.25f, 0.5f}, {0.75f, 0.5f}, {0.5f, 0.5f}};
        for (int i = 0; i < 5; ++i) {
            patches[i] = 0;
            uvs[2 * i] = (double)at[i][0];
            uvs[2 * i + 1] = (double)at[i][1];
        }
        run_both(host, opencl, 0);
        qp_frame *frame = NULL;
        qp_stream s;
        if (!hand_eval(host, &plan, QP_DOUBLE, 0, SAMPLES, patches, uvs, &frame, &s)) return;
        for (int i = 0; i < 5; ++i) {
            int cu = at[i][0] > 0.5f || (at[i][0] == 0.5f && (ties & 1) == 0);
            int cv = at[i][1] > 0.5f || (at[i][1] == 0.5f && (ties & 2) == 0);
            for (int c = 0; c < 3; ++c)
                CHECK_NEAR(hand_value(&s, (uint64_t)i, c), plan.positions[3 * (1 + cu + 2 * cv) + c], 1e-15);
            CHECK(s.flags[i] == QP_SAMPLE_NO_NORMAL);
        }
        qp_frame_free(frame);
    }
}

/* ---- A semi-sharp crease, by refinement ---- */

/* Limit of the curve with vertices p at -1, 0, 1, 2 and sharpness s at vertex 0, at v in [0, 1]. While the segment
 * of v still ends at the crease vertex and that one is sharp, refine; a segment away from it, or a smooth one, is a
 * spline. */
static wide curve(const wide p[4], wide s, wide v) {
    wide q[4] = {p[0], p[1], p[2], p[3]};
    int at_crease = 1;
    while (s > 0 && at_crease) {
        const wide keep = s >= 1 ? 1 : s;
        /* Refined vertices at -1/2, 0, 1/2, 1, 3/2 of the segment. */
        const wide r[5] = {(q[0] + q[1]) / 2, keep * q[1] + (1 - keep) * (q[0] + 6 * q[1] + q[2]) / 8,
                           (q[1] + q[2]) / 2, (q[1] + 6 * q[2] + q[3]) / 8, (q[2] + q[3]) / 2};
        const int half = v >= 0.5L;
        v = 2 * v - half;
        memcpy(q, r + half, sizeof q);
        at_crease = !half;
        s -= 1;
    }
    const wide t = 1 - v;
    return (t * t * t * q[0] + (3 * v * v * v - 6 * v * v + 4) * q[1] +
            (3 * t * t * t - 6 * t * t + 4) * q[2] + v * v * v * q[3]) /
           6;
}

/* The uniform cubic basis at t. */
static void cubic(wide t, wide b[4]) {
    const wide s = 1 - t;
    b[0] = s * s * s / 6;
    b[1] = (3 * t * t * t - 6 * t * t + 4) / 6;
    b[2] = (3 * s * s * s - 6 * s * s + 4) / 6;
    b[3] = t * t * t / 6;
}

/* M of a zone by interpolation: sum_i B_i(v scale) M[i][j] = the curve of unit vertex j at four v of the zone. */
static void zone_matrix(wide sharpness, wide low, wide high, wide scale, double m[16]) {
    wide a[4][8];
    for (int k = 0; k < 4; ++k) {
        wide v = low + (high - low) * (k + 0.5L) / 4;
        cubic(v * scale, a[k]);
        for (int j = 0; j < 4; ++j) {
            const wide unit[4] = {j == 0, j == 1, j == 2, j == 3};
            a[k][4 + j] = curve(unit, sharpness, v);
        }
    }
    for (int k = 0; k < 4; ++k) { /* Gauss and Jordan, with pivots */
        int best = k;
        for (int r = k + 1; r < 4; ++r) best = fabsl(a[r][k]) > fabsl(a[best][k]) ? r : best;
        for (int c = 0; c < 8; ++c) {
            wide t = a[k][c];
            a[k][c] = a[best][c];
            a[best][c] = t;
        }
        for (int c = 7; c >= k; --c) a[k][c] /= a[k][k];
        for (int r = 0; r < 4; ++r) {
            for (int c = 7; r != k && c >= k; --c) a[r][c] -= a[r][k] * a[k][c];
        }
    }
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) m[4 * i + j] = (double)a[i][4 + j];
    }
}

static void make_crease(wide sharpness, uint32_t rotation) {
    hand_begin(&plan, 17);
    uint32_t indices[16];
    for (uint32_t i = 0; i < 16; ++i) {
        double *row;
        indices[i] = hand_point(&plan, &row);
        row[1 + i] = 1;
    }
    hand_word(&plan, QP_NODE_CREASE | rotation << 3);
    hand_word(&plan, QP_NO_POINT);
    hand_indices(&plan, indices, 16);
    hand_word(&plan, plan.plan.point_count * plan.plan.ring_size);
    const wide whole = floorl(sharpness), fraction = sharpness - whole;
    const wide v0 = ldexpl(1, -(int)whole), v1 = fraction > 0 ? v0 / 2 : v0;
    double *c = plan.constants;
    c[0] = (double)v0;
    c[1] = (double)v1;
    c[2] = 1;
    c[3] = (double)(1 / v0);
    c[4] = (double)(1 / v1);
    /* Zone 0 is out of reach of the crease's end: as if it were sharp for ever. Zone 1 may be empty. */
    zone_matrix(64, 0.25L, 1, 1, c + 5);
    if (v1 < v0) zone_matrix(sharpness, v1, v0, 1 / v0, c + 21);
    zone_matrix(sharpness, 0, v1, 1 / v1, c + 37);
    plan.plan.constant_count = QP_CREASE_REALS;
    hand_end(&plan, QP_PLAN_CREASE);
}

static void crease_point(wide sharpness, wide u, wide v, wide p[3]) {
    wide b[4];
    cubic(u, b);
    for (int c = 0; c < 3; ++c) {
        wide rows[4];
        for (int j = 0; j < 4; ++j) {
            rows[j] = 0;
            for (int i = 0; i < 4; ++i) rows[j] += b[i] * plan.positions[3 * (1 + 4 * j + i) + c];
        }
        p[c] = curve(rows, sharpness, v);
    }
}

static void test_crease(qp_device *host, qp_device *opencl, wide sharpness, uint32_t rotation) {
    make_crease(sharpness, rotation);
    scatter();
    run_both(host, opencl, 0);
    for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
        qp_frame *frame = NULL;
        qp_stream s;
        if (!hand_eval(host, &plan, (qp_precision)precision, 0, SAMPLES, patches, uvs, &frame, &s)) return;
        for (int i = 0; i < SAMPLES; ++i) {
            wide pu, pv, u, v, p[3], du[3], dv[3], next[3], before[3], n[3], length = 0;
            plan_uv(i, &pu, &pv);
            /* Into the node's frame; rotations keep du x dv. */
            u = rotation == 0 ? pu : rotation == 1 ? pv : rotation == 2 ? 1 - pu : 1 - pv;
            v = rotation == 0 ? pv : rotation == 1 ? 1 - pu : rotation == 2 ? 1 - pv : pu;
            crease_point(sharpness, u, v, p);
            for (int c = 0; c < 3; ++c)
                CHECK_NEAR(hand_value(&s, (uint64_t)i, c), (double)p[c],
                           precision == QP_FLOAT ? 2e-6 : 1e-13);
            /* Normals by central differences, where they are well-conditioned and v + h is in the same zone. */
            const wide h = 1e-5L;
            if (precision == QP_FLOAT || v < 4 * h || v > 1 - 4 * h) continue;
            crease_point(sharpness, u + h, v, next);
            crease_point(sharpness, u - h, v, before);
            for (int c = 0; c < 3; ++c) du[c] = (next[c] - before[c]) / (2 * h);
            crease_point(sharpness, u, v + h, next);
            crease_point(sharpness, u, v - h, before);
            for (int c = 0; c < 3; ++c) dv[c] = (next[c] - before[c]) / (2 * h);
            for (int c = 0; c < 3; ++c) {
                n[c] = du[(c + 1) % 3] * dv[(c + 2) % 3] - du[(c + 2) % 3] * dv[(c + 1) % 3];
                length += n[c] * n[c];
            }
            if (sqrtl(length) < 0.05L) continue;
            for (int c = 0; c < 3; ++c)
                CHECK_NEAR(hand_value(&s, (uint64_t)i, 3 + c), (double)(n[c] / sqrtl(length)), 0.02);
        }
        qp_frame_free(frame);
    }
}

/* A ring of several chunks and rows of many points: against sums in long double, and the same bits on OpenCL. */
static void test_long_ring(qp_device *host, qp_device *opencl) {
    const uint32_t size = HAND_RING;
    hand_begin(&plan, size);
    uint32_t points[40];
    for (int k = 0; k < 40; ++k) {
        double *row;
        points[k] = hand_point(&plan, &row);
        for (uint32_t j = 0; j < size; ++j) row[j] = (double)(float)hand_random() / 16;
    }
    hand_word(&plan, QP_NODE_REGULAR);
    hand_word(&plan, points[39]);
    hand_indices(&plan, points + 5, 16);
    hand_end(&plan, 0);
    scatter();
    run_both(host, opencl, 0);
    wide values[40][3] = {{0}};
    for (int k = 0; k < 40; ++k) {
        for (uint32_t j = 0; j < size; ++j) {
            for (int c = 0; c < 3; ++c)
                values[k][c] += (wide)plan.weights[k * size + j] * plan.positions[3 * j + c];
        }
    }
    qp_frame *frame = NULL;
    qp_stream s;
    if (!hand_eval(host, &plan, QP_DOUBLE, 0, SAMPLES, patches, uvs, &frame, &s)) return;
    for (int i = 0; i < SAMPLES; ++i) {
        wide u, v, bu[4], bv[4];
        plan_uv(i, &u, &v);
        cubic(u, bu);
        cubic(v, bv);
        for (int c = 0; c < 3; ++c) {
            wide p = values[39][c];
            for (int k = 0; k < 16; ++k) p += bu[k % 4] * bv[k / 4] * values[5 + k][c];
            CHECK_NEAR(hand_value(&s, (uint64_t)i, c), (double)p, 1e-13);
        }
    }
    qp_frame_free(frame);
}

/* Normals of a patch whose derivatives would overflow or vanish when squared, and of one without any. */
static void test_scales(qp_device *host, qp_device *opencl) {
    const double scales[] = {1e-30, 1e-18, 1, 1e12, 1e30, 0};
    for (int k = 0; k < 6; ++k) {
        hand_begin(&plan, 16);
        for (int i = 0; i < 16; ++i) {
            plan.positions[3 * i] = scales[k] * (i % 4);
            plan.positions[3 * i + 1] = scales[k] * (i / 4);
            plan.positions[3 * i + 2] = 0;
        }
        end_regular();
        scatter();
        for (int slow = 0; slow < 2; ++slow) {
            qp_frame *frame = NULL;
            qp_stream s;
            if (!hand_eval(host, &plan, QP_FLOAT, slow, SAMPLES, patches, uvs, &frame, &s)) return;
            for (int i = 0; i < SAMPLES; ++i) {
                CHECK_NEAR(hand_value(&s, (uint64_t)i, 5), 1, 1e-6); /* z stands in for no normal */
                CHECK(s.flags[i] == (scales[k] != 0 ? 0 : QP_SAMPLE_NO_NORMAL));
            }
            qp_frame_free(frame);
        }
        run_both(host, opencl, 0);
    }
}

int main(void) {
    qp_error err;
    qp_device *host = NULL, *opencl = NULL;
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    if (qp_device_open(NULL, &opencl, &err) != QP_OK) printf("without OpenCL: %s\n", err.message);
    test_regular(host, opencl);
    for (uint32_t r = 0; r < 4; ++r) test_tree(host, opencl, r);
    test_ties(host, opencl);
    const wide sharpness[] = {0.3L, 1, 1.5L, 2, 3.7L, 6};
    for (uint32_t k = 0; k < 6; ++k) test_crease(host, opencl, sharpness[k], k % 4);
    test_long_ring(host, opencl);
    test_scales(host, opencl);
    qp_device_free(host);
    qp_device_free(opencl);
    return check_report();
}
