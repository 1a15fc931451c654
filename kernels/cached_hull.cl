/* Hull stage with a cache of control points (section 8.2 of the paper): one patch a work-group, as hull.cl; points that the cache has are
 * copied, the others computed by the same operations and put into the cache. Layout and counters: cache_layout.h.
 *
 * Races. Work-groups share the words of tags, points, seen and control; all of them are read and written as whole
 * words (qp_word_load, qp_word_store) or by atomics. No work-group waits for another.
 * - Values: that of a point has the same bits whoever computes it, for as long as a launch lasts. So it does not matter who puts it in,
 *   nor how often it is computed; what must not happen is to read another point's words, or words half written.
 * - Policy ALL: a place belongs to one number. Only the one work-item that swaps EMPTY for BUSY writes to it, and stores VALID after its
 *   words; VALID never changes during a launch, and who reads it finds them complete.
 * - Bounded policies: to write to a place a work-item swaps its even version for the odd one above; it then alone writes number and
 *   words, and stores the next even version after them. A reader takes an even version, then the number, then the words, then
 *   the version again. If any of those words was written later than the first version, so was the odd version before it,
 *   and the second look finds the odd version or one above: equal versions mean that all was read from one writing. (Versions come back
 *   to the same number after 2^31 writes, more than a launch has points.) A reader who finds different ones has missed.
 * - A point may lie in two places of its set, if two work-groups put it in at once: both are right. Chances, hand and stamps are only
 *   advice: an update that is lost costs a hit at most. */

/* Bits of a point's fate, one mask of lanes each, kept from look-up to computation. */
typedef struct QP_NAME(cache_fate) {
    uint missed, cold, conflict, duplicate, filled;
} QP_NAME(cache_fate);

typedef union QP_NAME(cache_value) {
    real r[4];
    uint w[sizeof(real)];
} QP_NAME(cache_value);

typedef struct QP_NAME(cache) {
    volatile __global uint *control, *tags, *seen, *points;
    uint policy, places, sets, ways;
} QP_NAME(cache);

QP_FUNCTION void QP_NAME(cache_of)(volatile __global uint *control, volatile __global uint *tags,
                                   volatile __global uint *points, volatile __global uint *seen, QP_NAME(cache) * c) {
    c->control = control;
    c->tags = tags;
    c->points = points;
    c->seen = seen;
    c->policy = control[QP_CACHE_POLICY];
    c->places = control[QP_CACHE_PLACES];
    c->sets = control[QP_CACHE_SETS];
    c->ways = control[QP_CACHE_WAYS];
}

QP_FUNCTION void QP_NAME(cache_read)(const QP_NAME(cache) * c, ulong place, QP_NAME(cache_value) * value) {
    for (uint k = 0; k < sizeof(real); ++k) value->w[k] = qp_word_load(c->points + place * sizeof(real) + k);
}

QP_FUNCTION void QP_NAME(cache_write)(const QP_NAME(cache) * c, ulong place, const QP_NAME(cache_value) * value) {
    for (uint k = 0; k < sizeof(real); ++k) qp_word_store(c->points + place * sizeof(real) + k, value->w[k]);
}

QP_FUNCTION uint QP_NAME(cache_chance)(uint state, uint way) {
    return state >> QP_CACHE_CHANCE(way) & 7u;
}

/* A way of a set was hit. */
QP_FUNCTION void QP_NAME(cache_touch)(const QP_NAME(cache) * c, uint set, uint way) {
    if (c->policy == QP_CACHE_IS_DIRECT) return;
    volatile __global uint *word = c->tags + 2u * (ulong)c->places + set;
    const uint state = qp_word_load(word), chance = QP_NAME(cache_chance)(state, way);
    if (c->policy == QP_CACHE_IS_CLOCK) {
        if (chance == 0u) qp_word_store(word, state | 1u << QP_CACHE_CHANCE(way));
    } else if (chance != 0u) { /* one patch less that will ask for it */
        qp_word_store(word, state - (1u << QP_CACHE_CHANCE(way)));
    }
}

