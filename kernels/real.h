/* Numbers of one precision (QP_REAL_DOUBLE or not): `real`, `real4` (a point; .w is 0) and `lanes`, QP_LANES
 * reals that go through the same operations together. In C this file is included once a precision, so it has
 * no guard and real_end.h undoes its macros. */

#ifdef QP_REAL_DOUBLE
#define QP_R(constant) constant
#define QP_TINY 0x1p-900 /* a squared length between these is as good as any; outside, rescale first */
#define QP_HUGE 0x1p+900
#define QP_NOISE 0x1p-49 /* sixteen times the unit roundoff */
#define QP_CORRECT_DIVIDE 1
#else
#define QP_R(constant) constant##f
#define QP_TINY 0x1p-90f
#define QP_HUGE 0x1p+90f
#define QP_NOISE 0x1p-20f
#endif

#ifdef __OPENCL_VERSION__

#ifdef QP_REAL_DOUBLE
typedef double real;
typedef double4 real4;
#define QP_REAL_NAME double
#define QP_AS_BITS as_long
#else
typedef float real;
typedef float4 real4;
#define QP_REAL_NAME float
#define QP_AS_BITS as_int
#endif

QP_FUNCTION real4 make4(real x, real y, real z) {
    return (real4)(x, y, z, QP_R(0.0));
}
#define add4(a, b) ((a) + (b))
#define sub4(a, b) ((a) - (b))
#define scale4(a, s) ((a) * (s))
#ifdef QP_SOFT_FMA
/* fma from sums and products, for devices whose own is integer code that takes their compilers minutes: a b = high + low (Dekker),
 * low + c and then high + ... as sums of two numbers each (Knuth), of which the lower ones are added with rounding to odd, so that the
 * last addition rounds but once (Boldo and Melquiond, "Emulation of FMA and correctly rounded sums", IEEE Trans. Computers 57(4),
 * 2008). No branch, the same for one number and four. Right unless a part of the product is below the normal numbers. */
#define QP_DEFINE_FMA(type, name, as_type, as_bits, bits_type, mask_of)                                      \
    QP_FUNCTION type name(type a, type b, type c) {                                                          \
        const type a1 = as_type(as_bits(a) & 0xfffff000u), b1 = as_type(as_bits(b) & 0xfffff000u);           \
        const type a2 = a - a1, b2 = b - b1, high = a * b;                                                   \
        const type low = a2 * b2 - (((high - a1 * b1) - a1 * b2) - a2 * b1);                                 \
        const type s = c + low, s0 = s - c, s1 = (c - (s - s0)) + (low - s0);                                \
        const type t = high + s, t0 = t - high, t1 = (high - (t - t0)) + (s - t0);                           \
        const type r = t1 + s1, r0 = r - t1, rest = (t1 - (r - r0)) + (s1 - r0);                             \
        const bits_type bits = as_bits(r), away = 1u - ((as_bits(rest) ^ bits) >> 31 << 1);                  \
        return t + as_type(bits + (away & ((bits & 1u) - 1u) & mask_of(rest != 0.0f)));                      \
    }
#define QP_MASK_OF_INT(i) (0u - (uint)(i))
QP_DEFINE_FMA(real, soft_fma, as_float, as_uint, uint, QP_MASK_OF_INT)
QP_DEFINE_FMA(real4, soft_fma4, as_float4, as_uint4, uint4, as_uint4)
#define fma(a, b, c) soft_fma((a), (b), (c))
#define fma4(a, s, c) soft_fma4((a), (real4)(s), (c))
#else
#define fma4(a, s, c) fma((a), (real4)(s), (c))
#endif

