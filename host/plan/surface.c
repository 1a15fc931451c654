/* The configuration database in memory: every patch finds its plan by its key; each plan is built once, in
 * parallel. */
#include "host/plan/build.h"
#include "host/plan/config.h"

#include <stdlib.h>
#include <string.h>

/* A configuration seen for the first time, and where. */
typedef struct found_config {
    uint64_t key_begin;
    uint32_t key_words, face, start;
    bool child;
} found_config;

typedef struct database {
    uint32_t *keys; /* all keys, one after another */
    size_t key_capacity;
    uint64_t key_words;
    found_config *configs;
    size_t config_capacity;
    uint32_t config_count;
    uint32_t *table; /* config index + 1, or 0 */
    uint32_t table_size;
} database;

static void database_free(database *db) {
    free(db->keys);
    free(db->configs);
    free(db->table);
}

static bool database_rehash(database *db) {
    uint32_t size = db->table_size == 0 ? 1024 : db->table_size * 2;
    uint32_t *table = qp_alloc(size, sizeof *table, true);
    if (table == NULL) return false;
    for (uint32_t c = 0; c < db->config_count; ++c) {
        const found_config *f = &db->configs[c];
        uint32_t i =
            (uint32_t)qp_hash(db->keys + f->key_begin, f->key_words * sizeof(uint32_t), 0) & (size - 1);
        while (table[i] != 0) i = (i + 1) & (size - 1);
        table[i] = c + 1;
    }
    free(db->table);
    db->table = table;
    db->table_size = size;
    return true;
}

/* Index of the configuration with this key, entered if new. QP_NONE when memory is out. The hash only finds
 * candidates; keys are compared in full. */
static uint32_t database_find(database *db, const qp_gather *g, uint32_t face, uint32_t start, bool child) {
    if ((db->config_count + 1) * 2 > db->table_size && !database_rehash(db)) return QP_NONE;
    uint32_t mask = db->table_size - 1,
             i = (uint32_t)qp_hash(g->key, g->key_words * sizeof(uint32_t), 0) & mask;
    for (; db->table[i] != 0; i = (i + 1) & mask) {
        const found_config *f = &db->configs[db->table[i] - 1];
        if (f->key_words != g->key_words) continue;
        if (memcmp(db->keys + f->key_begin, g->key, g->key_words * sizeof(uint32_t)) == 0)
            return db->table[i] - 1;
    }
    if (!qp_grow((void **)&db->keys, &db->key_capacity, db->key_words + g->key_words, sizeof(uint32_t)) ||
        !qp_grow((void **)&db->configs, &db->config_capacity, (size_t)db->config_count + 1,
                 sizeof *db->configs)) {
        return QP_NONE;
    }
    memcpy(db->keys + db->key_words, g->key, g->key_words * sizeof(uint32_t));
    db->configs[db->config_count] = (found_config){db->key_words, g->key_words, face, start, child};
    db->key_words += g->key_words;
    db->table[i] = db->config_count + 1;
    return db->config_count++;
}

/* ---- patches ---- */

static bool append_ring(qp_surface *s, size_t *capacity, const uint32_t *ring, uint32_t count) {
    if (!qp_grow((void **)&s->rings, capacity, s->ring_entries + count, sizeof *s->rings)) return false;
    memcpy(s->rings + s->ring_entries, ring, count * sizeof *ring);
    s->ring_entries += count;
    return true;
}

/* The 4x4 control points of a regular face, row-major from (-1,-1). */
static void regular_ring(const qp_mesh *m, uint32_t face, uint32_t ring[16]) {
    for (uint32_t i = 0; i < 4; ++i) {
        uint32_t corner = m->face_offsets[face] + i;
        uint32_t across = m->corner_twin[corner], side = qp_corner_next(m, across);
        ring[qp_grid_inner[i]] = m->face_vertices[corner];
        ring[qp_grid_beyond_a[i]] = m->face_vertices[qp_corner_next(m, side)];
        ring[qp_grid_beyond_b[i]] = m->face_vertices[qp_corner_prev(m, across)];
        ring[qp_grid_outer[i]] = m->face_vertices[qp_corner_prev(m, m->corner_twin[side])];
    }
}

static void enter_nothing(qp_surface *s, uint32_t patch) {
    s->patch_plan[patch] = QP_NONE;
    s->patch_ring[patch] = s->ring_entries;
}