/* Is a point there? Then its value is in *value. */
QP_FUNCTION int QP_NAME(cache_find)(const QP_NAME(cache) * c, uint number, QP_NAME(cache_value) * value) {
    if (c->policy == QP_CACHE_IS_ALL) {
        if (qp_word_load(c->tags + number) != QP_CACHE_VALID) return 0;
        qp_acquire();
        QP_NAME(cache_read)(c, number, value);
        return 1;
    }
    if (c->sets == 0u) return 0;
    const uint set = number % c->sets;
    for (uint way = 0; way < c->ways; ++way) {
        const ulong place = (ulong)set * c->ways + way;
        volatile __global uint *tag = c->tags + 2u * place;
        if (qp_word_load(tag + 1) != number + 1u) continue;
        const uint version = qp_word_load(tag);
        qp_acquire();
        const int same = qp_word_load(tag + 1) == number + 1u;
        QP_NAME(cache_read)(c, place, value);
        qp_acquire();
        if ((version & 1u) == 0u && same && qp_word_load(tag) == version) {
            QP_NAME(cache_touch)(c, set, way);
            return 1;
        }
    }
    return 0;
}

/* The way of a set that a point with so many chances is to have, or QP_CACHE_MOST_WAYS: an empty one, else the one that is to go
 * (generalised clock: A. J. Smith, "Sequentiality and prefetching in database systems", ACM TODS 3(3), 1978): the hand passes over those
 * that have chances left, and takes one from each. Policy SHARED: a point has as many chances as other patches are to ask for it, and
 * uses them up as they do; one that nobody else asks for drives nobody out. */
QP_FUNCTION uint QP_NAME(cache_victim)(const QP_NAME(cache) * c, uint set, uint chances) {
    if (c->ways == 1u) return 0;
    volatile __global uint *word = c->tags + 2u * (ulong)c->places + set;
    uint state = qp_word_load(word), way = (state >> QP_CACHE_HAND) % c->ways;
    int empty = 0;
    for (uint w = 0; w < c->ways && !empty; ++w) {
        if (qp_word_load(c->tags + 2u * ((ulong)set * c->ways + w) + 1u) != 0u) continue;
        way = w;
        empty = 1;
    }
    if (!empty) {
        if (chances == 0u) return QP_CACHE_MOST_WAYS;
        while (QP_NAME(cache_chance)(state, way) != 0u) {
            state -= 1u << QP_CACHE_CHANCE(way);
            way = way + 1u == c->ways ? 0u : way + 1u;
        }
        state = (state & ((1u << QP_CACHE_HAND) - 1u)) | (way + 1u) << QP_CACHE_HAND;
    }
    state = (state & ~(7u << QP_CACHE_CHANCE(way))) | chances << QP_CACHE_CHANCE(way);
    qp_word_store(word, state);
    return way;
}

/* Puts a point in that was not there, and tells in *fate, as bit `lane`, what became of it. */
QP_FUNCTION void QP_NAME(cache_insert)(const QP_NAME(cache) * c, uint number, const QP_NAME(cache_value) * value, uint lane,
                                       QP_NAME(cache_fate) * fate) {
    if (c->policy == QP_CACHE_IS_ALL) {
        if (!qp_atomic_swap(c->tags + number, QP_CACHE_EMPTY, QP_CACHE_BUSY)) {
            fate->duplicate |= lane;
            return;
        }
        QP_NAME(cache_write)(c, number, value);
        qp_release();
        qp_atomic_store(c->tags + number, QP_CACHE_VALID);
        fate->filled |= lane;
        return;
    }
    if (c->sets == 0u) return;
    const uint set = number % c->sets;
    uint chances = 1u;
    if (c->policy == QP_CACHE_IS_SHARED) {
        const uint shares = qp_word_load(c->seen + 2u * (ulong)number + 1u);
        chances = shares > 8u ? 7u : shares - 1u;
    }
    for (uint way = 0; way < c->ways; ++way) {
        if (qp_word_load(c->tags + 2u * ((ulong)set * c->ways + way) + 1u) != number + 1u) continue;
        fate->duplicate |= lane;
        return;
    }
    const uint way = QP_NAME(cache_victim)(c, set, chances);
    if (way == QP_CACHE_MOST_WAYS) return;
    const ulong place = (ulong)set * c->ways + way;
    volatile __global uint *tag = c->tags + 2u * place;
    const uint version = qp_word_load(tag);
    if ((version & 1u) != 0u || !qp_atomic_swap(tag, version, version + 1u)) return; /* somebody writes there already */
    qp_release();
    if (qp_word_load(tag + 1) == 0u) fate->filled |= lane;
    qp_word_store(tag + 1, number + 1u);
    QP_NAME(cache_write)(c, place, value);
    qp_release();
    qp_atomic_store(tag, version + 2u);
}

