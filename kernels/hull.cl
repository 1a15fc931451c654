/* Hull stage: the control points of one patch a work-group (section 5 of the paper).
 *
 *   support[i] = sum over ring vertices j of weight[j][i] * (position[j] - position[anchor of i])   (+ anchor - origin)
 *
 * for the entry's first `rows` points i, 4 reals a point (x, y, z, and its share in a mode, plan_layout.h). Each work-item takes blocks of
 * QP_LANES neighbouring points, whose weights lie side by side. The ring goes through local memory, in chunks if it is long.
 * Sums run in an order of the mesh's vertices (host/frame/rings.c), in partial sums that start at 0 and are then added up, so
 * that neither the patch, nor the size of a chunk or a block, changes a bit of what comes before the move to the patch's origin. */
#ifndef QP_HULL_CHUNK
#define QP_HULL_CHUNK 128u
#endif

/* What is the same for all points of a patch. */
typedef struct QP_NAME(hull_job) {
    __global const real *weights, *vertices;
    __global const uint *ring, *order, *anchors, *anchored; /* anchors: 4 vertices; anchored: 4 bits a point, or 0 */
    ulong points;
    uint ring_size, origin;
    int shares;
} QP_NAME(hull_job);

/* Points i .. i + QP_LANES - 1: what they are relative to, and the sums so far. */
typedef struct QP_NAME(hull_block) {
    lanes from[3], sum[3], part[3];
} QP_NAME(hull_block);

/* Fills *job. (Functions here return no structs: LLVM marks what they are returned in, and Oclgrind stops at the marks.) */
QP_FUNCTION void QP_NAME(hull_job_of)(__global const uint *heads, __global const uint *trees,
                                      __global const real *reals, __global const uint *rings,
                                      __global const real *positions, __global const uint *entry,
                                      QP_NAME(hull_job) * job) {
    __global const uint *head = heads + entry[QP_ENTRY_HEAD];
    job->ring_size = head[QP_HEAD_RING];
    job->points = head[QP_HEAD_POINTS];
    job->shares = (head[QP_HEAD_FLAGS] & QP_PLAN_MODES) != 0;
    job->weights = reals + head[QP_HEAD_REALS];
    job->vertices = positions + QP_POSITION_FIRST;
    job->ring = rings + QP_ENTRY_WIDE(entry, QP_ENTRY_RING);
    job->order = job->ring + job->ring_size;
    job->anchors = job->order + job->ring_size;
    job->anchored =
        (head[QP_HEAD_FLAGS] & QP_PLAN_ANCHORS) != 0 ? trees + head[QP_HEAD_TREE] + head[QP_HEAD_ANCHORS] : 0;
    job->origin = entry[QP_ENTRY_ORIGIN];
}

/* Corner that point i is anchored to, and whether it moves (plan_layout.h). */
QP_FUNCTION uint QP_NAME(hull_anchor)(const QP_NAME(hull_job) * job, uint i) {
    return job->anchored[i >> 3] >> ((i & 7u) << 2);
}

/* Starts the sums of `count` points. Lanes past the end are like the last one. */
QP_FUNCTION void QP_NAME(hull_start)(const QP_NAME(hull_job) * job, uint i, uint count, QP_NAME(hull_block) * b) {
    for (uint c = 0; c < 3u; ++c) {
        b->sum[c] = b->part[c] = splat(QP_R(0.0));
        if (job->anchored == 0) {
            b->from[c] = splat(job->vertices[3u * (ulong)job->origin + c]);
        } else {
            real from[QP_LANES];
            for (uint l = 0; l < QP_LANES; ++l) {
                const uint anchor = QP_NAME(hull_anchor)(job, i + (l < count ? l : count - 1u));
                from[l] = job->vertices[3u * (ulong)job->anchors[QP_ANCHOR_CORNER(anchor)] + c];
            }
            b->from[c] = load_lanes(from);
        }
    }
}

/* Copies `count` ring vertices, from the begin-th of the sums' order on, to local memory. */
QP_FUNCTION void QP_NAME(hull_load)(const QP_NAME(hull_job) * job, uint begin, uint count, __local real *ring_x,
                                    __local real *ring_y, __local real *ring_z) {
    for (uint j = (uint)get_local_id(0); j < count; j += (uint)get_local_size(0)) {
        const uint vertex = job->ring[QP_RING_PLACE(job->order[begin + j])];
        __global const real *p = job->vertices + 3u * (ulong)vertex;
        ring_x[j] = p[0];
        ring_y[j] = p[1];
        ring_z[j] = p[2];
    }
}

/* Adds those to the sums. Reads up to QP_LANES - 1 weights past the row: the next row's, or the padding of the buffer. */
QP_FUNCTION void QP_NAME(hull_add)(const QP_NAME(hull_job) * job, uint i, uint begin, uint count,
                                   __local const real *ring_x, __local const real *ring_y,
                                   __local const real *ring_z, QP_NAME(hull_block) * b) {
    lanes px = b->part[0], py = b->part[1], pz = b->part[2];
    const lanes fx = b->from[0], fy = b->from[1], fz = b->from[2];
    for (uint j = 0; j < count; ++j) {
        const uint word = job->order[begin + j];
        if ((word & QP_RING_PART) != 0 && begin + j != 0) {
            b->sum[0] = add_lanes(b->sum[0], px);
            b->sum[1] = add_lanes(b->sum[1], py);
            b->sum[2] = add_lanes(b->sum[2], pz);
            px = py = pz = splat(QP_R(0.0));
        }
        const lanes w = load_lanes(job->weights + QP_RING_PLACE(word) * job->points + i);
        px = fma_lanes(w, sub_lanes(splat(ring_x[j]), fx), px);
        py = fma_lanes(w, sub_lanes(splat(ring_y[j]), fy), py);
        pz = fma_lanes(w, sub_lanes(splat(ring_z[j]), fz), pz);
    }
    b->part[0] = px;
    b->part[1] = py;
    b->part[2] = pz;
}

