/* Domain stage: position and normal at every sample of one patch a work-group (section 6 of the paper).
 *
 * Each work-item strides over the samples; for each it walks the plan's quadtree from the root to the leaf
 * that holds (u,v), which doubles exactly on the way, and evaluates the leaf from the control points that the
 * hull stage has made. */

/* One of the points of a node: 16-bit index number k of the words at `words`. */
#define QP_POINT(words, k) support[((words)[(k) >> 1] >> (((k)&1u) << 4)) & 0xffffu]

/* One row of points, two a word. */
QP_FUNCTION void QP_NAME(add_words)(__global const real4 *support, __global const uint *words, int first,
                                    const real bu[4], const real du[4], real bv, real dv,
                                    QP_NAME(surface_point) * s) {
    const uint left = words[0], right = words[1];
    QP_NAME(add_row)
    (s, first, support[left & 0xffffu], support[left >> 16], support[right & 0xffffu], support[right >> 16],
     bu, du, bv, dv);
}

/* 16 points, row-major, with the row weights given. */
QP_FUNCTION void QP_NAME(spline_grid)(__global const real4 *support, __global const uint *words,
                                      const real bu[4], const real du[4], const real bv[4], const real dv[4],
                                      QP_NAME(surface_point) * s) {
    QP_NAME(add_words)(support, words, 1, bu, du, bv[0], dv[0], s);
    QP_NAME(add_words)(support, words + 2, 0, bu, du, bv[1], dv[1], s);
    QP_NAME(add_words)(support, words + 4, 0, bu, du, bv[2], dv[2], s);
    QP_NAME(add_words)(support, words + 6, 0, bu, du, bv[3], dv[3], s);
}

/* Leaves are evaluated with derivatives of order `orders` in place of the position: bit 0 is for u, bit 1 for v. 0, the position
 * itself, makes samples; the others serve normals where du and dv are parallel (spline.h). */

QP_FUNCTION void QP_NAME(add_origin)(__global const real4 *support, uint origin, uint orders,
                                     QP_NAME(surface_point) * s) {
    if (origin != QP_NO_POINT && orders == 0) s->p = add4(support[origin], s->p);
}

QP_FUNCTION void QP_NAME(eval_regular)(__global const real4 *support, __global const uint *node, real u,
                                       real v, uint orders, QP_NAME(surface_point) * s) {
    real bu[4], du[4], bv[4], dv[4];
    QP_NAME(basis_of_order)(orders & 1u, QP_NAME(plain)(u), bu, du);
    QP_NAME(basis_of_order)(orders >> 1, QP_NAME(plain)(v), bv, dv);
    QP_NAME(spline_grid)(support, node + 2, bu, du, bv, dv, s);
    QP_NAME(add_origin)(support, node[1], orders, s);
}

#if QP_WITH_CREASE
/* A single semi-sharp crease along v=0: across it the basis is that of the zone v lies in, times its matrix
 * (section 4.3; plan_layout.h). */
QP_FUNCTION void QP_NAME(eval_crease)(__global const real4 *support, __global const uint *node,
                                      __global const real *constants, real u, real signed_v, uint orders,
                                      QP_NAME(surface_point) * s) {
    real bu[4], du[4], b[4], d[4], bv[4], dv[4];
    const real v = QP_NAME(plain)(signed_v);
    const uint zone = v >= constants[0] ? 0u : v >= constants[1] ? 1u : 2u;
    const real scale = constants[2u + zone];
    __global const real *m = constants + 5u + 16u * zone;
    QP_NAME(basis_of_order)(orders & 1u, QP_NAME(plain)(u), bu, du);
    QP_NAME(basis_of_order)(orders >> 1, v * scale, b, d);
    for (uint j = 0; j < 4u; ++j) {
        bv[j] = fma(b[3], m[12u + j], fma(b[2], m[8u + j], fma(b[1], m[4u + j], b[0] * m[j])));
        dv[j] = scale * fma(d[3], m[12u + j], fma(d[2], m[8u + j], fma(d[1], m[4u + j], d[0] * m[j])));
        if ((orders >> 1) != 0) {
            bv[j] *= scale;
            dv[j] *= scale;
        }
    }
    QP_NAME(spline_grid)(support, node + 2, bu, du, bv, dv, s);
    QP_NAME(add_origin)(support, node[1], orders, s);
}
#endif