/* Asks the shadow for a point, puts it in where it is not, and sorts a miss. */
QP_FUNCTION void QP_NAME(cache_shadow)(const QP_NAME(cache) * c, uint number, int hit, uint lane,
                                       QP_NAME(cache_fate) * fate) {
    if (c->policy == QP_CACHE_IS_ALL) {
        if (!hit) fate->cold |= lane;
        return;
    }
    volatile __global uint *stamp = c->seen + 2u * (ulong)number;
    const uint then = qp_word_load(stamp), now = qp_word_load(c->control + QP_CACHE_NOW);
    if (then == 0u && !hit) fate->cold |= lane;
    if (then != 0u && now - then < c->places) {
        if (!hit) fate->conflict |= lane;
    } else {
        qp_word_store(stamp, qp_atomic_add(c->control + QP_CACHE_NOW, 1u) + 1u);
    }
}

QP_FUNCTION void QP_NAME(cache_count)(const QP_NAME(cache) * c, uint counter, uint n) {
    if (n == 0u) return;
    const uint before = qp_atomic_add(c->control + counter, n);
    if (before + n < before) (void)qp_atomic_add(c->control + counter + 1u, 1u);
}

/* Looks up `count` points from number i of the patch on. */
QP_FUNCTION void QP_NAME(cache_look_up)(const QP_NAME(cache) * c, const QP_NAME(hull_job) * job,
                                        __global const uint *numbers, uint i, uint count,
                                        QP_NAME(cache_fate) * fate, __global real *out) {
    fate->missed = fate->cold = fate->conflict = fate->duplicate = fate->filled = 0u;
    for (uint l = 0; l < count; ++l) {
        QP_NAME(cache_value) value;
        const int hit = QP_NAME(cache_find)(c, numbers[i + l], &value);
        QP_NAME(cache_shadow)(c, numbers[i + l], hit, 1u << l, fate);
        if (hit)
            QP_NAME(hull_write)(job, i + l, value.r[0], value.r[1], value.r[2], value.r[3], out);
        else
            fate->missed |= 1u << l;
    }
}

/* Writes the points of a block that were missing, and puts them into the cache. */
QP_FUNCTION void QP_NAME(cache_add)(const QP_NAME(cache) * c, const QP_NAME(hull_job) * job, __global const uint *numbers, uint i,
                                    const QP_NAME(hull_block) * b, QP_NAME(cache_fate) * fate, __global real *out) {
    real x[3][QP_LANES];
    QP_NAME(hull_finish)(b, x);
    for (uint l = 0; l < QP_LANES; ++l) {
        if ((fate->missed >> l & 1u) == 0u) continue;
        QP_NAME(cache_value) value;
        for (uint k = 0; k < 3u; ++k) value.r[k] = x[k][l];
        value.r[3] = QP_NAME(hull_share)(job, i + l);
        QP_NAME(hull_write)(job, i + l, value.r[0], value.r[1], value.r[2], value.r[3], out);
        QP_NAME(cache_insert)(c, numbers[i + l], &value, 1u << l, fate);
    }
}

/* Computes what is missing of the `count` points from number `first` on, block by block as hull_patch does; the ring is in local
 * memory already if it fits. */
