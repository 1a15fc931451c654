/* The ring buffer's allocator (section 8.1 of the paper): called by one work-item of a work-group, in the order
 *
 *   ring_begin      takes a ticket: the patch's place in the order of issue
 *   ring_allocate   takes its points from the ring, in the order of tickets
 *   ring_retire     gives them back, when no item of the group will touch them again
 *
 * A ring may have any number of points that is at least that of the largest patch. Allocations lie one after the other, each in one piece: what is
 * too short at the end is skipped, and given back together with the points after it. Space is given back in order of tickets,
 * whichever way patches retire, so that what is taken is always one piece, CLAIMED - RELEASED points that end at HEAD. Both count
 * modulo 2^32, and their difference is right, for it is never more than the capacity, below 2^31.
 *
 * No deadlock. A group waits in three places: for its turn, for room, and (in order) for older patches to retire. Each
 * wait ends by what groups of lower tickets do, without any other wait but these:
 *  - its turn comes when all lower tickets have allocated;
 *  - room is there at the latest when all lower tickets have retired: then nothing is taken, the allocator, which alone has the turn, begins anew
 *    at 0, and the largest patch fits;
 *  - in order, it retires when all lower tickets have.
 * A ticket is taken by a group that already runs, so that all lower ones are of groups that run, too, or have ended: nobody waits
 * for a group that has yet to start. By induction over tickets all end, on every device where a group that has started goes on whatever
 * others do, in particular where groups run one after the other. The host sees to it that no patch is larger than the ring.
 * Out of order nobody waits to retire: who finds the sweep taken leaves word in PENDING, and whoever has it goes on until nothing was
 * left. Nothing here is of one size: a counter that wraps around after 2^32 tickets is compared for equality alone.
 *
 * No race. Words of the ring and of records are atomic. Points are written between ring_allocate and ring_retire by one group; that
 * another may have them afterwards it learns from TURN and RELEASED, which are told with qp_release() and read with qp_acquire(). */
#ifndef QP_RING_H
#define QP_RING_H

/* What one work-group knows of its patch. */
typedef struct ring_patch {
    uint ticket;
    uint points, first; /* its place in the ring, canaries not counted */
    uint span;          /* what it has of the ring, canaries and what was skipped counted */
    uint slot;
} ring_patch;

/* Time, for the trace and for stalls: ticks of a clock, or, where kernels can read none, events. */
QP_FUNCTION ulong ring_clock(volatile __global uint *ring) {
#ifdef QP_KERNEL_CLOCK
    (void)ring;
    return qp_clock();
#else
    return qp_atomic_add(ring + QP_RB_EVENTS, 1u);
#endif
}

/* A count of two words, which only the caller changes. */
QP_FUNCTION void ring_count(volatile __global uint *word, ulong more) {
    const ulong sum = ((ulong)qp_atomic_load(word) | (ulong)qp_atomic_load(word + 1) << 32) + more;
    qp_atomic_store(word, (uint)sum);
    qp_atomic_store(word + 1, (uint)(sum >> 32));
}

/* A patch's record. */
QP_FUNCTION volatile __global uint *ring_record(volatile __global uint *ring, uint ticket) {
    const uint words = (ring[QP_RB_OPTIONS] & QP_RB_TRACE) != 0 ? QP_RECORD_TRACE_WORDS : QP_RECORD_WORDS;
    return ring + QP_RB_WORDS + (ulong)ticket * words;
}

/* Notes when something happened to a patch; nothing without a trace. */
QP_FUNCTION void ring_tick(volatile __global uint *ring, uint ticket, uint which) {
    if ((ring[QP_RB_OPTIONS] & QP_RB_TRACE) == 0) return;
    const ulong now = ring_clock(ring);
    volatile __global uint *word = ring_record(ring, ticket) + QP_RECORD_TICKS + 2u * which;
    qp_atomic_store(word, (uint)now);
    qp_atomic_store(word + 1, (uint)(now >> 32));
}

/* The lowest warp slot that is free is taken. */
QP_FUNCTION uint ring_take_slot(volatile __global uint *ring) {
    for (uint w = 0; w < QP_RB_SLOT_WORDS; ++w) {
        uint taken = qp_atomic_load(ring + QP_RB_SLOTS + w);
        while (taken != 0xffffffffu) {
            uint bit = 0;
            while ((taken >> bit & 1u) != 0) ++bit;
            if (qp_atomic_swap(ring + QP_RB_SLOTS + w, taken, taken | 1u << bit)) return 32u * w + bit;
            taken = qp_atomic_load(ring + QP_RB_SLOTS + w);
        }
    }
    return QP_RB_NO_SLOT;
}