#if QP_WITH_TERMINAL
/* How large a ring's points are, from what they give. */
QP_FUNCTION real QP_NAME(size_of)(const QP_NAME(surface_point) * s) {
    const real x = fabs(s->p.x) + fabs(s->du.x) + fabs(s->dv.x), y = fabs(s->p.y) + fabs(s->du.y) + fabs(s->dv.y);
    return x + y + (fabs(s->p.z) + fabs(s->du.z) + fabs(s->dv.z));
}

/* Adds what points hold of a mode to what was made of the rest of them. Instead of du and dv both with their shares, which may leave
 * nothing else of them, one goes without and is turned aside by the other (host/plan/mode.c, where that is derived). */
QP_FUNCTION void QP_NAME(add_mode)(real4 mode, uint orders, QP_NAME(surface_point) * s) {
    const real wu = s->du.w, wv = s->dv.w;
    s->p = fma4(mode, s->p.w, s->p);
    if (orders != 0) {
        s->du = fma4(mode, wu, s->du);
        s->dv = fma4(mode, wv, s->dv);
    } else if (fabs(wu) >= fabs(wv)) {
        if (wu == QP_R(0.0)) return;
        s->skew_v = qp_div(wv, wu);
        s->dv = fma4(s->du, -s->skew_v, s->dv);
        s->du = fma4(mode, wu, s->du);
    } else {
        s->skew_u = qp_div(wu, wv);
        s->du = fma4(s->dv, -s->skew_u, s->du);
        s->dv = fma4(mode, wv, s->dv);
    }
}

/* One row of points from number `slot` on. */
QP_FUNCTION void QP_NAME(add_slots)(__global const real4 *support, __global const uint *ring, uint slot,
                                    int first, const real bu[4], const real du[4], real bv, real dv,
                                    QP_NAME(surface_point) * s) {
    QP_NAME(add_row)
    (s, first, QP_POINT(ring, slot), QP_POINT(ring, slot + 1u), QP_POINT(ring, slot + 2u),
     QP_POINT(ring, slot + 3u), bu, du, bv, dv);
}

/* One of the three regular sub-domains of a terminal node's ring level: (u,v) with u >= 1/2 or v >= 1/2. Leaves the
 * origin out. */
QP_FUNCTION void QP_NAME(eval_ring)(__global const real4 *support, __global const uint *ring, real u, real v,
                                    uint orders, QP_NAME(surface_point) * s) {
    real bu[4], du[4], bv[4], dv[4];
    const uint cx = QP_NAME(is_upper)(u, 1u), cy = QP_NAME(is_upper)(v, 1u);
    const uint slot = 5u * cy + cx - 1u;
    QP_NAME(basis_of_order)(orders & 1u, QP_NAME(plain)(QP_NAME(in_half)(u, cx)), bu, du);
    QP_NAME(basis_of_order)(orders >> 1, QP_NAME(plain)(QP_NAME(in_half)(v, cy)), bv, dv);
    s->level += 1;
    QP_NAME(add_slots)(support, ring, slot, 1, bu, du, bv[0], dv[0], s);
    QP_NAME(add_slots)(support, ring, slot + 5u, 0, bu, du, bv[1], dv[1], s);
    QP_NAME(add_slots)(support, ring, slot + 10u, 0, bu, du, bv[2], dv[2], s);
    QP_NAME(add_slots)(support, ring, slot + 15u, 0, bu, du, bv[3], dv[3], s);
}
#endif

#if QP_WITH_CORNERS
/* Limit position and tangents, three points from number k on. */
QP_FUNCTION void QP_NAME(eval_limit)(__global const real4 *support, __global const uint *words, uint k,
                                     QP_NAME(surface_point) * s) {
    s->p = QP_POINT(words, k);
    const uint t1 = (words[(k + 1u) >> 1] >> (((k + 1u) & 1u) << 4)) & 0xffffu;
    const uint t2 = (words[(k + 2u) >> 1] >> (((k + 2u) & 1u) << 4)) & 0xffffu;
    if (t1 == QP_NO_POINT || t2 == QP_NO_POINT) {
        s->du = s->dv = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
    } else {
        s->du = support[t1];
        s->dv = support[t2];
    }
    s->level = 0;
    s->flags |= QP_FLAG_LIMIT_FRAME;
}

