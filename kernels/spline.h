/* The uniform bicubic B-spline, and normals: what every leaf of a plan ends in. Included once a precision in
 * C. */

/* Cubic B-spline basis at t in [0,1], and its derivative. */
QP_FUNCTION void QP_NAME(basis)(real t, real b[4], real d[4]) {
    real s = QP_R(1.0) - t;
    real t2 = t * t, s2 = s * s;
    b[0] = s2 * s * QP_R(0.16666666666666666667);
    b[1] = fma(t2, fma(QP_R(0.5), t, QP_R(-1.0)), QP_R(0.66666666666666666667));
    b[2] = fma(s2, fma(QP_R(0.5), s, QP_R(-1.0)), QP_R(0.66666666666666666667));
    b[3] = t2 * t * QP_R(0.16666666666666666667);
    d[0] = s2 * QP_R(-0.5);
    d[1] = t * fma(QP_R(1.5), t, QP_R(-2.0));
    d[2] = s * fma(QP_R(-1.5), s, QP_R(2.0));
    d[3] = t2 * QP_R(0.5);
}

/* The derivatives of order `order` (0 or 1) of the basis, and the next. */
QP_FUNCTION void QP_NAME(basis_of_order)(uint order, real t, real b[4], real d[4]) {
    if (order == 0) {
        QP_NAME(basis)(t, b, d);
        return;
    }
    real unused[4];
    QP_NAME(basis)(t, unused, b);
    d[0] = QP_R(1.0) - t;
    d[1] = fma(QP_R(3.0), t, QP_R(-2.0));
    d[2] = fma(QP_R(-3.0), t, QP_R(1.0));
    d[3] = t;
}

/* basis() for lanes: the same operations in the same order. */
QP_FUNCTION void QP_NAME(basis_lanes)(lanes t, lanes b[4], lanes d[4]) {
    lanes s = sub_lanes(splat(QP_R(1.0)), t);
    lanes t2 = mul_lanes(t, t), s2 = mul_lanes(s, s);
    lanes sixth = splat(QP_R(0.16666666666666666667)), most = splat(QP_R(0.66666666666666666667));
    lanes one_half = splat(QP_R(0.5)), minus_one = splat(QP_R(-1.0));
    b[0] = mul_lanes(mul_lanes(s2, s), sixth);
    b[1] = fma_lanes(t2, fma_lanes(one_half, t, minus_one), most);
    b[2] = fma_lanes(s2, fma_lanes(one_half, s, minus_one), most);
    b[3] = mul_lanes(mul_lanes(t2, t), sixth);
    d[0] = mul_lanes(s2, splat(QP_R(-0.5)));
    d[1] = mul_lanes(t, fma_lanes(splat(QP_R(1.5)), t, splat(QP_R(-2.0))));
    d[2] = mul_lanes(s, fma_lanes(splat(QP_R(-1.5)), s, splat(QP_R(2.0))));
    d[3] = mul_lanes(t2, one_half);
}

/* Position and derivatives in one leaf, relative to the patch origin; derivatives in the leaf's own frame and
 * scale, which is all that a normal needs. */
typedef struct QP_NAME(surface_point) {
    real4 p, du, dv;
    real
        size; /* of the numbers that p, du and dv were made from, which tells their rounding; < 0: the patch's */
    real skew_u,
        skew_v; /* du and dv are without skew_u dv and skew_v du: same cross product (one of the two is 0) */
    uint flags;
    int level; /* the leaf is 2^-level of the patch, or would be, were its points not stored times a power of two */
    real stretch; /* factor left out of du and dv, which are to be multiplied by it */
    uint turn;    /* rotation of the leaf's (u,v) against the patch's, mod 4 */
} QP_NAME(surface_point);

/* Adds row j of a 4x4 grid of points: bu, du weigh the row's points; bv, dv the row. Rows first, then across:
 * every path through the kernels keeps this order, so that all give the same bits. */
