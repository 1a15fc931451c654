/* Domain stage of the streamed schedule: one patch a work-group, from the control points that stream_hull.cl left in the ring buffer.
 * The room of a launch is free when all of it is done, which the host knows by its event; here it is only counted. Arguments as
 * there and in domain.cl. */
__kernel void QP_NAME(stream_domain)(__global const uint *heads, __global const uint *trees,
                                     __global const real *reals, __global const uint *rings,
                                     __global const real *positions, __global const uint *entries,
                                     uint first_entry, uint first_ticket, volatile __global uint *ring,
                                     __global const real *points, __global const real *grid_u,
                                     __global const real *grid_v, __global real *vertices,
                                     __global uchar *flags, __global real *derivatives,
                                     uint want_derivatives QP_GROUP) {
    __global const real *memory = points + 4u * QP_RB_MARGIN;
    __global const uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    const uint first = entry[QP_ENTRY_SUPPORT];
    QP_NAME(domain_patch)
    (heads, trees, reals, rings, positions, entry, (__global const real4 *)memory + first, grid_u, grid_v,
     vertices, flags, derivatives, want_derivatives);
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    if (get_local_id(0) == 0) {
        ring_patch patch;
        patch.ticket = first_ticket + (uint)get_group_id(0);
        patch.points = entry[QP_ENTRY_ROWS];
        patch.first = first;
        patch.slot = QP_RB_NO_SLOT;
        ring_inspect(ring, (__global const uint *)memory, (uint)sizeof(real), &patch);
        ring_tick(ring, patch.ticket, QP_TICK_DONE);
        qp_atomic_sub(ring + QP_RB_LIVE, patch.points);
        qp_atomic_sub(ring + QP_RB_IN_FLIGHT, 1u);
        qp_atomic_add(ring + QP_RB_RETIRED, 1u);
    }
}