static bool enter_irregular(qp_surface *s, database *db, qp_gather *g, const uint8_t *mask,
                            size_t *ring_capacity, uint32_t face) {
    const qp_mesh *mesh = s->mesh;
    if (!qp_gather_face(g, mesh, face)) return false;
    bool child = g->n != 4;
    uint32_t patches = child ? g->n : 1;
    for (uint32_t k = 0; k < patches; ++k) {
        uint32_t patch = mesh->patch_offsets[face] + k, start = child ? k : qp_gather_canonical(g);
        if (mask != NULL && !mask[patch]) {
            enter_nothing(s, patch);
            continue;
        }
        if (!qp_gather_key(g, mesh, start, child) || !qp_gather_ring(g, mesh, start)) return false;
        uint32_t config = database_find(db, g, face, start, child);
        if (config == QP_NONE) return false;
        s->patch_plan[patch] = config;
        s->patch_rotation[patch] = child ? 0 : (uint8_t)start;
        s->patch_ring[patch] = s->ring_entries;
        if (!append_ring(s, ring_capacity, g->ring, g->width)) return false;
    }
    return true;
}

/* Does a face have a patch that is to be entered? */
static bool is_wanted(const qp_mesh *mesh, const uint8_t *mask, uint32_t face) {
    if (mesh->face_flags[face] & QP_FACE_HOLE) return false;
    bool wanted = mask == NULL;
    for (uint32_t p = mesh->patch_offsets[face]; p < mesh->patch_offsets[face + 1] && !wanted; ++p)
        wanted = mask[p] != 0;
    return wanted;
}

static bool enter_patches(qp_surface *s, const uint8_t *mask, database *db) {
    const qp_mesh *mesh = s->mesh;
    qp_gather gather = {0};
    size_t ring_capacity = 0;
    bool ok = true;
    for (uint32_t face = 0; face < mesh->n_faces && ok; ++face) {
        uint32_t first = mesh->patch_offsets[face];
        if (!is_wanted(mesh, mask, face)) {
            for (uint32_t p = first; p < mesh->patch_offsets[face + 1]; ++p) enter_nothing(s, p);
        } else if (qp_face_is_regular(mesh, face)) {
            uint32_t ring[16];
            regular_ring(mesh, face, ring);
            s->regular_plan = 0; /* its real index is set once the others are counted */
            s->patch_plan[first] = QP_NONE - 1;
            s->patch_ring[first] = s->ring_entries;
            ok = append_ring(s, &ring_capacity, ring, 16);
        } else {
            ok = enter_irregular(s, db, &gather, mask, &ring_capacity, face);
        }
    }
    qp_gather_free(&gather);
    return ok;
}

/* ---- building ---- */

typedef struct build_job {
    qp_surface *surface;
    const database *db;
    struct worker {
        qp_gather gather;
        qp_builder builder;
    } workers[65];
    bool failed[65];
} build_job;

static qp_plan *build_config(const qp_surface *s, const found_config *f, struct worker *w) {
    qp_builder *b = &w->builder;
    b->crease_nodes = !s->options.no_crease_nodes;
    b->terminal_nodes = !s->options.no_terminal_nodes;
    for (b->depth = s->options.depth; b->depth > 0; --b->depth) {
        if (!qp_gather_face(&w->gather, s->mesh, f->face) || !qp_gather_ring(&w->gather, s->mesh, f->start)) {
            return NULL;
        }
        qp_local_init(&b->local, w->gather.width);
        qp_cell *cell = qp_gather_cell(&w->gather, s->mesh, f->start, &b->local);
        if (cell == NULL) return NULL;
        qp_plan *plan = qp_build_plan(b, cell, f->child);
        /* More points than 16 bits can number: one level less; samples below it are flagged. */
        if (plan != NULL || !b->too_large) return plan;
    }
    return NULL;
}

static void build_some(void *context, size_t begin, size_t end, unsigned worker) {
    build_job *job = context;
    for (size_t c = begin; c < end; ++c) {
        job->surface->plans[c] = build_config(job->surface, &job->db->configs[c], &job->workers[worker]);
        if (job->surface->plans[c] == NULL) job->failed[worker] = true;
    }
}