QP_FUNCTION void QP_NAME(add_row)(QP_NAME(surface_point) * s, int first, real4 p0, real4 p1, real4 p2,
                                  real4 p3, const real bu[4], const real du[4], real bv, real dv) {
    real4 along = fma4(p3, bu[3], fma4(p2, bu[2], fma4(p1, bu[1], scale4(p0, bu[0]))));
    real4 slope = fma4(p3, du[3], fma4(p2, du[2], fma4(p1, du[1], scale4(p0, du[0]))));
    if (first) {
        s->p = scale4(along, bv);
        s->du = scale4(slope, bv);
        s->dv = scale4(along, dv);
    } else {
        s->p = fma4(along, bv, s->p);
        s->du = fma4(slope, bv, s->du);
        s->dv = fma4(along, dv, s->dv);
    }
}

/* Coordinates, as frame_layout.h holds them. 1 - x: */
QP_FUNCTION real QP_NAME(mirrored)(real x) {
    return x == QP_R(0.5) ? x : -x;
}
/* Is x >= 1/2, or (upper_middle 0) x > 1/2? */
QP_FUNCTION uint QP_NAME(is_upper)(real x, uint upper_middle) {
    return signbit(x) != 0 || (upper_middle != 0 && x == QP_R(0.5));
}
/* 2x - upper: the place in that half of [0,1]. */
QP_FUNCTION real QP_NAME(in_half)(real x, uint upper) {
    const real t = QP_R(2.0) * fabs(x);
    const real lower = t <= QP_R(0.5) ? t : -(QP_R(1.0) - t);
    return upper != 0 ? QP_NAME(mirrored)(lower) : lower;
}
/* As a number in [0,1]; rounds numbers close to 1. */
QP_FUNCTION real QP_NAME(plain)(real x) {
    return signbit(x) != 0 ? QP_R(1.0) + x : x;
}

/* a b - c d to within an ulp or so, exactly 0 for equal products (Kahan). */
QP_FUNCTION real QP_NAME(difference_of_products)(real a, real b, real c, real d) {
    real cd = c * d;
    real rest = fma(-c, d, cd);
    return fma(a, b, -cd) + rest;
}
QP_FUNCTION real4 QP_NAME(cross_product)(real4 a, real4 b) {
    return make4(QP_NAME(difference_of_products)(a.y, b.z, a.z, b.y),
                 QP_NAME(difference_of_products)(a.z, b.x, a.x, b.z),
                 QP_NAME(difference_of_products)(a.x, b.y, a.y, b.x));
}

/* Largest component, and squared length. */
QP_FUNCTION real QP_NAME(largest)(real4 a) {
    const real x = fabs(a.x), y = fabs(a.y), z = fabs(a.z), most = x > y ? x : y;
    return most > z ? most : z;
}
QP_FUNCTION real QP_NAME(square_length)(real4 a) {
    return fma(a.z, a.z, fma(a.y, a.y, a.x * a.x));
}

/* Divides a vector by the power of two of its largest component (exact), so that products of its components
 * neither overflow nor vanish; *power is the exponent of what it was multiplied by. False when it is zero or not finite. */
QP_FUNCTION int QP_NAME(rescale)(real4 *a, int *power) {
    const real most = QP_NAME(largest)(*a);
    /* The sum catches a NaN that the comparisons passed over. */
    if (!(most > QP_R(0.0)) || !(fabs(a->x) + fabs(a->y) + fabs(a->z) < (real)INFINITY)) return 0;
    *power = -ilogb(most);
    *a = make4(ldexp(a->x, *power), ldexp(a->y, *power), ldexp(a->z, *power));
    return 1;
}

QP_FUNCTION real4 QP_NAME(unit)(real4 n) {
    return scale4(n, qp_div(QP_R(1.0), qp_sqrt(QP_NAME(square_length)(n))));
}

/* Unit vector along du x dv. Zero and QP_FLAG_NO_NORMAL where it is lost in rounding: du and dv are off by some QP_EPSILON * size,
 * so that du x dv is off by about QP_EPSILON * size * (|du| + |dv|), and one no longer than sixteen times that may point anywhere.
 */
