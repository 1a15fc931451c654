/* How a subdivision plan lies in memory: shared by the host that packs it and the kernels that read it.
 * Plain macros and unsigned words only, so that C11 and OpenCL C 1.2 both read it.
 *
 * All plans of a surface are concatenated into three arrays:
 *   heads    QP_HEAD_WORDS words a plan (see below)
 *   tree     32-bit words: quadtree nodes; a plan's offsets are relative to its head's QP_HEAD_TREE
 *   reals    float or double: stencil weights and crease constants; relative to QP_HEAD_REALS
 *
 * A plan maps the vertices of a patch's 1-ring (ring_size N of them, in canonical order) to `points` P
 * control points. Stencil weights come first in reals, transposed: weight of ring vertex j for point i is
 * reals[j * P + i], so that neighbouring work-items (points) read neighbouring weights. Points are sorted by
 * the first level that needs them: a frame at level n computes points [0, rows[n]).
 *
 * Everything is relative to the patch origin, a base vertex at (or, in an n-gon, near) the corner QP_HEAD_BASE: the domain stage adds
 * it last. A point is computed relative to its anchor, which may be another corner's vertex: the hull subtracts the anchor from every
 * ring position first (exact or correctly rounded once), and moves points with QP_ANCHOR_MOVES, which are positions, to the
 * origin afterwards (host/plan/anchor.c). With QP_PLAN_ANCHORS set, 4 bits a point, eight points a word, low bits first, hold the
 * corner 0..3 and that flag. Weights of a row sum
 * to 1, or to 0 for tangents and for *offset* rows: the points of a terminal node are stored as offsets from
 * the limit position of its corner (point ORIGIN), those of its ring number k times 2^(start + k), so that they keep full
 * relative precision however deep they lie.
 *
 * (u,v) of a plan: patches that share a plan by rotation r (0..3) put the plan's corner 0 at their own corner
 * r: r=0: (u,v); r=1: (v,1-u); r=2: (1-u,1-v); r=3: (1-v,u) are the plan's (u,v) of the patch's (u,v). How the device holds a
 * coordinate: frame_layout.h. */
#ifndef QP_PLAN_LAYOUT_H
#define QP_PLAN_LAYOUT_H

#define QP_LEVELS 16u /* rows[] entries; the last one is all rows */

/* Head words. */
#define QP_HEAD_RING 0u   /* N */
#define QP_HEAD_POINTS 1u /* P */
#define QP_HEAD_TREE 2u   /* first word in tree; the root node is there */
#define QP_HEAD_REALS 3u  /* first element in reals */
#define QP_HEAD_FLAGS 4u  /* QP_PLAN_* */
#define QP_HEAD_ROWS 5u   /* rows[QP_LEVELS] */
#define QP_HEAD_ANCHORS (QP_HEAD_ROWS + QP_LEVELS) /* with QP_PLAN_ANCHORS: first word of the anchors, relative to QP_HEAD_TREE */
#define QP_HEAD_BASE (QP_HEAD_ANCHORS + 1u)        /* corner of the plan that is the patch's origin */
#define QP_HEAD_WORDS (QP_HEAD_BASE + 1u)

#define QP_PLAN_REGULAR 1u  /* the one plan whose points are its 16 ring vertices, row-major from (-1,-1) */
#define QP_PLAN_CREASE 2u   /* has crease nodes */
#define QP_PLAN_TERMINAL 4u /* has terminal nodes */
#define QP_PLAN_INTERNAL 8u /* has internal nodes */
#define QP_PLAN_CORNERS 16u /* has extraordinary or irregular leaves */
#define QP_PLAN_IRREGULAR 32u /* has irregular leaves */
#define QP_PLAN_ANCHORS 128u /* has points whose anchor is not the base */
#define QP_PLAN_MODES 64u /* has points with shares in modes: behind the weights come P reals, the points' fourth numbers */

