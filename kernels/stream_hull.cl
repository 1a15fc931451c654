/* Hull stage of the streamed schedule: one patch a work-group, its control points in the ring buffer (section 8.1 of the paper).
 *
 * The host gives a launch a piece of the ring that has room for all of its patches, and starts it when that piece is free
 * (host/frame/streamed.c), so that nothing here ever waits. Within the piece work-groups take their places by an atomic addition, in
 * the order in which they come: CLAIMED counts all points ever taken, and `offset`, modulo 2^32, is what leads from there to the
 * piece. It is the same for a whole launch, for launches of the hull stage run one after the other.
 *
 * first_entry: entry of group 0, first_ticket: its place among all patches. ring: words of ring_layout.h. points: the ring, with its
 * margins. The place is left in the patch's entry. */
__kernel void QP_NAME(stream_hull)(__global const uint *heads, __global const uint *trees,
                                   __global const real *reals, __global const uint *rings,
                                   __global const real *positions, __global uint *entries, uint first_entry,
                                   uint first_ticket, uint offset, volatile __global uint *ring,
                                   __global real *points QP_GROUP) {
    __local real ring_x[QP_HULL_CHUNK];
    __local real ring_y[QP_HULL_CHUNK];
    __local real ring_z[QP_HULL_CHUNK];
    __local ring_patch place;
    const int leads = get_local_id(0) == 0;
    __global real *memory = points + 4u * QP_RB_MARGIN;
    __global uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    if (leads) {
        ring_patch patch;
        patch.ticket = first_ticket + (uint)get_group_id(0);
        patch.points = entry[QP_ENTRY_ROWS];
        patch.slot = QP_RB_NO_SLOT;
        patch.span = 0; /* launches have one */
        if ((ring[QP_RB_OPTIONS] & QP_RB_TRACE) != 0) {
            patch.slot = ring_take_slot(ring);
            qp_atomic_store(ring_record(ring, patch.ticket) + QP_RECORD_SLOT, patch.slot);
            ring_tick(ring, patch.ticket, QP_TICK_START);
        }
        const uint guard = (ring[QP_RB_OPTIONS] & QP_RB_CANARIES) != 0 ? QP_RB_GUARD : 0u;
        patch.first = qp_atomic_add(ring + QP_RB_CLAIMED, patch.points + 2u * guard) + offset + guard;
        entry[QP_ENTRY_SUPPORT] = patch.first;
        entry[QP_ENTRY_SUPPORT + 1u] = 0;
        ring_plant(ring, (__global uint *)memory, (uint)sizeof(real), patch);
        qp_atomic_add(ring + QP_RB_ALLOCATIONS, 1u);
        if (qp_atomic_add(ring + QP_RB_ALLOCATED, patch.points) > 0xffffffffu - patch.points)
            qp_atomic_add(ring + QP_RB_ALLOCATED + 1u, 1u);
        qp_atomic_max(ring + QP_RB_PEAK, qp_atomic_add(ring + QP_RB_LIVE, patch.points) + patch.points);
        qp_atomic_max(ring + QP_RB_MOST_IN_FLIGHT, qp_atomic_add(ring + QP_RB_IN_FLIGHT, 1u) + 1u);
        ring_record(ring, patch.ticket)[QP_RECORD_POINTS] = patch.points;
        ring_tick(ring, patch.ticket, QP_TICK_ALLOCATED);
        place = patch;
    }
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    QP_NAME(hull_patch)
    (heads, trees, reals, rings, positions, entry, place.points, memory + 4u * (ulong)place.first, ring_x,
     ring_y, ring_z);
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    if (leads) {
        ring_tick(ring, place.ticket, QP_TICK_HULLED);
        ring_give_slot(ring, place.slot);
    }
}