/* A leaf with four corners known: exact there, and a bilinear blend, flagged, elsewhere. */
QP_FUNCTION void QP_NAME(eval_irregular)(__global const real4 *support, __global const uint *node, real u,
                                         real v, QP_NAME(surface_point) * s) {
    __global const uint *words = node + 1;
    u = QP_NAME(plain)(u);
    v = QP_NAME(plain)(v);
    if ((u == QP_R(0.0) || u == QP_R(1.0)) && (v == QP_R(0.0) || v == QP_R(1.0))) {
        const uint corner = v == QP_R(0.0) ? (u == QP_R(0.0) ? 0u : 1u) : (u == QP_R(0.0) ? 3u : 2u);
        QP_NAME(eval_limit)(support, words, 3u * corner, s);
        return;
    }
    const real4 p00 = QP_POINT(words, 0u), p10 = QP_POINT(words, 3u);
    const real4 p11 = QP_POINT(words, 6u), p01 = QP_POINT(words, 9u);
    const real4 low = sub4(p10, p00), high = sub4(p11, p01);
    const real4 low_p = fma4(low, u, p00), high_p = fma4(high, u, p01);
    s->dv = sub4(high_p, low_p);
    s->du = fma4(sub4(high, low), v, low);
    s->p = fma4(s->dv, v, low_p);
    s->flags |= QP_FLAG_PAST_DEPTH;
}
#endif

#if QP_WITH_CORNERS && QP_WITH_TERMINAL
/* What remains at an extraordinary corner (0,0): exact there; elsewhere the doubling goes on in the terminal's last ring, by whose
 * ratio everything shrinks a level (plan_layout.h). `shrink` scales that ring's points; `rings` is their number and that of the levels before them. */
QP_FUNCTION void QP_NAME(eval_extraordinary)(__global const real4 *support, __global const uint *node,
                                             __global const real *constants, __global const uint *ring,
                                             uint rings, uint origin, real shrink, real u, real v,
                                             uint orders, QP_NAME(surface_point) * s) {
    /* Points 0..2 are 16-bit values in a word each. */
    const real4 limit = support[node[1]];
    if ((u == QP_R(0.0) && v == QP_R(0.0)) || ring == 0) {
        s->p = limit;
        if (node[2] == QP_NO_POINT || node[3] == QP_NO_POINT) {
            s->du = s->dv = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
        } else {
            s->du = support[node[2]];
            s->dv = support[node[3]];
        }
        s->level = 0;
        s->flags |= QP_FLAG_LIMIT_FRAME;
        if (u != QP_R(0.0) || v != QP_R(0.0)) s->flags |= QP_FLAG_PAST_DEPTH;
        return;
    }
    /* Ends, for coordinates are 0 or normal numbers. */
    const real ratio = constants[node[4]];
    shrink *= ratio;
    s->stretch = QP_R(2.0) * ratio;
    while (QP_NAME(is_upper)(u, 1u) == 0 && QP_NAME(is_upper)(v, 1u) == 0) {
        u = QP_NAME(in_half)(u, 0u);
        v = QP_NAME(in_half)(v, 0u);
        shrink *= ratio;
        s->stretch *= QP_R(2.0) * ratio;
    }
    /* Back to the level of the last ring, and what its points are scaled by. */
    s->level -= origin == QP_NO_POINT ? 1 : (int)rings;
    QP_NAME(eval_ring)(support, ring, u, v, orders, s);
    if (orders == 0 && origin != QP_NO_POINT) s->size = QP_NAME(size_of)(s);
    if (node[5] != QP_NO_POINT) QP_NAME(add_mode)(support[node[5]], orders, s);
    if (orders == 0) {
        if (origin == QP_NO_POINT) s->p = sub4(s->p, limit);
        s->p = fma4(s->p, shrink, limit);
    }
    if ((node[0] & QP_NODE_EXACT) == 0) s->flags |= QP_FLAG_PAST_DEPTH;
}
#endif