QP_FUNCTION real4 QP_NAME(unit_normal)(real4 du, real4 dv, real size, uint *flags) {
    const real noise = QP_NOISE * size;
    real4 n = QP_NAME(cross_product)(du, dv);
    const real length2 = QP_NAME(square_length)(n);
    const real slopes2 = QP_NAME(square_length)(du) + QP_NAME(square_length)(dv);
    if (length2 > QP_TINY && length2 < QP_HUGE) {
        if (length2 > noise * noise * slopes2) return QP_NAME(unit)(n);
    } else {
        int u_power, v_power, power;
        if (QP_NAME(rescale)(&du, &u_power) && QP_NAME(rescale)(&dv, &v_power)) {
            n = QP_NAME(cross_product)(du, dv);
            if (QP_NAME(largest)(n) > ldexp(noise, u_power) + ldexp(noise, v_power) &&
                QP_NAME(rescale)(&n, &power))
                return QP_NAME(unit)(n);
        }
    }
    *flags |= QP_FLAG_NO_NORMAL;
    return make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
}

/* A vector in a leaf's frame turned into the patch's, as derivatives are below. */
QP_FUNCTION void QP_NAME(turn_pair)(uint turn, real4 da, real4 db, real4 *u, real4 *v) {
    *u = scale4((turn & 1u) != 0 ? db : da, ((turn + 1u) & 2u) != 0 ? QP_R(-1.0) : QP_R(1.0));
    *v = scale4((turn & 1u) != 0 ? da : db, (turn & 2u) != 0 ? QP_R(-1.0) : QP_R(1.0));
}

/* What stands for a normal where there is no tangent plane: that of the middle of the patch, or z. */
QP_FUNCTION real4 QP_NAME(stand_in_normal)(QP_NAME(surface_point) middle, real size) {
    uint flags = 0;
    const real4 n = QP_NAME(unit_normal)(middle.du, middle.dv, size, &flags);
    return flags == 0 ? n : make4(QP_R(0.0), QP_R(0.0), QP_R(1.0));
}

/* Moves (u,v) about an eighth of the patch towards side k (0 to 3), to a whole number of eighths, for which the control points of
 * level 3 are enough. False where that leaves it. */
QP_FUNCTION int QP_NAME(step_aside)(uint k, real *u, real *v) {
    real *x = k < 2u ? u : v;
    const real eighths = (real)(int)fma(QP_R(8.0), QP_NAME(plain)(*x), QP_R(0.5));
    const real to = QP_R(0.125) * (eighths + ((k & 1u) != 0 ? QP_R(1.0) : QP_R(-1.0)));
    *x = to <= QP_R(0.5) ? to : -(QP_R(1.0) - to);
    return to >= QP_R(0.0) && to <= QP_R(1.0);
}

/* Is a sample's own normal, if it has one, within 60 degrees of n? */
QP_FUNCTION int QP_NAME(agrees_with)(real4 n, QP_NAME(surface_point) s, real size) {
    uint flags = 0;
    const real4 m = QP_NAME(unit_normal)(s.du, s.dv, size, &flags);
    return flags != 0 || fma(m.z, n.z, fma(m.y, n.y, m.x * n.x)) >= QP_R(0.5);
}

/* Where N = du x dv vanishes, the normal is the limit of N / |N| from within the patch, if that is the same from all sides: to
 * first order N changes by t DN d in direction d, so the limit is DN d / |DN d| for every d that points into the patch. Inside an
 * edge of the patch both d and -d along it do, so DN must vanish along it (as it does where an edge is pulled together into a
 * point); at its corners both must give the same; within it DN must vanish, and no normal is found. Along an edge where DN d
 * vanishes and N does not, higher orders may turn it over: agrees_with() looks there.
 * u, v: the place in the patch. with_u: (du, duu, duv) in p, du, dv; with_v: (dv, duv, dvv); both in the leaf's frame.
 * False where there is none. */