/* The host passes the width that the device's registers like. */
#ifndef QP_LANES
#define QP_LANES 1
#endif
#define QP_JOIN_(a, b) a##b
#define QP_JOIN(a, b) QP_JOIN_(a, b)
#if QP_LANES == 1
typedef real lanes;
#define load_lanes(p) (*(p))
#define plain_lanes(a) QP_NAME(plain)(a)
#define store_lanes(v, p) (*(p) = (v))
#define lanes_within(a, low, high) ((a) > (low) && (a) < (high))
#define lanes_above(a, b) ((a) > (b))
#else
typedef QP_JOIN(QP_REAL_NAME, QP_LANES) lanes;
#define load_lanes(p) QP_JOIN(vload, QP_LANES)(0, (p))
#define plain_lanes(a) select((a), (a) + (lanes)(QP_R(1.0)), QP_JOIN(QP_AS_BITS, QP_LANES)(a))
#define store_lanes(v, p) QP_JOIN(vstore, QP_LANES)((v), 0, (p))
#define lanes_within(a, low, high) all((a) > (lanes)(low) && (a) < (lanes)(high))
#define lanes_above(a, b) all((a) > (b))
#endif
#define splat(x) ((lanes)(x))
#define neg_lanes(a) (-(a))
#define add_lanes(a, b) ((a) + (b))
#define sub_lanes(a, b) ((a) - (b))
#define mul_lanes(a, b) ((a) * (b))
#define fma_lanes(a, b, c) fma((a), (b), (c))

#ifdef QP_CORRECT_DIVIDE

#define qp_div(a, b) ((a) / (b))
#define qp_sqrt(a) sqrt(a)
#define div_lanes(a, b) ((a) / (b))
#define sqrt_lanes(a) sqrt(a)

#else

/* A device without correctly rounded division and square root is off by some ulp; the residual, which fma
 * gives exactly, tells which neighbour is nearest. For operands well inside the range of float, as all here
 * are. */
QP_FUNCTION real qp_div(real a, real b) {
    real q = a / b;
    q = fma(fma(-q, b, a), 1.0f / b, q);
    real best = fabs(fma(-q, b, a)), up = nextafter(q, INFINITY), down = nextafter(q, -INFINITY);
    real up_rest = fabs(fma(-up, b, a)), down_rest = fabs(fma(-down, b, a));
    return up_rest < best ? up : down_rest < best ? down : q;
}
QP_FUNCTION real qp_sqrt(real a) {
    if (!(a > 0.0f)) return a;
    real s = sqrt(a);
    s = fma(fma(-s, s, a), 0.5f / s, s);
    /* a lies between the squares of the midpoints s +- ulp/2 of the nearest s: compare a - s*s with +- s*ulp.
     */
    real up = nextafter(s, INFINITY), down = nextafter(s, 0.0f);
    real rest = fma(-s, s, a);
    if (rest > s * (up - s)) return up;
    if (rest <= -s * (s - down)) return down;
    return s;
}
#if QP_LANES == 1
#define div_lanes(a, b) qp_div((a), (b))
#define sqrt_lanes(a) qp_sqrt(a)
#else
QP_FUNCTION lanes div_lanes(lanes a, lanes b) {
    real x[QP_LANES], y[QP_LANES];
    store_lanes(a, x);
    store_lanes(b, y);
    for (uint i = 0; i < QP_LANES; ++i) x[i] = qp_div(x[i], y[i]);
    return load_lanes(x);
}
QP_FUNCTION lanes sqrt_lanes(lanes a) {
    real x[QP_LANES];
    store_lanes(a, x);
    for (uint i = 0; i < QP_LANES; ++i) x[i] = qp_sqrt(x[i]);
    return load_lanes(x);
}
#endif
#endif

#else /* C11 */

#ifdef QP_REAL_DOUBLE
#define QP_NAME(name) name##_double
#define real double
#define QP_LANES 8u
#define qp_fma(a, b, c) __builtin_fma((a), (b), (c))
#define qp_sqrt(a) __builtin_sqrt(a)
#define fabs(a) __builtin_fabs(a)
#else
#define QP_NAME(name) name##_float
#define real float
#define QP_LANES 16u
#define qp_fma(a, b, c) __builtin_fmaf((a), (b), (c))
#define qp_sqrt(a) __builtin_sqrtf(a)
#define fabs(a) __builtin_fabsf(a)
#endif
#define fma(a, b, c) qp_fma(a, b, c)
#define qp_div(a, b) ((a) / (b))

