/* Hull stage: the control points of one patch a work-group (section 5 of the paper).
 *
 *   support[i] = sum over ring vertices j of weight[j][i] * (position[ring[j]] - position[ring[0]])
 *
 * for the entry's first `rows` points i, 4 reals a point (x, y, z, and its share in a mode, plan_layout.h). Each work-item takes blocks of
 * QP_LANES neighbouring points, whose weights lie side by side. The ring goes through local memory in chunks,
 * for it may be of any size. Sums run in ring order, in parts of QP_HULL_PART vertices that start at 0 and are then added up:
 * the error of a sum of n terms grows with n/part + part instead of n, which counts at valences in the thousands. Chunks are
 * whole parts, so that neither their size nor that of a block changes a bit. */
#define QP_HULL_PART 32u
#ifndef QP_HULL_CHUNK
#define QP_HULL_CHUNK 128u
#endif
#if QP_HULL_CHUNK % QP_HULL_PART != 0
#error "a chunk is to be whole parts"
#endif

/* The first `rows` points of an entry, by the whole work-group, into `out`. ring_x, ring_y, ring_z: QP_HULL_CHUNK reals of local memory each.
 * Ends without a barrier: what items wrote is theirs until then. */
QP_FUNCTION void QP_NAME(hull_patch)(__global const uint *heads, __global const real *reals,
                                     __global const uint *rings, __global const real *positions,
                                     __global const uint *entry, uint rows, __global real *out,
                                     __local real *ring_x, __local real *ring_y, __local real *ring_z) {
    __global const uint *head = heads + entry[QP_ENTRY_HEAD];
    __global const uint *ring = rings + QP_ENTRY_WIDE(entry, QP_ENTRY_RING);
    const uint ring_size = head[QP_HEAD_RING];
    const ulong points = head[QP_HEAD_POINTS];
    const int shares = (head[QP_HEAD_FLAGS] & QP_PLAN_MODES) != 0;
    __global const real *weights = reals + head[QP_HEAD_REALS];
    __global const real *vertices = positions + QP_POSITION_FIRST;
    __global const real *origin = vertices + 3u * (ulong)ring[0];
    const real ox = origin[0], oy = origin[1], oz = origin[2];
    const uint item = (uint)get_local_id(0), items = (uint)get_local_size(0);

    for (uint begin = 0; begin < ring_size; begin += QP_HULL_CHUNK) {
        const uint count = ring_size - begin < QP_HULL_CHUNK ? ring_size - begin : QP_HULL_CHUNK;
        barrier(CLK_LOCAL_MEM_FENCE); /* nobody still reads the chunk before */
        for (uint j = item; j < count; j += items) {
            __global const real *p = vertices + 3u * (ulong)ring[begin + j];
            ring_x[j] = p[0] - ox;
            ring_y[j] = p[1] - oy;
            ring_z[j] = p[2] - oz;
        }
        barrier(CLK_LOCAL_MEM_FENCE);
        for (uint i = item * QP_LANES; i < rows; i += items * QP_LANES) {
            const uint block = rows - i < QP_LANES ? rows - i : QP_LANES;
            lanes x = splat(QP_R(0.0)), y = x, z = x;
            real spill[3][QP_LANES];
            if (begin != 0) {
                for (uint l = 0; l < QP_LANES; ++l) {
                    /* Lanes past the end repeat the last point and are not written. */
                    __global const real *p = out + 4u * (ulong)(i + (l < block ? l : block - 1u));
                    spill[0][l] = p[0];
                    spill[1][l] = p[1];
                    spill[2][l] = p[2];
                }
                x = load_lanes(spill[0]);
                y = load_lanes(spill[1]);
                z = load_lanes(spill[2]);
            }
            /* Reads up to QP_LANES - 1 weights past the row: the next row's, or the padding of the buffer. */
            __global const real *weight = weights + begin * points + i;
            for (uint part = 0; part < count; part += QP_HULL_PART) {
                const uint end = count - part < QP_HULL_PART ? count : part + QP_HULL_PART;
                lanes px = splat(QP_R(0.0)), py = px, pz = px;
                for (uint j = part; j < end; ++j, weight += points) {
                    const lanes w = load_lanes(weight);
                    px = fma_lanes(w, splat(ring_x[j]), px);
                    py = fma_lanes(w, splat(ring_y[j]), py);
                    pz = fma_lanes(w, splat(ring_z[j]), pz);
                }
                x = add_lanes(x, px);
                y = add_lanes(y, py);
                z = add_lanes(z, pz);
            }
            store_lanes(x, spill[0]);
            store_lanes(y, spill[1]);
            store_lanes(z, spill[2]);
            for (uint l = 0; l < block; ++l) {
                __global real *p = out + 4u * (ulong)(i + l);
                p[0] = spill[0][l];
                p[1] = spill[1][l];
                p[2] = spill[2][l];
                p[3] = shares ? weights[ring_size * points + i + l] : QP_R(0.0);
            }
        }
    }
}

__kernel void QP_NAME(hull)(__global const uint *heads, __global const real *reals,
                            __global const uint *rings, __global const real *positions,
                            __global const uint *entries, uint first_entry, __global real *support QP_GROUP) {
    __local real ring_x[QP_HULL_CHUNK];
    __local real ring_y[QP_HULL_CHUNK];
    __local real ring_z[QP_HULL_CHUNK];
    __global const uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    QP_NAME(hull_patch)
    (heads, reals, rings, positions, entry, entry[QP_ENTRY_ROWS],
     support + 4u * QP_ENTRY_WIDE(entry, QP_ENTRY_SUPPORT), ring_x, ring_y, ring_z);
}
