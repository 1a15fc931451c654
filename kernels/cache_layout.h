/* The cache of control points (section 8.2 of the paper) on a device, shared by host and kernels. All words are 32 bits.
 *
 *   numbers  the number of each patch's points (host/frame/unique.h), from QP_ENTRY_NUMBERS of its entry on
 *   control  QP_CACHE_WORDS words: sizes, and counters
 *   points   4 reals a place: a value as the hull has it before it moves it to a patch's origin
 *   tags     policy ALL: a word a number, QP_CACHE_EMPTY, _BUSY or _VALID; its place is the number.
 *            Bounded policies: two words a place, version and number + 1 (0: nothing); behind them a word a set, 3 bits a way of
 *            how often it is to be passed over, and in the highest 8 bits the way at which the hand points.
 *   seen     bounded policies: two words a number, its stamp in the shadow (below) and how many patches share it
 *
 * A place's version is odd while it is being written; every write adds 2. A number's set is number mod sets, its places
 * set * ways .. + ways - 1.
 *
 * Why a point missed, of the bounded policies: cold, when no evaluation has used it since its value last became unknown; else
 * conflict, when a fully associative cache of as many places, which throws out the oldest, would have had it; else capacity. That
 * shadow costs a stamp a point: NOW counts what is put into the shadow, a point's stamp is NOW when it was (from 1 on), and it is there
 * as long as NOW - stamp < places. With policy ALL every miss is cold. Work-groups that put the same point into the
 * shadow at once count it twice. */
#ifndef QP_CACHE_LAYOUT_H
#define QP_CACHE_LAYOUT_H

#define QP_CACHE_IS_ALL 0u /* policies, as qp_cache_policy of quadplan.h */
#define QP_CACHE_IS_DIRECT 1u
#define QP_CACHE_IS_CLOCK 2u
#define QP_CACHE_IS_SHARED 3u

/* Words of control; read only, then the shadow's clock, then counters of two words each, low word first. */
#define QP_CACHE_POLICY 0u
#define QP_CACHE_PLACES 1u
#define QP_CACHE_SETS 2u
#define QP_CACHE_WAYS 3u
#define QP_CACHE_NOW 16u
#define QP_CACHE_HITS 32u
#define QP_CACHE_COLD 34u
#define QP_CACHE_OVER 36u /* capacity */
#define QP_CACHE_CONFLICT 38u
#define QP_CACHE_DUPLICATES 40u
#define QP_CACHE_FILLED 42u  /* empty places that now hold a point */
#define QP_CACHE_DROPPED 44u /* the other way round, by cache_forget */
#define QP_CACHE_WORDS 48u

#define QP_CACHE_EMPTY 0u
#define QP_CACHE_BUSY 1u
#define QP_CACHE_VALID 2u

#define QP_CACHE_MOST_WAYS 8u
#define QP_CACHE_CHANCE(way) (3u * (way)) /* shift of a way's bits in the word of its set */
#define QP_CACHE_HAND 24u

/* Points that a work-group looks up before it computes what is missing, and numbers that one forgets. */
#define QP_CACHE_WINDOW 512u
#define QP_CACHE_FORGET 256u

#endif
