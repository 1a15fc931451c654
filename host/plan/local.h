/* Local refinement: the 1-ring of one cell, level by level, with every point kept as a stencil (a row of
 * weights over the base ring).
 *
 * A *fan* is what lies around one vertex of a cell: m faces and their spokes in counter-clockwise order. Face
 * j lies between spoke j and spoke j+1; a closed fan (interior vertex) has m spokes and wraps, an open one
 * has m+1. The limit surface over a cell depends on the fans of its corners and on nothing else, and so do
 * the fans of its children: the recursion below is closed. Non-manifold edges cut fans, so a fan is always a
 * disk or a half disk. A vertex may still lie smoothly on a crease of two of them (*through*, as OpenSubdiv has it): its rule then
 * is that of all its fans together.
 *
 * Subdivision rules: Catmull and Clark 1978, with semi-sharp creases of DeRose, Kass and Truong 1998 as
 * OpenSubdiv's Sdc applies them. Sharpness is float arithmetic, as there. */
#ifndef QP_PLAN_LOCAL_H
#define QP_PLAN_LOCAL_H

#include "host/mesh/mesh.h"

typedef struct qp_fan {
    uint32_t vertex; /* point of the level the fan belongs to */
    float sharpness; /* of the vertex */
    uint32_t faces;  /* m */
    bool closed;
    uint32_t *spoke;    /* [spokes] far points */
    float *sharp;       /* [spokes] sharpness of the spoke edges */
    float *far_sharp;   /* [spokes] sharpness that the far half of the spoke gets at the next level */
    uint32_t *diagonal; /* [m] the fourth point of quad j; QP_NONE where the face is no quad (level 0 only) */
    uint32_t *face;     /* [m] index into qp_local.faces at level 0; NULL above */
    /* The vertex lies on a crease of two non-manifold edges and is no corner for ever. An open fan starts at end 0 and ends at
     * end 1, or else lies `beside` the crease, as closed ones do: its own edges tell less than these. */
    bool through, beside;
    uint32_t end[2]; /* far points of the two edges */
    uint32_t
        others; /* sharp edges of the vertex in its other fans, those two apart; counted where they have a say */
    float *other_sharp; /* [others] */
} qp_fan;

static inline uint32_t qp_fan_spokes(const qp_fan *f) {
    return f->faces + (f->closed ? 0u : 1u);
}

/* One corner of a cell: its fan and the face of the fan that is the cell. */
typedef struct qp_corner {
    qp_fan *fan;
    uint32_t at;
} qp_corner;

/* Spoke index of a corner, `step` places counter-clockwise from the cell's own leading edge; QP_NONE past an
 * open end. step 0 runs along the cell's edge to the next corner, step 1 to the previous corner. */
static inline uint32_t qp_corner_spoke(const qp_corner *c, int step) {
    int64_t i = (int64_t)c->at + step, n = qp_fan_spokes(c->fan);
    if (c->fan->closed) return (uint32_t)(((i % n) + n) % n);
    return i < 0 || i >= n ? QP_NONE : (uint32_t)i;
}
/* Likewise for faces; step 0 is the cell. */
static inline uint32_t qp_corner_face(const qp_corner *c, int step) {
    int64_t i = (int64_t)c->at + step, m = c->fan->faces;
    if (c->fan->closed) return (uint32_t)(((i % m) + m) % m);
    return i < 0 || i >= m ? QP_NONE : (uint32_t)i;
}
static inline float qp_corner_sharp(const qp_corner *c, int step) {
    uint32_t s = qp_corner_spoke(c, step);
    return s == QP_NONE ? 0.0f : c->fan->sharp[s];
}

/* A cell: corners counter-clockwise; 4, or n for the base face of an n-gon. Corner 0 is (0,0), 1 is (1,0). */
typedef struct qp_cell {
    uint32_t n;
    qp_corner *corner; /* [n] */
} qp_cell;

/* Bump allocator that is emptied as a whole. */
typedef struct qp_arena {
    struct qp_arena_block *first, *current;
    bool failed; /* sticks once memory was out; callers check it once a level */
} qp_arena;
void *qp_arena_get(qp_arena *arena, size_t bytes);
void qp_arena_reset(qp_arena *arena);
void qp_arena_free(qp_arena *arena);

