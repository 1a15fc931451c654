/* The fast pass of section 7.1: patches of the regular plan, straight from the base vertices. No control
 * points are stored and there is no tree; each work-item takes QP_LANES samples at once. Gives the same bits
 * as hull and domain through the regular plan, whose weights are the identity. */

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
    real point[3][16];
    for (uint j = 0; j < 16u; ++j) {
        __global const real *p = first + 3u * (ulong)ring[j];
        /* + 0 makes +0 of -0, as the hull's sum does. */
        point[0][j] = p[0] - origin.x + QP_R(0.0);
        point[1][j] = p[1] - origin.y + QP_R(0.0);
        point[2][j] = p[2] - origin.z + QP_R(0.0);
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
        QP_NAME(write_samples)(vertices, flags, out + i, block, positions, origin, p, su, sv, flag);
        if (want_derivatives != 0)
            QP_NAME(write_lane_derivatives)(derivatives, out + i, block, positions, rotation, su, sv);
    }
}
