/* The fast pass of section 7.1: patches of the regular plan, straight from the base vertices. No control
 * points are stored and there is no tree; each work-item takes QP_LANES samples at once. Gives the same bits
 * as hull and domain through the regular plan, whose weights are the identity. */

/* One sample of the 16 points, with derivatives of the given orders (0 or 1) in place of the position. */
QP_FUNCTION void QP_NAME(eval_points)(real point[3][16], real u, real v, uint u_order, uint v_order,
                                      QP_NAME(surface_point) * s) {
    real bu[4], du[4], bv[4], dv[4];
    QP_NAME(basis_of_order)(u_order, QP_NAME(plain)(u), bu, du);
    QP_NAME(basis_of_order)(v_order, QP_NAME(plain)(v), bv, dv);
    s->turn = 0;
    for (uint j = 0; j < 4u; ++j) {
        const real *x = point[0] + 4u * j, *y = point[1] + 4u * j, *z = point[2] + 4u * j;
        QP_NAME(add_row)
        (s, j == 0, make4(x[0], y[0], z[0]), make4(x[1], y[1], z[1]), make4(x[2], y[2], z[2]),
         make4(x[3], y[3], z[3]), bu, du, bv[j], dv[j]);
    }
}

/* replace_normal() of domain.cl, for these points. */
QP_FUNCTION void QP_NAME(replace_regular_normal)(real point[3][16], real u, real v, real size, uint level,
                                                 __global real *normal, __global uchar *flag) {
    QP_NAME(surface_point) with_u, with_v, middle, s;
    real4 n = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
    QP_NAME(eval_points)(point, u, v, 1u, 0u, &with_u);
    QP_NAME(eval_points)(point, u, v, 0u, 1u, &with_v);
    int found = QP_NAME(normal_from_within)(u, v, with_u, with_v, size, &n);
    for (uint k = 0; k < 4u && found != 0 && level >= 3u; ++k) {
        real at_u = u, at_v = v;
        if (QP_NAME(step_aside)(k, &at_u, &at_v) == 0) continue;
        QP_NAME(eval_points)(point, at_u, at_v, 0u, 0u, &s);
        found = QP_NAME(agrees_with)(n, s, size);
    }
    if (found != 0) {
        *flag &= (uchar)~QP_FLAG_NO_NORMAL;
    } else {
        QP_NAME(eval_points)(point, QP_R(0.5), QP_R(0.5), 0u, 0u, &middle);
        if (level == 0) middle.du = middle.dv = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
        n = QP_NAME(stand_in_normal)(middle, size);
    }
    normal[0] = n.x + QP_R(0.0);
    normal[1] = n.y + QP_R(0.0);
    normal[2] = n.z + QP_R(0.0);
}

__kernel void QP_NAME(regular)(__global const uint *rings, __global const real *positions,
                               __global const uint *entries, uint first_entry, __global const real *grid_u,
                               __global const real *grid_v, __global real *vertices, __global uchar *flags,
                               __global real *derivatives, uint want_derivatives QP_GROUP) {
    __global const uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    __global const uint *ring = rings + QP_ENTRY_WIDE(entry, QP_ENTRY_RING);
    __global const real *us = grid_u + QP_ENTRY_WIDE(entry, QP_ENTRY_GRID);
    __global const real *vs = grid_v + QP_ENTRY_WIDE(entry, QP_ENTRY_GRID);
    __global const real *first = positions + QP_POSITION_FIRST;
    __global const real *base = first + 3u * (ulong)ring[0];
    const real4 origin = make4(base[0], base[1], base[2]);
    const ulong out = QP_ENTRY_WIDE(entry, QP_ENTRY_OUT);
    const uint rotation = entry[QP_ENTRY_ROTATION];
    const uint samples = entry[QP_ENTRY_SAMPLES];
    real point[3][16], size = QP_R(0.0);
    for (uint j = 0; j < 16u; ++j) {
        __global const real *p = first + 3u * (ulong)ring[j];
        /* + 0 makes +0 of -0, as the hull's sum does. */
        point[0][j] = p[0] - origin.x + QP_R(0.0);
        point[1][j] = p[1] - origin.y + QP_R(0.0);
        point[2][j] = p[2] - origin.z + QP_R(0.0);
        const real most = QP_NAME(largest)(make4(point[0][j], point[1][j], point[2][j]));
        size = most > size ? most : size;
    }

    const uint step = (uint)get_local_size(0) * QP_LANES;
    for (uint i = (uint)get_local_id(0) * QP_LANES; i < samples; i += step) {
        /* Reads up to QP_LANES - 1 points past the grid: the next one's, or the padding of the buffer. */
        lanes u = load_lanes(us + i), v = load_lanes(vs + i);
        if (rotation != 0) {
            const lanes a = u, b = v;
            u = rotation == 1u ? b : neg_lanes(rotation == 2u ? a : b);
            v = rotation == 3u ? a : neg_lanes(rotation == 1u ? a : b);
        }
        const lanes signed_u = u, signed_v = v;
        u = plain_lanes(u);
        v = plain_lanes(v);
        lanes bu[4], du[4], bv[4], dv[4], p[3], su[3], sv[3];
        QP_NAME(basis_lanes)(u, bu, du);
        QP_NAME(basis_lanes)(v, bv, dv);
        for (uint c = 0; c < 3u; ++c) {
            for (uint j = 0; j < 4u; ++j) {
                const real *q = point[c] + 4u * j;
                lanes along = mul_lanes(splat(q[0]), bu[0]), slope = mul_lanes(splat(q[0]), du[0]);
                for (uint k = 1; k < 4u; ++k) {
                    along = fma_lanes(splat(q[k]), bu[k], along);
                    slope = fma_lanes(splat(q[k]), du[k], slope);
                }
                p[c] = j == 0 ? mul_lanes(along, bv[0]) : fma_lanes(along, bv[j], p[c]);
                su[c] = j == 0 ? mul_lanes(slope, bv[0]) : fma_lanes(slope, bv[j], su[c]);
                sv[c] = j == 0 ? mul_lanes(along, dv[0]) : fma_lanes(along, dv[j], sv[c]);
            }
        }
        uint flag[QP_LANES], block = samples - i < QP_LANES ? samples - i : QP_LANES;
        for (uint l = 0; l < QP_LANES; ++l) flag[l] = 0;
        if (QP_NAME(write_samples)(vertices, flags, out + i, block, positions, origin, p, su, sv, splat(size),
                                   flag)) {
            real at[2][QP_LANES];
            store_lanes(signed_u, at[0]);
            store_lanes(signed_v, at[1]);
            for (uint l = 0; l < block; ++l) {
                if ((flag[l] & QP_FLAG_NO_NORMAL) != 0)
                    QP_NAME(replace_regular_normal)
                (point, at[0][l], at[1][l], size, entry[QP_ENTRY_LEVEL], vertices + 6u * (out + i + l) + 3u, flags + (out + i + l));
            }
        }
        if (want_derivatives != 0)
            QP_NAME(write_lane_derivatives)(derivatives, out + i, block, positions, rotation, su, sv);
    }
}