/* The points of one level: rows of weights, found again by what they were made from. */
typedef struct qp_level {
    uint32_t count;
    double *rows; /* [count * width] */
    size_t row_capacity;
    struct qp_level_entry *table;
    uint32_t table_size, table_used; /* power of two */
    qp_arena arena;                  /* fans and cells of this level */
} qp_level;

/* A face of the base ring at level 0. */
typedef struct qp_ring_face {
    uint32_t size;
    uint32_t *vertices; /* ring columns, counter-clockwise */
} qp_ring_face;

typedef struct qp_local {
    uint32_t width; /* columns: vertices of the base ring */
    bool chaikin, smooth_triangles;
    const qp_ring_face *ring_faces; /* level 0 */
    qp_level level[2];              /* [k & 1]: points of level k; two levels live at a time */
    bool failed;
} qp_local;

void qp_local_init(qp_local *local, uint32_t width);
void qp_local_free(qp_local *local);
/* Empties a level and starts it anew. */
void qp_level_clear(qp_level *level);

enum { QP_KEY_VERTEX, QP_KEY_EDGE, QP_KEY_FACE, QP_KEY_PHANTOM };
/* The point made from (a, b) by kind; *fresh is set when it was not there and its row is yet to be written.
 */
uint32_t qp_level_point(qp_local *local, qp_level *level, uint32_t kind, uint32_t a, uint32_t b, bool *fresh);
static inline double *qp_level_row(const qp_local *local, const qp_level *level, uint32_t point) {
    return level->rows + (size_t)point * local->width;
}

/* From this valence on, sums over a fan add up rounding errors that are all of one sign; qp_row_settle gives what a row's sum then
 * lacks of 1 or 0 to its largest weight. */
enum { QP_SETTLE_FACES = 32 };
void qp_row_settle(double *row, uint32_t width);

/* Refines a cell of level `from` into `to`: writes the rows of every point of its children's fans and returns
 * the children (cell->n of them; child i lies at corner i and keeps the cell's orientation when n is 4; an
 * n-gon's child has its corner 0 at corner i). Sets local->failed when memory is out. */
qp_cell *qp_refine_cell(qp_local *local, qp_level *from, qp_level *to, const qp_cell *cell);

/* Refines a single fan (its vertex's own 1-ring is closed under subdivision) into `to`. */
qp_fan *qp_refine_fan(qp_local *local, qp_level *from, qp_level *to, const qp_fan *fan);

/* Limit stencils of a corner: position, and two tangents whose cross product points along the normal of the
 * side the cell is on. rows: 3 * width doubles. *has_tangents is false where there is no tangent plane. The
 * fan lives in `from`; where semi-sharp features must first decay it is refined on its own. */
void qp_limit_stencils(qp_local *local, const qp_level *from, const qp_corner *corner, double *rows,
                       bool *has_tangents);

/* Weights of the limit position over a fan's vertex, spokes and diagonals, for a fan of quads without semi-sharp features; malloced,
 * NULL when memory is out. They hold for the vertex's fans at all further levels. */
double *qp_limit_mask(const qp_corner *corner);
/* row = the mask applied to the fan's points. */
void qp_limit_apply(const qp_local *local, const qp_level *level, const qp_fan *fan, const double *mask,
                    double *row);

bool qp_sharp_is_semi(float s);
bool qp_sharp_is_infinite(float s);
/* After one subdivision, by the uniform rule. */
float qp_sharp_decrement(float s);
/* By Chaikin's rule, for one of `count` semi-sharp edges around a vertex whose sharpnesses add up to `sum` (in double, so
 * that the sum does not depend on where the walk around the vertex began). */
float qp_sharp_chaikin(float s, double sum, uint32_t count);
/* Some spoke or the vertex is semi-sharp, so that the rules here change with the level. */
bool qp_fan_has_semi_sharp(const qp_fan *fan);
/* Sharp edges at the vertex, and how many of them are infinitely sharp. */
uint32_t qp_fan_sharp_edges(const qp_fan *fan, uint32_t *infinite);

#endif
