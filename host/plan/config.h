/* Configurations: what a plan depends on, as a key that is compared in full, and the 1-ring in the plan's
 * order.
 *
 * The key lists, for every corner of the base face from the starting corner on, the fan around it (closed or
 * open, sizes of its faces, place of the base face) and the sharpness of the vertex and of every spoke, and what other fans of the
 * vertex have a say in its rule: all that the local refinement of local.h reads. The ring is unfolded: a mesh vertex that is reached by two
 * unrelated ways (tiny closed meshes) gets two columns, so that the key never depends on such coincidences.
 */
#ifndef QP_PLAN_CONFIG_H
#define QP_PLAN_CONFIG_H

#include "host/plan/local.h"

/* Scratch of one worker; zero-initialise, then reuse. */
typedef struct qp_gather {
    uint32_t n;           /* corners of the base face */
    uint32_t *begin;      /* [n + 1] first fan face of each corner in `corners` */
    uint32_t *at;         /* [n] index of the base face in the corner's fan */
    bool *closed;         /* [n] */
    uint32_t *corners;    /* mesh corner (at the fan's vertex) of each fan face, counter-clockwise */
    uint32_t *words;      /* key words of all corners, in mesh order */
    uint32_t *word_begin; /* [n + 1] */
    bool has_semi, has_triangles;
    size_t n_capacity[4], corner_capacity, word_capacity;
    /* Numbering. */
    uint32_t *entry_begin; /* [fan faces + 1] first entry (face vertex) of each fan face */
    uint32_t *parent;      /* [entries] union-find */
    uint32_t *column;      /* [entries] ring column of a root, or QP_NONE */
    size_t entry_capacity[3];
    bool joined;
    uint32_t *ring;  /* [width] mesh vertices */
    uint32_t *roots; /* [width] entries that own the columns */
    uint32_t width;
    size_t ring_capacity, root_capacity;
    uint32_t *key;
    uint32_t key_words;
    size_t key_capacity;
} qp_gather;
void qp_gather_free(qp_gather *gather);

/* Walks the fans of the base face. False when memory is out. */
bool qp_gather_face(qp_gather *gather, const qp_mesh *mesh, uint32_t face);

/* Starting corner of the canonical key of a quad: the rotation whose key is smallest. */
uint32_t qp_gather_canonical(const qp_gather *gather);

/* Key (gather->key) and ring (gather->ring, width) seen from starting corner `start`; child: the patch is an
 * n-gon's child. */
bool qp_gather_key(qp_gather *gather, const qp_mesh *mesh, uint32_t start, bool child);
bool qp_gather_ring(qp_gather *gather, const qp_mesh *mesh, uint32_t start);

/* After qp_gather_ring: level 0 of the local refinement, in arena memory of level 0 of `local`. NULL when
 * memory is out. */
qp_cell *qp_gather_cell(qp_gather *gather, const qp_mesh *mesh, uint32_t start, qp_local *local);

#endif