/* The sums, which are the same for all patches that have these points: x, y, z of each lane. */
QP_FUNCTION void QP_NAME(hull_finish)(const QP_NAME(hull_block) * b, real value[3][QP_LANES]) {
    for (uint c = 0; c < 3u; ++c) store_lanes(add_lanes(b->sum[c], b->part[c]), value[c]);
}

/* Fourth number of point i. */
QP_FUNCTION real QP_NAME(hull_share)(const QP_NAME(hull_job) * job, uint i) {
    return job->shares ? job->weights[job->ring_size * job->points + i] : QP_R(0.0);
}

/* Writes point i as this patch has it: relative to its own origin. */
QP_FUNCTION void QP_NAME(hull_write)(const QP_NAME(hull_job) * job, uint i, real x, real y, real z, real share,
                                     __global real *out) {
    __global real *p = out + 4u * (ulong)i;
    if (job->anchored != 0) {
        const uint anchor = QP_NAME(hull_anchor)(job, i);
        if ((anchor & QP_ANCHOR_MOVES) != 0) {
            __global const real *a = job->vertices + 3u * (ulong)job->anchors[QP_ANCHOR_CORNER(anchor)];
            __global const real *o = job->vertices + 3u * (ulong)job->origin;
            x = x + (a[0] - o[0]);
            y = y + (a[1] - o[1]);
            z = z + (a[2] - o[2]);
        }
    }
    p[0] = x;
    p[1] = y;
    p[2] = z;
    p[3] = share;
}

QP_FUNCTION void QP_NAME(hull_write_block)(const QP_NAME(hull_job) * job, uint i, uint count,
                                           const QP_NAME(hull_block) * b, __global real *out) {
    real value[3][QP_LANES];
    QP_NAME(hull_finish)(b, value);
    for (uint l = 0; l < count; ++l)
        QP_NAME(hull_write)
    (job, i + l, value[0][l], value[1][l], value[2][l], QP_NAME(hull_share)(job, i + l), out);
}

/* The first `rows` points of an entry, by the whole work-group, into `out`. ring_x, ring_y, ring_z: QP_HULL_CHUNK reals of local memory each.
 * Ends without a barrier: what items wrote is theirs until then. */
QP_STAGE void QP_NAME(hull_patch)(__global const uint *heads, __global const uint *trees,
                                     __global const real *reals, __global const uint *rings,
                                     __global const real *positions, __global const uint *entry, uint rows,
                                     __global real *out, __local real *ring_x, __local real *ring_y,
                                     __local real *ring_z) {
    QP_NAME(hull_job) job;
    QP_NAME(hull_job_of)(heads, trees, reals, rings, positions, entry, &job);
    const uint item = (uint)get_local_id(0) * QP_LANES, step = (uint)get_local_size(0) * QP_LANES;
    QP_NAME(hull_block) b;
    barrier(CLK_LOCAL_MEM_FENCE); /* nobody still reads a patch before */
    if (job.ring_size <= QP_HULL_CHUNK) {
        QP_NAME(hull_load)(&job, 0, job.ring_size, ring_x, ring_y, ring_z);
        barrier(CLK_LOCAL_MEM_FENCE);
        for (uint i = item; i < rows; i += step) {
            const uint count = rows - i < QP_LANES ? rows - i : QP_LANES;
            QP_NAME(hull_start)(&job, i, count, &b);
            QP_NAME(hull_add)(&job, i, 0, job.ring_size, ring_x, ring_y, ring_z, &b);
            QP_NAME(hull_write_block)(&job, i, count, &b, out);
        }
        return;
    }
    /* All items go through the same chunks, as barriers want it. */
    for (uint first = 0; first < rows; first += step) {
        const uint i = first + item;
        const uint count = i >= rows ? 0u : rows - i < QP_LANES ? rows - i : QP_LANES;
        if (count != 0) QP_NAME(hull_start)(&job, i, count, &b);
        for (uint begin = 0; begin < job.ring_size; begin += QP_HULL_CHUNK) {
            const uint vertices = job.ring_size - begin < QP_HULL_CHUNK ? job.ring_size - begin : QP_HULL_CHUNK;
            barrier(CLK_LOCAL_MEM_FENCE);
            QP_NAME(hull_load)(&job, begin, vertices, ring_x, ring_y, ring_z);
            barrier(CLK_LOCAL_MEM_FENCE);
            if (count != 0) QP_NAME(hull_add)(&job, i, begin, vertices, ring_x, ring_y, ring_z, &b);
        }
        if (count != 0) QP_NAME(hull_write_block)(&job, i, count, &b, out);
    }
}

#if QP_WITH_STAGES
__kernel void QP_NAME(hull)(__global const uint *heads, __global const uint *trees, __global const real *reals,
                            __global const uint *rings, __global const real *positions,
                            __global const uint *entries, uint first_entry, __global real *support QP_GROUP) {
    __local real ring_x[QP_HULL_CHUNK];
    __local real ring_y[QP_HULL_CHUNK];
    __local real ring_z[QP_HULL_CHUNK];
    __global const uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    QP_NAME(hull_patch)
    (heads, trees, reals, rings, positions, entry, entry[QP_ENTRY_ROWS],
     support + 4u * QP_ENTRY_WIDE(entry, QP_ENTRY_SUPPORT), ring_x, ring_y, ring_z);
}
#endif