/* The leaf of (u,v), evaluated; s->turn is how (u,v) was turned before. */
QP_FUNCTION void QP_NAME(eval_tree)(__global const uint *tree, __global const real *constants,
                                    __global const real4 *support, real u, real v, uint orders,
                                    QP_NAME(surface_point) * s) {
    __global const uint *node = tree;
#if QP_WITH_TERMINAL && QP_WITH_CORNERS
    __global const uint *last_ring = 0;
    uint last_origin = QP_NO_POINT, last_rings = 0;
    real last_shrink = QP_R(1.0);
#endif
    s->flags = 0;
    s->level = 0;
    s->stretch = QP_R(1.0);
    s->skew_u = s->skew_v = QP_R(0.0);
    s->size = QP_R(-1.0);
    for (;;) {
        const uint word = node[0], kind = QP_NODE_KIND(word);
#if QP_WITH_INTERNAL
        if (kind == QP_NODE_INTERNAL) {
            const uint cu = QP_NAME(is_upper)(u, QP_NODE_TIE_U(word) == 0);
            const uint cv = QP_NAME(is_upper)(v, QP_NODE_TIE_V(word) == 0);
            u = QP_NAME(in_half)(u, cu);
            v = QP_NAME(in_half)(v, cv);
            s->level += 1;
            node = tree + node[1u + cu + 2u * cv];
            continue;
        }
#endif
#if QP_WITH_TERMINAL
        if (kind == QP_NODE_TERMINAL) {
            const uint rings = QP_NODE_RINGS(word), absolute = QP_NODE_ABSOLUTE_RINGS(word), origin = node[1];
            __global const uint *ring = node + 3;
            QP_NAME(rotate_uv)(QP_NODE_ROTATION(word), &u, &v);
            s->turn += QP_NODE_ROTATION(word);
            /* The points of ring k are offsets times 2^(start + k), so that what the cells shrink by their slopes grow by. */
            const uint start = QP_NODE_START(word);
            real shrink = QP_R(1.0);
            for (uint k = 0; k < start; ++k) shrink *= QP_R(0.5);
            for (uint k = 0; k < rings; ++k, ring += 12, shrink *= QP_R(0.5)) {
                if (QP_NAME(is_upper)(u, 1u) != 0 || QP_NAME(is_upper)(v, 1u) != 0) {
                    QP_NAME(eval_ring)(support, ring, u, v, orders, s);
                    if (k < absolute || origin == QP_NO_POINT) return;
                    if (orders == 0) s->size = QP_NAME(size_of)(s);
                    if ((word & QP_NODE_MODE) != 0)
                        QP_NAME(add_mode)(support[(tree + node[2])[5]], orders, s);
                    if (orders != 0) return;
                    s->level -= (int)(start + k);
                    s->p = fma4(s->p, shrink, support[origin]);
                    return;
                }
                u = QP_NAME(in_half)(u, 0u);
                v = QP_NAME(in_half)(v, 0u);
                s->level += 1;
            }
#if QP_WITH_CORNERS
            last_ring = rings == 0 ? 0 : ring - 12;
            last_rings = start + rings;
            last_origin = rings <= absolute ? QP_NO_POINT : origin;
            last_shrink = last_origin == QP_NO_POINT ? QP_R(1.0) : QP_R(2.0) * shrink;
#endif
            /* The tail is in the frame that this node was entered in; an extraordinary corner turns itself. */
            QP_NAME(rotate_uv)((4u - QP_NODE_ROTATION(word)) & 3u, &u, &v);
            s->turn -= QP_NODE_ROTATION(word);
            node = tree + node[2];
            continue;
        }
#endif
#if QP_WITH_CREASE
        if (kind == QP_NODE_CREASE) {
            QP_NAME(rotate_uv)(QP_NODE_ROTATION(word), &u, &v);
            s->turn += QP_NODE_ROTATION(word);
            QP_NAME(eval_crease)(support, node, constants + node[10], u, v, orders, s);
            return;
        }
#endif
#if QP_WITH_CORNERS
#if QP_WITH_TERMINAL
        if (kind == QP_NODE_EXTRAORDINARY) {
            QP_NAME(rotate_uv)(QP_NODE_ROTATION(word), &u, &v);
            s->turn += QP_NODE_ROTATION(word);
            QP_NAME(eval_extraordinary)
            (support, node, constants, last_ring, last_rings, last_origin, last_shrink, u, v, orders, s);
            return;
        }
#endif
        if (kind == QP_NODE_IRREGULAR) {
            QP_NAME(eval_irregular)(support, node, u, v, s);
            return;
        }
#endif
        QP_NAME(eval_regular)(support, node, u, v, orders, s);
        return;
    }
}

/* A normal for a sample where du x dv vanishes is made from QP_REPLACE_STEPS more evaluations, in this order: of order (1,0) and
 * (0,1), in the middle of the patch, and aside. They share the one call of eval_tree() with the samples, which halves the
 * time it takes to compile. */
#define QP_REPLACE_STEPS 7u