QP_FUNCTION void QP_NAME(cache_compute)(const QP_NAME(cache) * c, const QP_NAME(hull_job) * job,
                                        __global const uint *numbers, uint first, uint count,
                                        __local QP_NAME(cache_fate) * fates, __global real *out,
                                        __local real *ring_x, __local real *ring_y, __local real *ring_z) {
    const uint item = (uint)get_local_id(0) * QP_LANES, step = (uint)get_local_size(0) * QP_LANES;
    QP_NAME(hull_block) b;
    if (job->ring_size <= QP_HULL_CHUNK) {
        for (uint i = item; i < count; i += step) {
            if (fates[i / QP_LANES].missed == 0u) continue;
            QP_NAME(cache_fate) fate = fates[i / QP_LANES];
            QP_NAME(hull_start)(job, first + i, count - i < QP_LANES ? count - i : QP_LANES, &b);
            QP_NAME(hull_add)(job, first + i, 0, job->ring_size, ring_x, ring_y, ring_z, &b);
            QP_NAME(cache_add)(c, job, numbers, first + i, &b, &fate, out);
            fates[i / QP_LANES] = fate;
        }
        return;
    }
    for (uint at = 0; at < count; at += step) {
        const uint i = at + item;
        QP_NAME(cache_fate) fate = {0u, 0u, 0u, 0u, 0u};
        if (i < count) fate = fates[i / QP_LANES];
        if (fate.missed != 0u) QP_NAME(hull_start)(job, first + i, count - i < QP_LANES ? count - i : QP_LANES, &b);
        for (uint begin = 0; begin < job->ring_size; begin += QP_HULL_CHUNK) {
            const uint vertices = job->ring_size - begin < QP_HULL_CHUNK ? job->ring_size - begin : QP_HULL_CHUNK;
            barrier(CLK_LOCAL_MEM_FENCE);
            QP_NAME(hull_load)(job, begin, vertices, ring_x, ring_y, ring_z);
            barrier(CLK_LOCAL_MEM_FENCE);
            if (fate.missed != 0u) QP_NAME(hull_add)(job, first + i, begin, vertices, ring_x, ring_y, ring_z, &b);
        }
        if (fate.missed != 0u) QP_NAME(cache_add)(c, job, numbers, first + i, &b, &fate, out);
        if (i < count) fates[i / QP_LANES] = fate;
    }
}