/* Word 0 of a node: kind in bits 0..2, rotation in bits 3..4 (crease, terminal, extraordinary), tie_u in bit 5,
 * tie_v in bit 6 (internal); of a terminal the count of its rings in bits 8..15, in bits 16..23 how many of them,
 * the first ones, have absolute points, and in bits 25..31 its start, the subdivision level of its cell (of the mesh: one more than that of
 * the patch for an n-gon's child), so that a point has the same scale in all patches.
 * Node-local (u,v) runs over [0,1]^2 in every node; going down doubles it (exactly). Rotation r turns the node's
 * (u,v) as the patch rotation above does, so that the crease edge is v=0 / the extraordinary corner is (0,0).
 * Point indices are 16 bits, two a word, low half first.
 *
 * REGULAR: word 1: origin point or QP_NO_POINT. words 2..9: 16 points, row-major (v outer, u inner), of the uniform
 *   bicubic B-spline whose domain is the node.
 * CREASE: word 1: origin or QP_NO_POINT. words 2..9: as REGULAR, in the rotated frame (crease along v=0).
 *   word 10: offset of QP_CREASE_REALS constants in reals (relative to QP_HEAD_REALS): [0] v0, [1] v1: zone 0 is
 *   v >= v0, zone 1 is v1 <= v < v0, zone 2 is v < v1; [2..4] scale of each zone; then three 4x4 matrices M
 *   (row-major). In zone z the weights of the four rows of points are w[j] = sum_i B_i(v * scale_z) * M_z[i][j],
 *   B the cubic B-spline basis (and derivative: d/dv = scale_z * B').
 * INTERNAL: words 1..4: nodes of the children (u<.5,v<.5), (u>=.5,v<.5), (u<.5,v>=.5), (u>=.5,v>=.5).
 *   At exactly .5 the child is the upper one, or the lower one where tie_u / tie_v is set.
 * TERMINAL: word 1: origin point (offset rows, see above) or QP_NO_POINT; rings before ABSOLUTE_RINGS do not add it.
 *   word 2: node of the remaining corner cell, in the frame that the terminal was entered in. Then 12 words a ring: 24 points of the 5x5 grid, row-major (v outer),
 *   without (0,0): slot of (i,j) is 5*j+i-1. At each ring: if u >= .5 or v >= .5 the sample lies in one of three
 *   regular sub-domains, with cx = u>=.5, cy = v>=.5 its 16 points are (cx+a, cy+b), a,b in 0..3, and its (u,v) is
 *   2u-cx, 2v-cy; else (u,v) doubles and the next ring follows, or at last word 2's node.
 * EXTRAORDINARY: follows a TERMINAL only, in its rotated frame. words 1..3: limit position, first and second tangent
 *   points (cross(t1,t2) points along the normal; QP_NO_POINT tangents: no tangent plane). Exact at (0,0). word 4: offset in reals
 *   (relative to QP_HEAD_REALS) of the ratio r by which the rings shrink in the end. A sample elsewhere in the cell goes on
 *   doubling, m times until u >= .5 or v >= .5, and is limit + r^m (p - limit), p the last ring's value there (Stam 1998: the
 *   powers of the dominant eigenvalue). That is exact to working precision where QP_NODE_EXACT is set, and past the plan's depth
 *   elsewhere: modes that decay a little faster than the dominant one still count after few levels. word 5: the terminal's mode, or
 *   QP_NO_POINT. With QP_NODE_MODE set in the terminal, to every one of its offset points its fourth number times the mode is to be
 *   added (host/plan/mode.c).
 * IRREGULAR: words 1..6: 12 points: limit position, t1, t2 of the corners (0,0), (1,0), (1,1), (0,1), QP_NO_POINT
 *   where a tangent is undefined. Exact at the corners; elsewhere past depth: bilinear blend. */
#define QP_NODE_INTERNAL 0u
#define QP_NODE_REGULAR 1u
#define QP_NODE_CREASE 2u
#define QP_NODE_TERMINAL 3u
#define QP_NODE_EXTRAORDINARY 4u
#define QP_NODE_IRREGULAR 5u

#define QP_NODE_KIND(w) ((w)&7u)
#define QP_NODE_ROTATION(w) (((w) >> 3) & 3u)
#define QP_NODE_TIE_U(w) (((w) >> 5) & 1u)
#define QP_NODE_TIE_V(w) (((w) >> 6) & 1u)
#define QP_NODE_RINGS(w) (((w) >> 8) & 255u)
#define QP_NODE_ABSOLUTE_RINGS(w) (((w) >> 16) & 255u)
#define QP_NODE_EXACT (1u << 8) /* extraordinary */
#define QP_NODE_MODE (1u << 24) /* terminal */
#define QP_NODE_START(w) ((w) >> 25) /* terminal */

#define QP_ANCHOR_CORNER(a) ((a)&3u)
#define QP_ANCHOR_MOVES 4u

#define QP_NO_POINT 0xffffu
#define QP_CREASE_REALS 53u

#endif
