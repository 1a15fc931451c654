/* The words of the ring buffer (section 8.1 of the paper), shared by host and kernels: first those of the ring itself, then a record
 * a patch, in the order in which patches are issued. The control points themselves lie in a buffer of their own. All are 32-bit words; a
 * count that may outgrow one takes two, low word first.
 *
 * Positions and sizes are in control points. The host writes all words before an evaluation: capacity and options, the rest 0. Launches
 * of one evaluation (batches) go on where the one before stopped, with the ring empty. */
#ifndef QP_RING_LAYOUT_H
#define QP_RING_LAYOUT_H

/* Read only. */
#define QP_RB_CAPACITY 0u /* points, QP_RB_MOST at most */
#define QP_RB_OPTIONS 1u
#define QP_RB_MOST 0x7fffffffu

#define QP_RB_IN_ORDER 1u /* retirement */
#define QP_RB_CANARIES 2u
#define QP_RB_TRACE 4u

/* What every patch reads and writes shares one line of a processor's cache, which moves twice a patch, when it begins and when it ends:
 * spread over several, each moved, it took 1 microsecond a patch more with two cores (bench/README.md).
 *
 * Tickets: the next one to be handed out; the one whose turn it is to allocate, so that all before it have; the oldest one that is not
 * retired. RETIRED <= TURN <= TICKET. */
#define QP_RB_TICKET 16u
#define QP_RB_TURN 17u
#define QP_RB_RETIRED 18u
/* Written by whoever has the turn. HEAD is where the next allocation begins, 0..CAPACITY; CLAIMED counts all points ever taken from the
 * ring, those skipped at its end included, modulo 2^32. */
#define QP_RB_HEAD 19u
#define QP_RB_CLAIMED 20u
#define QP_RB_ALLOCATED 21u      /* two words: points of patches alone */
#define QP_RB_PEAK 23u           /* of those, what had not been given back */
#define QP_RB_MOST_IN_FLIGHT 24u /* most patches that had points and had not ended */
/* Written by whoever retires, one at a time: points ever given back, as CLAIMED counts them, and as ALLOCATED does. What lies between is
 * not free: CLAIMED - RELEASED points that end at HEAD. */
#define QP_RB_RELEASED 25u
#define QP_RB_RETURNED 26u
/* Patches that are done and that nobody has looked after yet (out of order). */
#define QP_RB_PENDING 27u
#define QP_RB_ENDED 28u /* patches */

/* Seldom written, by whoever has the turn. */
#define QP_RB_STALLS 32u      /* allocations that had to wait for room */
#define QP_RB_STALL_TICKS 33u /* two words: how long, by the clock that kernels read, if any */
#define QP_RB_WRAPS 35u       /* times that HEAD went back to 0 */
#define QP_RB_WASTED 36u      /* two words: points skipped at the end of the ring */

/* Counted at any time where there is no turn (streamed). LIVE: points not given back; IN_FLIGHT: patches that have some. */
#define QP_RB_ALLOCATIONS 38u
#define QP_RB_LIVE 39u
#define QP_RB_IN_FLIGHT 40u

/* Written by all. */
#define QP_RB_EVENTS 48u       /* the clock of devices that have none which kernels can read */
#define QP_RB_BROKEN 49u       /* patches whose canaries were found dead */
#define QP_RB_FIRST_BROKEN 50u /* 1 + the ticket of one of them */

/* Which warp slots are taken, a bit each, for the trace. */
#define QP_RB_SLOTS 64u
#define QP_RB_SLOT_WORDS 32u
#define QP_RB_NO_SLOT 0xffffffffu /* all were taken */

#define QP_RB_WORDS 96u

/* A patch's record. All have the first two words; the rest is there with QP_RB_TRACE. */
/* 0, or, once it is done (out of order), 1 + the points it took from the ring, with what was skipped before them and its canaries. */
#define QP_RECORD_SPAN 0u
#define QP_RECORD_POINTS 1u /* when it is done */
#define QP_RECORD_SLOT 2u
#define QP_RECORD_TICKS 4u /* QP_TICK_* of two words each */
#define QP_RECORD_WORDS 2u
#define QP_RECORD_TRACE_WORDS 16u

#define QP_TICK_START 0u     /* has its ticket */
#define QP_TICK_ALLOCATED 1u /* has its points */
#define QP_TICK_HULLED 2u    /* they are made */
#define QP_TICK_DONE 3u      /* its last sample is written */
#define QP_TICK_RETIRED 4u   /* its points are free */

/* Points of the buffer before the ring, and after it, that are nobody's. */
#define QP_RB_MARGIN 16u

/* Canaries: so many points before and after those of every patch, filled with a word that depends on the ticket. */
#define QP_RB_GUARD 1u
#define QP_RB_CANARY(ticket) (0x7fa5c31du ^ (ticket))

#endif
