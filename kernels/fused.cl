/* Hull and domain of one patch by one work-group, its control points in the ring buffer (section 8.1 of the paper): what hardware
 * does with a warp, from the allocation in the hull stage to the release after the last domain item. Work-groups take their
 * patches by ticket, so that they are issued in the order of the entries, whatever order a device starts work-groups in.
 *
 * first_entry: entry of ticket 0. ring: words of ring_layout.h. points: the ring, with its margins. */
__kernel void QP_NAME(fused)(__global const uint *heads, __global const uint *trees,
                             __global const real *reals, __global const uint *rings,
                             __global const real *positions, __global const uint *entries, uint first_entry,
                             volatile __global uint *ring, __global real *points, __global const real *grid_u,
                             __global const real *grid_v, __global real *vertices, __global uchar *flags,
                             __global real *derivatives, uint want_derivatives QP_GROUP) {
    __local real ring_x[QP_HULL_CHUNK];
    __local real ring_y[QP_HULL_CHUNK];
    __local real ring_z[QP_HULL_CHUNK];
    __local uint ticket_of_group, points_of_group, first_of_group;
    ring_patch patch; /* the leader's */
    const int leads = get_local_id(0) == 0;
    __global real *memory = points + 4u * QP_RB_MARGIN;
    const uint point_words = (uint)sizeof(real);
    (void)get_group_id(0);
    if (leads) {
        /* Looked up before the ticket is taken, which may then be another one, so that nobody waits for his turn while this group
         * waits for memory. There is such a patch, for this group has not had its own. */
        const uint next = qp_atomic_load(ring + QP_RB_TICKET);
        uint rows = ring_points(heads, entries + ((ulong)first_entry + next) * QP_ENTRY_WORDS);
        ring_begin(ring, &patch);
        if (patch.ticket != next)
            rows = ring_points(heads, entries + ((ulong)first_entry + patch.ticket) * QP_ENTRY_WORDS);
        ring_allocate(ring, (__global uint *)memory, point_words, rows, &patch);
        ticket_of_group = patch.ticket;
        points_of_group = patch.points;
        first_of_group = patch.first;
    }
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    const uint ticket = ticket_of_group;
    __global const uint *entry = entries + ((ulong)first_entry + ticket) * QP_ENTRY_WORDS;
    __global real *own = memory + 4u * (ulong)first_of_group;
    QP_NAME(hull_patch)
    (heads, trees, reals, rings, positions, entry, points_of_group, own, ring_x, ring_y, ring_z);
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    if (leads) ring_tick(ring, ticket, QP_TICK_HULLED);
    QP_NAME(domain_patch)
    (heads, trees, reals, rings, positions, entry, (__global const real4 *)own, grid_u, grid_v, vertices,
     flags, derivatives, want_derivatives);
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    if (leads) ring_retire(ring, (__global const uint *)memory, point_words, &patch);
}