typedef struct QP_NAME(replacement) {
    QP_NAME(surface_point) with_u, with_v, middle;
    real4 normal;
    int found;
} QP_NAME(replacement);

QP_FUNCTION void QP_NAME(replacement_start)(QP_NAME(replacement) * r) {
    const real4 zero = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
    QP_NAME(surface_point) s;
    s.p = s.du = s.dv = zero;
    s.size = s.stretch = s.skew_u = s.skew_v = QP_R(0.0);
    s.flags = s.turn = 0;
    s.level = 0;
    r->with_u = r->with_v = r->middle = s;
    r->normal = zero;
    r->found = 0;
}

/* Where step k evaluates, for a sample at (u,v) of the plan, and with which orders. False: not at all, which is so where a
 * tessellation of this level lacks the points. */
QP_FUNCTION int QP_NAME(replacement_place)(uint k, uint level, real *u, real *v, uint *orders) {
    *orders = k == 0 ? 1u : k == 1u ? 2u : 0u;
    if (k == 2u) *u = *v = QP_R(0.5);
    return k <= 1u || (k == 2u && level >= 1u) || (k > 2u && level >= 3u && QP_NAME(step_aside)(k - 3u, u, v));
}

/* Takes up what step k found. */
QP_FUNCTION void QP_NAME(replacement_take)(uint k, QP_NAME(surface_point) s, real u, real v, real size,
                                           QP_NAME(replacement) * r) {
    if (k == 0) r->with_u = s;
    if (k == 2u) r->middle = s;
    if (k == 1u) {
        r->with_v = s;
        r->middle.du = r->middle.dv = make4(QP_R(0.0), QP_R(0.0), QP_R(0.0));
        r->found = ((r->with_u.flags | r->with_v.flags) & (QP_FLAG_LIMIT_FRAME | QP_FLAG_PAST_DEPTH)) == 0 &&
                   QP_NAME(normal_from_within)(u, v, r->with_u, r->with_v, size, &r->normal);
    }
    if (k > 2u && r->found != 0) r->found = QP_NAME(agrees_with)(r->normal, s, size);
}

QP_FUNCTION void QP_NAME(replacement_write)(const QP_NAME(replacement) * r, real size, __global real *normal,
                                            __global uchar *flag) {
    const real4 n = r->found != 0 ? r->normal : QP_NAME(stand_in_normal)(r->middle, size);
    if (r->found != 0) *flag &= (uchar)~QP_FLAG_NO_NORMAL;
    normal[0] = n.x + QP_R(0.0);
    normal[1] = n.y + QP_R(0.0);
    normal[2] = n.z + QP_R(0.0);
}