#define real4 QP_NAME(real4)
#define make4 QP_NAME(make4)
#define add4 QP_NAME(add4)
#define sub4 QP_NAME(sub4)
#define scale4 QP_NAME(scale4)
#define fma4 QP_NAME(fma4)
typedef struct real4 {
    real x, y, z, w;
} real4;
QP_FUNCTION real4 make4(real x, real y, real z) {
    return (real4){x, y, z, 0};
}
QP_FUNCTION real4 add4(real4 a, real4 b) {
    return (real4){a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
}
QP_FUNCTION real4 sub4(real4 a, real4 b) {
    return (real4){a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w};
}
QP_FUNCTION real4 scale4(real4 a, real s) {
    return (real4){a.x * s, a.y * s, a.z * s, a.w * s};
}
QP_FUNCTION real4 fma4(real4 a, real s, real4 c) {
    return (real4){fma(a.x, s, c.x), fma(a.y, s, c.y), fma(a.z, s, c.z), fma(a.w, s, c.w)};
}

#define lanes QP_NAME(lanes)
#define load_lanes QP_NAME(load_lanes)
#define plain_lanes QP_NAME(plain_lanes)
#define store_lanes QP_NAME(store_lanes)
#define lanes_within QP_NAME(lanes_within)
#define lanes_above QP_NAME(lanes_above)
#define splat QP_NAME(splat)
#define neg_lanes QP_NAME(neg_lanes)
#define add_lanes QP_NAME(add_lanes)
#define sub_lanes QP_NAME(sub_lanes)
#define mul_lanes QP_NAME(mul_lanes)
#define fma_lanes QP_NAME(fma_lanes)
#define div_lanes QP_NAME(div_lanes)
#define sqrt_lanes QP_NAME(sqrt_lanes)
typedef struct lanes {
    real v[QP_LANES];
} lanes;
QP_FUNCTION lanes splat(real x) {
    lanes r;
    for (uint i = 0; i < QP_LANES; ++i) r.v[i] = x;
    return r;
}
QP_FUNCTION lanes load_lanes(const real *p) {
    lanes r;
    for (uint i = 0; i < QP_LANES; ++i) r.v[i] = p[i];
    return r;
}
/* plain() of spline.h */
QP_FUNCTION lanes plain_lanes(lanes a) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] = signbit(a.v[i]) ? QP_R(1.0) + a.v[i] : a.v[i];
    return a;
}
QP_FUNCTION void store_lanes(lanes a, real *p) {
    for (uint i = 0; i < QP_LANES; ++i) p[i] = a.v[i];
}
QP_FUNCTION int lanes_within(lanes a, real low, real high) {
    int good = 1;
    for (uint i = 0; i < QP_LANES; ++i) good &= a.v[i] > low && a.v[i] < high;
    return good;
}
QP_FUNCTION int lanes_above(lanes a, lanes b) {
    int good = 1;
    for (uint i = 0; i < QP_LANES; ++i) good &= a.v[i] > b.v[i];
    return good;
}
QP_FUNCTION lanes neg_lanes(lanes a) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] = -a.v[i];
    return a;
}
QP_FUNCTION lanes add_lanes(lanes a, lanes b) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] += b.v[i];
    return a;
}
QP_FUNCTION lanes sub_lanes(lanes a, lanes b) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] -= b.v[i];
    return a;
}
QP_FUNCTION lanes mul_lanes(lanes a, lanes b) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] *= b.v[i];
    return a;
}
QP_FUNCTION lanes fma_lanes(lanes a, lanes b, lanes c) {
    for (uint i = 0; i < QP_LANES; ++i) c.v[i] = fma(a.v[i], b.v[i], c.v[i]);
    return c;
}
QP_FUNCTION lanes div_lanes(lanes a, lanes b) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] /= b.v[i];
    return a;
}
QP_FUNCTION lanes sqrt_lanes(lanes a) {
    for (uint i = 0; i < QP_LANES; ++i) a.v[i] = qp_sqrt(a.v[i]);
    return a;
}

#endif
