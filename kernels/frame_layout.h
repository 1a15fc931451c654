/* What a frame hands to the kernels, one entry a work-group: shared by host and kernels, as plan_layout.h is.
 * 64-bit values take two words, low word first. */
#ifndef QP_FRAME_LAYOUT_H
#define QP_FRAME_LAYOUT_H

#define QP_ENTRY_HEAD 0u     /* first word of the plan's head in heads */
#define QP_ENTRY_ROTATION 1u /* 0..3, see plan_layout.h */
#define QP_ENTRY_ROWS 2u     /* points to make: rows[level] of the plan */
#define QP_ENTRY_SAMPLES 3u  /* samples of this entry */
#define QP_ENTRY_RING 4u     /* 64 bits: first entry in rings */
#define QP_ENTRY_SUPPORT 6u  /* 64 bits: first point in the support buffer */
#define QP_ENTRY_GRID 8u     /* 64 bits: first (u,v) in the grid */
#define QP_ENTRY_OUT 10u     /* 64 bits: first sample in the vertex buffer */
#define QP_ENTRY_WORDS 16u   /* a cache line */

#define QP_ENTRY_WIDE(e, word) ((ulong)(e)[word] | (ulong)(e)[(word) + 1u] << 32)

/* Bits of a sample's flags, as QP_SAMPLE_* of quadplan.h. */
#define QP_FLAG_PAST_DEPTH 1u
#define QP_FLAG_NO_NORMAL 2u

/* Elements that may be read, and are ignored, behind the end of reals and of the grid. */
#define QP_PADDING 16u

#endif
