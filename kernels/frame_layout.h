/* What a frame hands to the kernels, one entry a work-group: shared by host and kernels, as plan_layout.h is.
 * 64-bit values take two words, low word first. */
#ifndef QP_FRAME_LAYOUT_H
#define QP_FRAME_LAYOUT_H

#define QP_ENTRY_HEAD 0u     /* first word of the plan's head in heads */
#define QP_ENTRY_ROTATION 1u /* 0..3, see plan_layout.h */
#define QP_ENTRY_ROWS 2u     /* points to make, of the plan's */
#define QP_ENTRY_SAMPLES 3u  /* samples of this entry */
#define QP_ENTRY_RING 4u     /* 64 bits: first word in rings, see below */
#define QP_ENTRY_SUPPORT 6u  /* 64 bits: first point in the support buffer */
#define QP_ENTRY_GRID 8u     /* 64 bits: first (u,v) in the grid */
#define QP_ENTRY_OUT 10u     /* 64 bits: first sample in the vertex buffer */
#define QP_ENTRY_LEVEL 12u   /* the level of the patch's tessellation */
#define QP_ENTRY_ORIGIN 13u  /* base vertex that the patch is relative to */
#define QP_ENTRY_NUMBERS 14u /* 64 bits: where the numbers of its points begin, or QP_NO_NUMBERS (cache_layout.h) */
#define QP_ENTRY_WORDS 16u   /* a cache line */
#define QP_NO_NUMBERS 0xffffffffffffffffu

#define QP_ENTRY_WIDE(e, word) ((ulong)(e)[word] | (ulong)(e)[(word) + 1u] << 32)

/* A patch whose plan has a ring of N vertices has 2 N + 4 words in rings: the N vertices in the plan's order; their places 0..N-1 in that
 * order, sorted as the hull adds them up (host/frame/rings.c), with QP_RING_PART set where a partial sum begins; and the vertices that
 * are the anchors of the plan's corners 0..3. */
#define QP_RING_WORDS(n) (2u * (n) + 4u)
#define QP_RING_PART 0x80000000u
#define QP_RING_PLACE(word) ((word)&0x7fffffffu)

/* Bits of a sample's flags, as QP_SAMPLE_* of quadplan.h. */
#define QP_FLAG_PAST_DEPTH 1u
#define QP_FLAG_NO_NORMAL 2u
#define QP_FLAG_LIMIT_FRAME 4u

/* The positions buffer begins with the frame that all positions are relative to, and then holds 3 reals a vertex: a vertex at x,
 * in the mesh's own coordinates, is stored as (x - centre) / scale. centre is 0 unless the mesh is far from the origin, scale is a
 * power of two near the mesh's size, so that nothing overflows or vanishes on the way and a mesh that is small and far away
 * keeps its digits. A float alone may be many times the mesh's size away from its middle, so centre is the sum of two reals. */
#define QP_POSITION_CENTRE 0u /* 3 reals */
#define QP_POSITION_SCALE 3u
#define QP_POSITION_REST 4u  /* 3 reals to add to centre */
#define QP_POSITION_FIRST 8u /* first real of vertex 0 */

/* A coordinate x of a (u,v) is held by its distance to the nearer end of [0,1]: x up to 1/2 as it is, beyond as x - 1, with -0 for
 * 1, so that the sign bit tells the end. Turning a patch (x becomes 1 - x) flips the sign, and going down the quadtree doubles:
 * both exact for every number of the format, however close to an end. 1/2 is always positive. */

/* Elements that may be read, and are ignored, behind the end of reals and of the grid. */
#define QP_PADDING 16u

#endif
