#include "host/plan/parts.h"

#include <stdlib.h>
#include <string.h>

void *qp_plan_grown(qp_builder *b, void *block, size_t *capacity, size_t need, size_t size) {
    if (!qp_grow(&block, capacity, need, size)) b->failed = true;
    return block;
}

/* ---- which level first needs a cell (section 4.2) ----
 * At level n samples lie on the patch's edges or at least 2^-n away from them; the rest is arbitrary. */

static uint8_t span_need(qp_span s) {
    if (s.lo == 0 || s.hi == QP_PLAN_ONE) return 0;
    for (uint32_t n = 1; n < QP_LEVELS; ++n) {
        uint64_t step = QP_PLAN_ONE >> n, lo = s.lo > step ? s.lo : step,
                 hi = s.hi < QP_PLAN_ONE - step ? s.hi : QP_PLAN_ONE - step;
        if (lo < hi) return (uint8_t)n;
        if (lo == hi && (lo != s.lo || s.own_lo) && (hi != s.hi || s.own_hi)) return (uint8_t)n;
    }
    return QP_LEVELS - 1;
}

/* A cell that touches the patch's edge in u is met by the samples on that edge whatever the level, so v
 * decides, and the other way round; one that touches both holds a corner. */
uint8_t qp_plan_cell_need(qp_span u, qp_span v) {
    uint8_t a = span_need(u), b = span_need(v);
    return a > b ? a : b;
}

uint8_t qp_plan_point_need(uint64_t u, uint64_t v) {
    return qp_plan_cell_need((qp_span){u, u, true, true}, (qp_span){v, v, true, true});
}

qp_span qp_plan_half(qp_span s, bool upper, bool tie_low) {
    uint64_t mid = (s.lo + s.hi) / 2;
    if (upper) return (qp_span){mid, s.hi, !tie_low, s.own_hi};
    return (qp_span){s.lo, mid, s.own_lo, tie_low};
}

/* Corner i of a cell is (cu, cv). */
bool qp_plan_corner_high_u(uint32_t i) {
    return i == 1 || i == 2;
}
bool qp_plan_corner_high_v(uint32_t i) {
    return i >= 2;
}

/* ---- final points ---- */

uint32_t qp_plan_new_final(qp_builder *b, uint8_t need, uint32_t kind) {
    uint32_t width = b->local.width;
    b->rows =
        qp_plan_grown(b, b->rows, &b->row_capacity, ((size_t)b->point_count + 1) * width, sizeof *b->rows);
    b->points =
        qp_plan_grown(b, b->points, &b->point_capacity, (size_t)b->point_count + 1, sizeof *b->points);
    if (b->failed) return 0;
    if (b->point_count >= QP_NO_POINT) {
        b->too_large = true;
        return 0;
    }
    b->points[b->point_count] =
        (qp_final_point){.need = need, .kind = (uint8_t)kind, .origin = QP_NO_POINT, .mode = QP_NO_POINT};
    return b->point_count++;
}

void qp_plan_lower_need(qp_builder *b, uint32_t point, uint8_t need) {
    if (!b->failed && need < b->points[point].need) b->points[point].need = need;
}

double *qp_plan_final_row(qp_builder *b, uint32_t point) {
    return b->rows + (size_t)point * b->local.width;
}

uint32_t qp_plan_copy_final(qp_builder *b, const qp_local *local, uint32_t level, uint32_t point,
                            uint8_t need) {
    uint32_t final = qp_plan_new_final(b, need, QP_POINT_REFINED | level << 2);
    if (b->failed || b->too_large) return 0;
    memcpy(qp_plan_final_row(b, final), qp_level_row(local, &local->level[level & 1], point),
           b->local.width * sizeof(double));
    return final;
}

/* Where a table holds the final point of a point of a level; NULL when memory is out. */
static uint32_t *find_final(qp_builder *b, qp_final_table *table, uint32_t level, uint32_t point) {
    if (point >= table->size) {
        uint32_t size = b->local.level[level & 1].count;
        table->of = qp_plan_grown(b, table->of, &table->capacity, size, sizeof(uint32_t));
        if (b->failed) return NULL;
        for (uint32_t i = table->size; i < size; ++i) table->of[i] = QP_NONE;
        table->size = size;
    }
    return &table->of[point];
}

/* The final point of a point of a level, shared by all nodes of that level that are not terminal. */
uint32_t qp_plan_shared_final(qp_builder *b, uint32_t level, uint32_t point, uint8_t need) {
    uint32_t *final = find_final(b, &b->absolute[level & 1], level, point);
    if (final == NULL) return 0;
    if (*final == QP_NONE) {
        *final = qp_plan_copy_final(b, &b->local, level, point, need);
    } else {
        qp_plan_lower_need(b, *final, need);
    }
    return *final;
}

uint32_t qp_plan_offset_final(qp_builder *b, uint32_t level, uint32_t point, uint8_t need, uint32_t origin) {
    uint32_t *final = find_final(b, &b->offsets[level & 1], level, point);
    if (final == NULL) return 0;
    qp_plan_lower_need(b, origin, need);
    if (*final != QP_NONE && b->points[*final].origin == origin) {
        qp_plan_lower_need(b, *final, need);
        return *final;
    }
    const uint32_t made = qp_plan_copy_final(b, &b->local, level, point, need);
    if (b->failed || b->too_large) return 0;
    double *row = qp_plan_final_row(b, made);
    const double *from = qp_plan_final_row(b, origin);
    for (uint32_t w = 0; w < b->local.width; ++w) row[w] -= from[w];
    b->points[made].origin = (uint16_t)origin;
    if (*final == QP_NONE) *final = made;
    return made;
}

uint32_t qp_plan_corner_origin(qp_builder *b, uint32_t i) {
    if (!b->corner_known[i]) return QP_NO_POINT;
    if (b->corner_final[i] != QP_NONE) return b->corner_final[i];
    const uint8_t need = qp_plan_point_need(qp_plan_corner_high_u(i) ? QP_PLAN_ONE : 0,
                                            qp_plan_corner_high_v(i) ? QP_PLAN_ONE : 0);
    const uint32_t final = qp_plan_new_final(b, need, QP_POINT_LIMIT | b->base << 2);
    if (b->failed || b->too_large) return QP_NO_POINT;
    memcpy(qp_plan_final_row(b, final), b->corner_rows + (size_t)i * b->local.width,
           b->local.width * sizeof(double));
    return b->corner_final[i] = final;
}

/* Limit position and tangents of a cell's corner as three new points; tangents may be QP_NO_POINT. */
void qp_plan_limit_finals(qp_builder *b, uint32_t level, const qp_corner *corner, uint8_t need,
                          uint32_t out[3]) {
    out[0] = qp_plan_new_final(b, need, QP_POINT_LIMIT | level << 2);
    out[1] = qp_plan_new_final(b, need, QP_POINT_TANGENT | level << 2);
    out[2] = qp_plan_new_final(b, need, QP_POINT_TANGENT | level << 2);
    if (b->failed || b->too_large) return;
    bool tangents;
    qp_limit_stencils(&b->local, &b->local.level[level & 1], corner, qp_plan_final_row(b, out[0]), &tangents);
    if (b->local.failed) b->failed = true;
    if (tangents) return;
    b->point_count -= 2;
    out[1] = out[2] = QP_NO_POINT;
}