QP_FUNCTION int QP_NAME(normal_from_within)(real u, real v, QP_NAME(surface_point) with_u,
                                            QP_NAME(surface_point) with_v, real size, real4 *normal) {
    const real4 na =
        add4(QP_NAME(cross_product)(with_u.du, with_v.p), QP_NAME(cross_product)(with_u.p, with_v.du));
    const real4 nb =
        add4(QP_NAME(cross_product)(with_u.dv, with_v.p), QP_NAME(cross_product)(with_u.p, with_v.dv));
    const real slopes = QP_NAME(largest)(with_u.p) + QP_NAME(largest)(with_v.p) +
                        QP_NAME(largest)(with_u.du) + QP_NAME(largest)(with_u.dv) +
                        QP_NAME(largest)(with_v.dv);
    const real least = QP_R(4.0) * QP_NOISE * size * slopes;
    real4 along[2], found = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
    int count = 0, power;
    QP_NAME(turn_pair)(with_u.turn, na, nb, &along[0], &along[1]);
    for (uint k = 0; k < 2u; ++k) {
        const real x = k == 0 ? u : v;
        if (!(QP_NAME(largest)(along[k]) > least)) continue;
        if (x != QP_R(0.0) || !QP_NAME(rescale)(&along[k], &power)) return 0;
        const real4 n = scale4(QP_NAME(unit)(along[k]), signbit(x) != 0 ? QP_R(-1.0) : QP_R(1.0));
        /* Within a thousandth of a right angle's measure of each other, or there is a cone. */
        if (count++ != 0 && !(QP_NAME(square_length)(sub4(n, found)) < QP_R(1e-6))) return 0;
        found = n;
    }
    *normal = found;
    return count != 0;
}

/* Turns (u,v) by rotation r, see plan_layout.h. */
QP_FUNCTION void QP_NAME(rotate_uv)(uint r, real *u, real *v) {
    const real x = (r & 1u) != 0 ? *v : *u, y = (r & 1u) != 0 ? *u : *v;
    *u = (r & 2u) != 0 ? QP_NAME(mirrored)(x) : x;
    *v = ((r + 1u) & 2u) != 0 ? QP_NAME(mirrored)(y) : y;
}

/* Derivatives of one sample: from the leaf's frame to the patch's and the mesh's. With (a,b) the leaf's coordinates, rotation 1 is
 * (a,b) = (v, 1-u), so that d/du = -d/db and d/dv = d/da; and so on around. A limit frame is turned but keeps its length. */
QP_FUNCTION void QP_NAME(write_derivatives)(__global real *out, real4 da, real4 db, uint turn, real scale) {
    const real4 u = (turn & 1u) != 0 ? db : da, v = (turn & 1u) != 0 ? da : db;
    const real su = ((turn + 1u) & 2u) != 0 ? -scale : scale, sv = (turn & 2u) != 0 ? -scale : scale;
    /* + 0 makes +0 of -0, so that a turn shows in no bit of a zero. */
    out[0] = u.x * su + QP_R(0.0);
    out[1] = u.y * su + QP_R(0.0);
    out[2] = u.z * su + QP_R(0.0);
    out[3] = v.x * sv + QP_R(0.0);
    out[4] = v.y * sv + QP_R(0.0);
    out[5] = v.z * sv + QP_R(0.0);
}

/* The same for the first `block` lanes of a leaf that is the whole patch. */
QP_FUNCTION void QP_NAME(write_lane_derivatives)(__global real *derivatives, ulong i, uint block,
                                                 __global const real *positions, uint turn, const lanes du[3],
                                                 const lanes dv[3]) {
    real slopes[6][QP_LANES];
    for (uint c = 0; c < 3u; ++c) {
        store_lanes(du[c], slopes[c]);
        store_lanes(dv[c], slopes[3u + c]);
    }
    for (uint l = 0; l < block; ++l) QP_NAME(write_derivatives)
    (derivatives + 6u * (i + l), make4(slopes[0][l], slopes[1][l], slopes[2][l]),
     make4(slopes[3][l], slopes[4][l], slopes[5][l]), turn, positions[QP_POSITION_SCALE]);
}