/* All samples of an entry, by the whole work-group, from its control points. */
QP_STAGE void QP_NAME(domain_patch)(__global const uint *heads, __global const uint *trees,
                                       __global const real *reals, __global const uint *rings,
                                       __global const real *positions, __global const uint *entry,
                                       __global const real4 *points, __global const real *grid_u,
                                       __global const real *grid_v, __global real *vertices,
                                       __global uchar *flags, __global real *derivatives,
                                       uint want_derivatives) {
    __global const uint *head = heads + entry[QP_ENTRY_HEAD];
    __global const uint *tree = trees + head[QP_HEAD_TREE];
    __global const real *constants = reals + head[QP_HEAD_REALS];
    __global const real *us = grid_u + QP_ENTRY_WIDE(entry, QP_ENTRY_GRID);
    __global const real *vs = grid_v + QP_ENTRY_WIDE(entry, QP_ENTRY_GRID);
    __global const real *first = positions + QP_POSITION_FIRST;
    __global const uint *ring = rings + QP_ENTRY_WIDE(entry, QP_ENTRY_RING);
    __global const real *base = first + 3u * (ulong)entry[QP_ENTRY_ORIGIN];
    const real4 origin = make4(base[0], base[1], base[2]);
    const ulong out = QP_ENTRY_WIDE(entry, QP_ENTRY_OUT);
    const uint rotation = entry[QP_ENTRY_ROTATION];
    const uint samples = entry[QP_ENTRY_SAMPLES], level = entry[QP_ENTRY_LEVEL];

    real size = QP_R(0.0);
    for (uint j = 0; j < head[QP_HEAD_RING]; ++j) {
        __global const real *p = first + 3u * (ulong)ring[j];
        const real most = QP_NAME(largest)(make4(p[0] - origin.x, p[1] - origin.y, p[2] - origin.z));
        size = most > size ? most : size;
    }

    /* Lanes past the last sample are not written: they keep an older sample, or two unit vectors to begin with. */
    real value[10][QP_LANES];
    uint flag[QP_LANES];
    for (uint l = 0; l < QP_LANES; ++l) {
        for (uint k = 0; k < 10u; ++k) value[k][l] = k == 3u || k == 7u;
        flag[l] = 0;
    }
    const uint step = (uint)get_local_size(0) * QP_LANES;
    QP_NAME(replacement) replacement;
    QP_NAME(replacement_start)(&replacement);
    for (uint i = (uint)get_local_id(0) * QP_LANES; i < samples; i += step) {
        /* The tree is walked sample by sample, normals are made for QP_LANES samples at once; then come the steps of those lanes
         * whose normal is to be replaced. */
        const uint block = samples - i < QP_LANES ? samples - i : QP_LANES;
        uint evaluations = block;
        for (uint e = 0; e < evaluations; ++e) {
            const int is_sample = e < block;
            const uint l = is_sample ? e : (e - block) / QP_REPLACE_STEPS;
            const uint k = is_sample ? 0u : (e - block) % QP_REPLACE_STEPS;
            if (!is_sample && (flag[l] & QP_FLAG_NO_NORMAL) == 0) continue;
            QP_NAME(surface_point) s;
            real u = us[i + l], v = vs[i + l];
            QP_NAME(rotate_uv)(rotation, &u, &v);
            real at_u = u, at_v = v;
            uint orders = 0;
            const int there = is_sample || QP_NAME(replacement_place)(k, level, &at_u, &at_v, &orders);
            if (there) {
                s.turn = is_sample ? rotation : 0u;
                QP_NAME(eval_tree)(tree, constants, points, at_u, at_v, orders, &s);
            } else {
                s = replacement.middle;
            }
            if (!is_sample) {
                const ulong at = out + i + l;
                if (there) QP_NAME(replacement_take)(k, s, u, v, value[9][l], &replacement);
                if (k + 1u == QP_REPLACE_STEPS)
                    QP_NAME(replacement_write)
                (&replacement, value[9][l], vertices + 6u * at + 3u, flags + at);
                continue;
            }
            value[0][l] = s.p.x;
            value[1][l] = s.p.y;
            value[2][l] = s.p.z;
            value[3][l] = s.du.x;
            value[4][l] = s.du.y;
            value[5][l] = s.du.z;
            value[6][l] = s.dv.x;
            value[7][l] = s.dv.y;
            value[8][l] = s.dv.z;
            value[9][l] = s.size < QP_R(0.0) ? size : s.size;
            flag[l] = s.flags;
            if (want_derivatives != 0)
                QP_NAME(write_derivatives)
            (derivatives + 6u * (out + i + l), fma4(s.dv, s.skew_u, s.du), fma4(s.du, s.skew_v, s.dv), s.turn,
             s.stretch * ldexp(positions[QP_POSITION_SCALE], s.level));
            if (e + 1u != block) continue;
            lanes p[3], du[3], dv[3];
            for (uint c = 0; c < 3u; ++c) {
                p[c] = load_lanes(value[c]);
                du[c] = load_lanes(value[3u + c]);
                dv[c] = load_lanes(value[6u + c]);
            }
            if (QP_NAME(write_samples)(vertices, flags, out + i, block, positions, origin, p, du, dv,
                                       load_lanes(value[9]), flag))
                evaluations = block + QP_REPLACE_STEPS * block;
        }
    }
}

#if QP_WITH_STAGES
__kernel void QP_NAME(domain)(__global const uint *heads, __global const uint *trees,
                              __global const real *reals, __global const uint *rings,
                              __global const real *positions, __global const uint *entries, uint first_entry,
                              __global const real *support, __global const real *grid_u,
                              __global const real *grid_v, __global real *vertices, __global uchar *flags,
                              __global real *derivatives, uint want_derivatives QP_GROUP) {
    __global const uint *entry = entries + ((ulong)first_entry + get_group_id(0)) * QP_ENTRY_WORDS;
    QP_NAME(domain_patch)
    (heads, trees, reals, rings, positions, entry,
     (__global const real4 *)support + QP_ENTRY_WIDE(entry, QP_ENTRY_SUPPORT), grid_u, grid_v, vertices, flags,
     derivatives, want_derivatives);
}
#endif
