/* What a level of local refinement is kept in: an arena for its fans and cells, rows of weights for its points. */
#include "host/plan/local.h"

#include <stdlib.h>
#include <string.h>

/* ---- memory ---- */

struct qp_arena_block {
    struct qp_arena_block *next;
    size_t used, size;
    max_align_t data[];
};

void *qp_arena_get(qp_arena *arena, size_t bytes) {
    bytes = (bytes + sizeof(max_align_t) - 1) / sizeof(max_align_t) * sizeof(max_align_t);
    struct qp_arena_block *b = arena->current;
    while (b != NULL && b->size - b->used < bytes) b = b->next;
    if (b == NULL) {
        size_t size = bytes > 16384 ? bytes : 16384;
        b = malloc(sizeof *b + size);
        if (b == NULL) {
            arena->failed = true;
            return NULL;
        }
        b->size = size;
        b->used = 0;
        b->next = NULL;
        if (arena->current == NULL) {
            b->next = arena->first;
            arena->first = b;
        } else {
            b->next = arena->current->next;
            arena->current->next = b;
        }
    }
    arena->current = b;
    void *p = (char *)b->data + b->used;
    b->used += bytes;
    return p;
}

void qp_arena_reset(qp_arena *arena) {
    for (struct qp_arena_block *b = arena->first; b != NULL; b = b->next) b->used = 0;
    arena->current = arena->first;
}

void qp_arena_free(qp_arena *arena) {
    struct qp_arena_block *b = arena->first;
    while (b != NULL) {
        struct qp_arena_block *next = b->next;
        free(b);
        b = next;
    }
    *arena = (qp_arena){0};
}

void qp_local_init(qp_local *local, uint32_t width) {
    local->width = width;
    local->failed = false;
    qp_level_clear(&local->level[0]);
    qp_level_clear(&local->level[1]);
}

void qp_local_free(qp_local *local) {
    for (int i = 0; i < 2; ++i) {
        free(local->level[i].rows);
        free(local->level[i].table);
        qp_arena_free(&local->level[i].arena);
    }
    *local = (qp_local){0};
}

/* ---- points of a level ---- */

struct qp_level_entry {
    uint32_t a, b, kind_and_one, point; /* kind + 1; 0: empty */
};

void qp_level_clear(qp_level *level) {
    level->count = 0;
    if (level->table_used != 0) memset(level->table, 0, level->table_size * sizeof *level->table);
    level->table_used = 0;
    qp_arena_reset(&level->arena);
}

static uint32_t entry_slot(const qp_level *level, uint32_t kind_and_one, uint32_t a, uint32_t b) {
    uint64_t h = ((uint64_t)a << 32 | b) * 0x9e3779b97f4a7c15ull + kind_and_one * 0xd6e8feb86659fd93ull;
    h ^= h >> 29;
    uint32_t mask = level->table_size - 1, i = (uint32_t)(h * 0xbf58476d1ce4e5b9ull >> 32) & mask;
    const struct qp_level_entry *t = level->table;
    while (t[i].kind_and_one != 0 && (t[i].kind_and_one != kind_and_one || t[i].a != a || t[i].b != b)) {
        i = (i + 1) & mask;
    }
    return i;
}

static bool table_grow(qp_level *level) {
    uint32_t old_size = level->table_size;
    struct qp_level_entry *old = level->table;
    uint32_t size = old_size == 0 ? 256 : old_size * 2;
    struct qp_level_entry *table = qp_alloc(size, sizeof *table, true);
    if (table == NULL) return false;
    level->table = table;
    level->table_size = size;
    for (uint32_t i = 0; i < old_size; ++i) {
        if (old[i].kind_and_one == 0) continue;
        table[entry_slot(level, old[i].kind_and_one, old[i].a, old[i].b)] = old[i];
    }
    free(old);
    return true;
}

uint32_t qp_level_point(qp_local *local, qp_level *level, uint32_t kind, uint32_t a, uint32_t b,
                        bool *fresh) {
    *fresh = false;
    if (level->table_used * 2 >= level->table_size && !table_grow(level)) {
        local->failed = true;
        return 0;
    }
    uint32_t slot = entry_slot(level, kind + 1, a, b);
    if (level->table[slot].kind_and_one != 0) return level->table[slot].point;
    void *rows = level->rows;
    if (!qp_grow(&rows, &level->row_capacity, ((size_t)level->count + 1) * local->width, sizeof(double))) {
        local->failed = true;
        return 0;
    }
    level->rows = rows;
    level->table[slot] = (struct qp_level_entry){a, b, kind + 1, level->count};
    ++level->table_used;
    *fresh = true;
    return level->count++;
}