__kernel void QP_NAME(cached_hull)(__global const uint *heads, __global const uint *trees, __global const real *reals,
                                   __global const uint *rings, __global const real *positions,
                                   __global const uint *entries, uint first_entry, __global const uint *all_numbers,
                                   volatile __global uint *control, volatile __global uint *tags,
                                   volatile __global uint *points, volatile __global uint *seen,
                                   __global real *support QP_GROUP) {
    __local real ring_x[QP_HULL_CHUNK];
    __local real ring_y[QP_HULL_CHUNK];
    __local real ring_z[QP_HULL_CHUNK];
    __local QP_NAME(cache_fate) fates[QP_CACHE_WINDOW / QP_LANES];
    __local uint any;
    __global const uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    __global real *out = support + 4u * QP_ENTRY_WIDE(entry, QP_ENTRY_SUPPORT);
    QP_NAME(hull_job) job;
    QP_NAME(hull_job_of)(heads, trees, reals, rings, positions, entry, &job);
    QP_NAME(cache) c;
    QP_NAME(cache_of)(control, tags, points, seen, &c);
    const uint rows = entry[QP_ENTRY_ROWS], item = (uint)get_local_id(0), items = (uint)get_local_size(0);
    const ulong first_number = QP_ENTRY_WIDE(entry, QP_ENTRY_NUMBERS);
    uint hits = 0u, cold = 0u, over = 0u, conflict = 0u, duplicates = 0u, filled = 0u;
    if (first_number == QP_NO_NUMBERS) { /* the same for all items: a regular patch, whose points are no stencils */
        QP_NAME(hull_patch)(heads, trees, reals, rings, positions, entry, rows, out, ring_x, ring_y, ring_z);
        if (item == 0u) QP_NAME(cache_count)(&c, QP_CACHE_COLD, rows);
        return;
    }
    __global const uint *numbers = all_numbers + first_number;
    for (uint first = 0; first < rows; first += QP_CACHE_WINDOW) {
        const uint count = rows - first < QP_CACHE_WINDOW ? rows - first : QP_CACHE_WINDOW;
        const uint blocks = (count + QP_LANES - 1u) / QP_LANES;
        if (item == 0u) any = 0u;
        barrier(CLK_LOCAL_MEM_FENCE);
        for (uint b = item; b < blocks; b += items) {
            const uint i = b * QP_LANES;
            QP_NAME(cache_fate) fate;
            QP_NAME(cache_look_up)(&c, &job, numbers, first + i, count - i < QP_LANES ? count - i : QP_LANES, &fate, out);
            fates[b] = fate;
            if (fate.missed != 0u) (void)qp_local_add(&any, 1u);
        }
        barrier(CLK_LOCAL_MEM_FENCE);
        if (any != 0u) {
            if (job.ring_size <= QP_HULL_CHUNK) QP_NAME(hull_load)(&job, 0, job.ring_size, ring_x, ring_y, ring_z);
            barrier(CLK_LOCAL_MEM_FENCE);
            QP_NAME(cache_compute)(&c, &job, numbers, first, count, fates, out, ring_x, ring_y, ring_z);
        }
        barrier(CLK_LOCAL_MEM_FENCE);
        uint missed = 0u;
        for (uint b = 0; b < blocks && item == 0u; ++b) {
            if (fates[b].missed == 0u) continue;
            missed += qp_popcount(fates[b].missed);
            cold += qp_popcount(fates[b].cold);
            conflict += qp_popcount(fates[b].conflict);
            duplicates += qp_popcount(fates[b].duplicate);
            filled += qp_popcount(fates[b].filled);
        }
        hits += count - missed;
        over += missed;
    }
    if (item != 0u) return;
    over -= cold + conflict;
    QP_NAME(cache_count)(&c, QP_CACHE_HITS, hits);
    QP_NAME(cache_count)(&c, QP_CACHE_COLD, cold);
    QP_NAME(cache_count)(&c, QP_CACHE_OVER, over);
    QP_NAME(cache_count)(&c, QP_CACHE_CONFLICT, conflict);
    QP_NAME(cache_count)(&c, QP_CACHE_DUPLICATES, duplicates);
    QP_NAME(cache_count)(&c, QP_CACHE_FILLED, filled);
}

/* Forgets `count` points, whose numbers are in `list`, QP_CACHE_FORGET a work-group. Not to run beside cached_hull. */
__kernel void QP_NAME(cache_forget)(__global const uint *list, uint count, volatile __global uint *control,
                                    volatile __global uint *tags, volatile __global uint *seen QP_GROUP) {
    QP_NAME(cache) c;
    QP_NAME(cache_of)(control, tags, tags, seen, &c);
    const uint first = (uint)get_group_id(0) * QP_CACHE_FORGET;
    const uint end = count - first < QP_CACHE_FORGET ? count : first + QP_CACHE_FORGET;
    uint dropped = 0u;
    for (uint k = first + (uint)get_local_id(0); k < end; k += (uint)get_local_size(0)) {
        const uint number = list[k];
        if (c.policy == QP_CACHE_IS_ALL) {
            dropped += qp_word_load(tags + number) == QP_CACHE_VALID;
            qp_word_store(tags + number, QP_CACHE_EMPTY);
            continue;
        }
        qp_word_store(seen + 2u * (ulong)number, 0u);
        for (uint way = 0; way < c.ways && c.sets != 0u; ++way) {
            volatile __global uint *tag = tags + 2u * ((ulong)(number % c.sets) * c.ways + way) + 1u;
            if (qp_word_load(tag) != number + 1u) continue;
            qp_word_store(tag, 0u);
            ++dropped;
        }
    }
    QP_NAME(cache_count)(&c, QP_CACHE_DROPPED, dropped);
}