QP_FUNCTION void ring_give_slot(volatile __global uint *ring, uint slot) {
    if (slot != QP_RB_NO_SLOT) qp_atomic_sub(ring + QP_RB_SLOTS + slot / 32u, 1u << (slot % 32u));
}

/* Points that an entry's patch needs at its level. */
QP_FUNCTION uint ring_points(__global const uint *heads, __global const uint *entry) {
    return heads[entry[QP_ENTRY_HEAD] + QP_HEAD_ROWS + entry[QP_ENTRY_LEVEL]];
}

QP_FUNCTION void ring_begin(volatile __global uint *ring, ring_patch *p) {
    p->ticket = qp_atomic_add(ring + QP_RB_TICKET, 1u);
    p->points = p->first = p->span = 0;
    p->slot = QP_RB_NO_SLOT;
    if ((ring[QP_RB_OPTIONS] & QP_RB_TRACE) != 0) {
        p->slot = ring_take_slot(ring);
        qp_atomic_store(ring_record(ring, p->ticket) + QP_RECORD_SLOT, p->slot);
        ring_tick(ring, p->ticket, QP_TICK_START);
    }
}

/* A word that only the caller changes is at least this. */
QP_FUNCTION void ring_most(volatile __global uint *word, uint value) {
    if (qp_atomic_load(word) < value) qp_atomic_store(word, value);
}

/* Waits until `need` points are free behind HEAD, and those to the ring's end if `need` is more than they are. Only for whoever has the turn. */
QP_FUNCTION uint ring_wait_for_room(volatile __global uint *ring, uint claimed, uint need) {
    const uint capacity = ring[QP_RB_CAPACITY];
    uint used = claimed - qp_atomic_load(ring + QP_RB_RELEASED);
    if (used == 0 || need <= capacity - used) return used;
#ifdef QP_KERNEL_CLOCK
    const ulong since = ring_clock(ring);
#endif
    uint round = 0;
    do {
        qp_wait(round++);
        used = claimed - qp_atomic_load(ring + QP_RB_RELEASED);
    } while (used != 0 && need > capacity - used);
    qp_atomic_add(ring + QP_RB_STALLS, 1u);
#ifdef QP_KERNEL_CLOCK
    ring_count(ring + QP_RB_STALL_TICKS, ring_clock(ring) - since);
#endif
    return used;
}

/* Canaries before and after the points of p. */
QP_FUNCTION void ring_plant(volatile __global uint *ring, __global uint *memory, uint point_words,
                            ring_patch p) {
    const uint guard = (ring[QP_RB_OPTIONS] & QP_RB_CANARIES) != 0 ? QP_RB_GUARD : 0u;
    for (uint i = 0; i < guard * point_words; ++i) {
        memory[(ulong)(p.first - guard) * point_words + i] = QP_RB_CANARY(p.ticket);
        memory[(ulong)(p.first + p.points) * point_words + i] = QP_RB_CANARY(p.ticket);
    }
}

/* The place of p's `points` points in the ring. */
QP_FUNCTION void ring_allocate(volatile __global uint *ring, __global uint *memory, uint point_words,
                               uint points, ring_patch *p) {
    for (uint round = 0; qp_atomic_load(ring + QP_RB_TURN) != p->ticket; ++round) qp_wait(round);
    qp_acquire();
    const uint guard = (ring[QP_RB_OPTIONS] & QP_RB_CANARIES) != 0 ? QP_RB_GUARD : 0u;
    const uint need = points + 2u * guard, claimed = qp_atomic_load(ring + QP_RB_CLAIMED);
    uint head = qp_atomic_load(ring + QP_RB_HEAD);
    const uint rest = ring[QP_RB_CAPACITY] - head;
    uint skip = need > rest ? rest : 0u;
    const int wraps = need > rest, empty = ring_wait_for_room(ring, claimed, skip + need) == 0;
    qp_acquire();
    if (wraps) {
        if (empty) skip = 0; /* nothing of it is taken from anybody */
        head = 0;
        qp_atomic_add(ring + QP_RB_WRAPS, 1u);
        if (skip != 0) ring_count(ring + QP_RB_WASTED, skip);
    }
    p->points = points;
    p->first = head + guard;
    p->span = skip + need;
    qp_atomic_store(ring + QP_RB_HEAD, head + need);
    qp_atomic_store(ring + QP_RB_CLAIMED, claimed + p->span);
    ring_count(ring + QP_RB_ALLOCATED, points);
    ring_most(ring + QP_RB_PEAK,
              qp_atomic_load(ring + QP_RB_ALLOCATED) - qp_atomic_load(ring + QP_RB_RETURNED));
    ring_most(ring + QP_RB_MOST_IN_FLIGHT, p->ticket + 1u - qp_atomic_load(ring + QP_RB_ENDED));
    qp_release();
    qp_atomic_store(ring + QP_RB_TURN, p->ticket + 1u);
    ring_tick(ring, p->ticket, QP_TICK_ALLOCATED);
    ring_plant(ring, memory, point_words, *p);
}