/* Writes QP_LANES samples, or the first `block` of them, from sample i on: their positions relative to origin, their
 * normals and flags. Lanes flagged QP_FLAG_NO_NORMAL still want a normal from replace_normal(). unit_normal() for lanes; those whose cross product is of no ordinary length go through
 * unit_normal() itself. Returns whether some may be flagged so. */
QP_FUNCTION int QP_NAME(write_samples)(__global real *vertices, __global uchar *flags, ulong i, uint block,
                                       __global const real *positions, real4 origin, const lanes p[3],
                                       const lanes du[3], const lanes dv[3], lanes size,
                                       uint flag[QP_LANES]) {
    lanes n[3];
    real result[6][QP_LANES];
    for (uint c = 0; c < 3u; ++c) {
        const uint y = c == 2u ? 0u : c + 1u, z = c == 0u ? 2u : c - 1u;
        const lanes cd = mul_lanes(du[z], dv[y]);
        const lanes rest = fma_lanes(neg_lanes(du[z]), dv[y], cd);
        n[c] = add_lanes(fma_lanes(du[y], dv[z], neg_lanes(cd)), rest);
    }
    const lanes length2 = fma_lanes(n[2], n[2], fma_lanes(n[1], n[1], mul_lanes(n[0], n[0])));
    const lanes inverse = div_lanes(splat(QP_R(1.0)), sqrt_lanes(length2));
    const lanes scale = splat(positions[QP_POSITION_SCALE]);
    const real first[3] = {origin.x, origin.y, origin.z};
    for (uint c = 0; c < 3u; ++c) {
        const lanes at = add_lanes(splat(first[c]), p[c]), rest = splat(positions[QP_POSITION_REST + c]);
        store_lanes(add_lanes(fma_lanes(at, scale, rest), splat(positions[QP_POSITION_CENTRE + c])),
                    result[c]);
    }
    for (uint c = 0; c < 3u; ++c) store_lanes(mul_lanes(n[c], inverse), result[3u + c]);
    const lanes noise = mul_lanes(splat(QP_NOISE), size);
    const lanes slopes2 =
        add_lanes(fma_lanes(du[2], du[2], fma_lanes(du[1], du[1], mul_lanes(du[0], du[0]))),
                  fma_lanes(dv[2], dv[2], fma_lanes(dv[1], dv[1], mul_lanes(dv[0], dv[0]))));
    const int special = !lanes_within(length2, QP_TINY, QP_HUGE) ||
                        !lanes_above(length2, mul_lanes(mul_lanes(noise, noise), slopes2));
    if (special) {
        real slopes[6][QP_LANES], sizes[QP_LANES];
        store_lanes(size, sizes);
        for (uint c = 0; c < 3u; ++c) {
            store_lanes(du[c], slopes[c]);
            store_lanes(dv[c], slopes[3u + c]);
        }
        for (uint l = 0; l < QP_LANES; ++l) {
            const real4 m =
                QP_NAME(unit_normal)(make4(slopes[0][l], slopes[1][l], slopes[2][l]),
                                     make4(slopes[3][l], slopes[4][l], slopes[5][l]), sizes[l], &flag[l]);
            result[3][l] = m.x;
            result[4][l] = m.y;
            result[5][l] = m.z;
        }
    }
    __global real *out = vertices + 6u * i;
    __global uchar *out_flags = flags + i;
    /* + 0 makes +0 of -0: some devices' fma signs a zero as it likes (positions end in such a sum). */
    for (uint l = 0; l < block; ++l, out += 6) {
        out[0] = result[0][l];
        out[1] = result[1][l];
        out[2] = result[2][l];
        out[3] = result[3][l] + QP_R(0.0);
        out[4] = result[4][l] + QP_R(0.0);
        out[5] = result[5][l] + QP_R(0.0);
        out_flags[l] = (uchar)flag[l];
    }
    return special;
}