/* The plan of regular patches: 16 points that are its 16 ring vertices. */
static qp_plan *regular_plan(void) {
    qp_plan *plan = qp_alloc(1, sizeof *plan, true);
    if (plan == NULL) return NULL;
    plan->ring_size = plan->point_count = 16;
    plan->node_count = 1;
    plan->tree_words = 10;
    plan->flags = QP_PLAN_REGULAR;
    plan->tree = qp_alloc(10, sizeof *plan->tree, true);
    plan->weights = qp_alloc(16 * 16, sizeof *plan->weights, true);
    plan->constants = qp_alloc(0, sizeof *plan->constants, true);
    plan->point_kinds = qp_alloc(16, 1, true);
    plan->point_origins = qp_alloc(16, sizeof *plan->point_origins, false);
    plan->point_scales = qp_alloc(16, 1, true);
    plan->point_anchors = qp_alloc(16, 1, true);
    if (plan->tree == NULL || plan->weights == NULL || plan->constants == NULL || plan->point_kinds == NULL ||
        plan->point_origins == NULL || plan->point_scales == NULL || plan->point_anchors == NULL) {
        qp_plan_free(plan);
        return NULL;
    }
    plan->tree[0] = QP_NODE_REGULAR;
    plan->tree[1] = QP_NO_POINT;
    for (uint32_t i = 0; i < 16; ++i) {
        plan->weights[17 * i] = 1.0;
        plan->point_origins[i] = QP_NO_POINT;
        plan->tree[2 + i / 2] |= i << (i % 2 * 16);
    }
    for (uint32_t n = 0; n < QP_LEVELS; ++n) plan->rows[n] = plan->corner_rows[n] = 16;
    return plan;
}

static bool build_plans(qp_surface *s, const database *db) {
    bool has_regular = s->regular_plan != QP_NONE;
    s->n_plans = db->config_count + (has_regular ? 1 : 0);
    s->plans = qp_alloc(s->n_plans, sizeof *s->plans, true);
    build_job *job = qp_alloc(1, sizeof *job, true);
    bool ok = s->plans != NULL && job != NULL;
    if (ok) {
        job->surface = s;
        job->db = db;
        qp_parallel(db->config_count, 8, build_some, job);
        for (unsigned w = 0; w < 65; ++w) {
            ok = ok && !job->failed[w];
            qp_gather_free(&job->workers[w].gather);
            qp_builder_free(&job->workers[w].builder);
        }
    }
    free(job);
    if (ok && has_regular) {
        s->regular_plan = db->config_count;
        s->plans[s->regular_plan] = regular_plan();
        ok = s->plans[s->regular_plan] != NULL;
        for (uint32_t p = 0; p < s->mesh->n_patches; ++p) {
            if (s->patch_plan[p] == QP_NONE - 1) s->patch_plan[p] = s->regular_plan;
        }
    }
    return ok;
}

qp_status qp_surface_create(const qp_mesh *mesh, const qp_surface_options *options, qp_surface **surface,
                            qp_error *err) {
    return qp_surface_create_for(mesh, options, NULL, surface, err);
}

qp_status qp_surface_create_for(const qp_mesh *mesh, const qp_surface_options *options, const uint8_t *mask,
                                qp_surface **surface, qp_error *err) {
    *surface = NULL;
    double begin = qp_now_ms();
    qp_surface_options chosen = options != NULL ? *options : (qp_surface_options){0};
    if (chosen.depth == 0) chosen.depth = 10;
    if (chosen.depth > QP_DEPTH_LIMIT) {
        return qp_fail(err, QP_BAD_INPUT, "depth %u is out of range (1 to %d)", (unsigned)chosen.depth,
                       QP_DEPTH_LIMIT);
    }
    qp_surface *s = qp_alloc(1, sizeof *s, true);
    if (s == NULL) return qp_fail_memory(err, sizeof *s, "a surface");
    s->mesh = mesh;
    s->options = chosen;
    s->regular_plan = QP_NONE;
    s->patch_plan = qp_alloc(mesh->n_patches, sizeof *s->patch_plan, true);
    s->patch_rotation = qp_alloc(mesh->n_patches, sizeof *s->patch_rotation, true);
    s->patch_ring = qp_alloc(mesh->n_patches, sizeof *s->patch_ring, true);
    database db = {0};
    bool ok = s->patch_plan != NULL && s->patch_rotation != NULL && s->patch_ring != NULL;
    ok = ok && enter_patches(s, mask, &db) && build_plans(s, &db);
    database_free(&db);
    if (!ok) {
        qp_surface_free(s);
        return qp_fail_memory(err, (size_t)mesh->n_patches * 64, "the plans of a surface");
    }
    s->build_ms = qp_now_ms() - begin;
    *surface = s;
    return QP_OK;
}

void qp_surface_free(qp_surface *s) {
    if (s == NULL) return;
    for (uint32_t i = 0; s->plans != NULL && i < s->n_plans; ++i) qp_plan_free(s->plans[i]);
    free(s->plans);
    free(s->patch_plan);
    free(s->patch_rotation);
    free(s->patch_ring);
    free(s->rings);
    free(s);
}