/* Gives back the points of the oldest ticket. One caller at a time. */
QP_FUNCTION void ring_give_back(volatile __global uint *ring, uint ticket, uint span, uint points) {
    ring_tick(ring, ticket, QP_TICK_RETIRED);
    qp_atomic_store(ring + QP_RB_RETURNED, qp_atomic_load(ring + QP_RB_RETURNED) + points);
    qp_release();
    qp_atomic_store(ring + QP_RB_RELEASED, qp_atomic_load(ring + QP_RB_RELEASED) + span);
    qp_atomic_store(ring + QP_RB_RETIRED, ticket + 1u);
}

/* Gives back all that is done, oldest first. One group sweeps at a time; those that come meanwhile add to PENDING and leave, and who
 * sweeps takes off what it knew of and, if more is left, sweeps again: additions and subtractions of one word have one order, so that
 * either the sweeper sees the addition, and with it the record, or the group that adds finds 0 and sweeps itself. */
QP_FUNCTION void ring_sweep(volatile __global uint *ring) {
    uint seen = 1u;
    if (qp_atomic_add(ring + QP_RB_PENDING, 1u) != 0) return;
    do {
        qp_acquire();
        uint ticket = qp_atomic_load(ring + QP_RB_RETIRED);
        /* There is no record behind that of the last ticket. */
        const uint end = qp_atomic_load(ring + QP_RB_TICKET);
        for (; ticket != end; ++ticket) {
            volatile __global uint *record = ring_record(ring, ticket);
            const uint span = qp_atomic_load(record + QP_RECORD_SPAN);
            if (span == 0) break;
            qp_acquire();
            ring_give_back(ring, ticket, span - 1u, qp_atomic_load(record + QP_RECORD_POINTS));
        }
        qp_release();
        seen = qp_atomic_sub(ring + QP_RB_PENDING, seen) - seen;
    } while (seen != 0);
}

/* Are the canaries of p alive? */
QP_FUNCTION int ring_is_whole(volatile __global uint *ring, __global const uint *memory, uint point_words,
                              const ring_patch *p) {
    const uint guard = (ring[QP_RB_OPTIONS] & QP_RB_CANARIES) != 0 ? QP_RB_GUARD : 0u;
    uint dead = 0;
    for (uint i = 0; i < guard * point_words; ++i) {
        dead |= memory[(ulong)(p->first - guard) * point_words + i] ^ QP_RB_CANARY(p->ticket);
        dead |= memory[(ulong)(p->first + p->points) * point_words + i] ^ QP_RB_CANARY(p->ticket);
    }
    return dead == 0;
}

/* Reports p if they are not. */
QP_FUNCTION void ring_inspect(volatile __global uint *ring, __global const uint *memory, uint point_words,
                              const ring_patch *p) {
    if (ring_is_whole(ring, memory, point_words, p)) return;
    qp_atomic_add(ring + QP_RB_BROKEN, 1u);
    qp_atomic_store(ring + QP_RB_FIRST_BROKEN, p->ticket + 1u);
}

QP_FUNCTION void ring_retire(volatile __global uint *ring, __global const uint *memory, uint point_words,
                             const ring_patch *p) {
    ring_inspect(ring, memory, point_words, p);
    ring_tick(ring, p->ticket, QP_TICK_DONE);
    const uint options = ring[QP_RB_OPTIONS];
    volatile __global uint *record = ring_record(ring, p->ticket);
    if ((options & (QP_RB_IN_ORDER | QP_RB_TRACE)) != QP_RB_IN_ORDER)
        qp_atomic_store(record + QP_RECORD_POINTS, p->points);
    qp_release();
    if ((options & QP_RB_IN_ORDER) != 0) {
        for (uint round = 0; qp_atomic_load(ring + QP_RB_RETIRED) != p->ticket; ++round) qp_wait(round);
        qp_acquire();
        ring_give_back(ring, p->ticket, p->span, p->points);
    } else {
        qp_atomic_store(record + QP_RECORD_SPAN, p->span + 1u);
        ring_sweep(ring);
    }
    ring_give_slot(ring, p->slot);
    qp_atomic_add(ring + QP_RB_ENDED, 1u);
}

#endif
