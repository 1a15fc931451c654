/* Plans as a device reads them (kernels/plan_layout.h). */
#include "host/plan/plan.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is left of row i without its mode, in `rest`, and otherwise the row. */
static const double *row_rest(const qp_plan *plan, uint32_t i, double *rest) {
    const double *row = plan->weights + (size_t)i * plan->ring_size;
    if ((plan->flags & QP_PLAN_MODES) == 0 || plan->point_modes[i] == QP_NO_POINT) return row;
    const double *mode = plan->weights + (size_t)plan->point_modes[i] * plan->ring_size;
    for (uint32_t j = 0; j < plan->ring_size; ++j) rest[j] = row[j] - plan->point_shares[i] * mode[j];
    return rest;
}

static void put_real(qp_precision precision, void *reals, size_t at, double x) {
    if (precision == QP_DOUBLE)
        ((double *)reals)[at] = x;
    else /* some devices flush denormal numbers; weights that small change nothing beside the others */
        ((float *)reals)[at] = fabs(x) < (double)FLT_MIN ? 0.0f : (float)x;
}

/* What is smaller than this in a row of floats is no weight but the rounding error of a 0, which another plan that has the same
 * point would have otherwise; 2^-32 of the largest weight is less than a hundredth of what rounding that one to a float changes. */
static double smallest_weight(qp_precision precision, const double *row, uint32_t width) {
    double largest = 0.0;
    for (uint32_t j = 0; j < width; ++j) largest = fmax(largest, fabs(row[j]));
    return precision == QP_FLOAT ? 0x1p-32 * largest : 0.0;
}

/* rest: scratch, [ring_size]. */
static void pack_reals(const qp_plan *plan, qp_precision precision, void *reals, size_t at, double *rest) {
    const uint32_t rows = plan->point_count, width = plan->ring_size;
    for (uint32_t i = 0; i < rows; ++i) {
        const double *row = row_rest(plan, i, rest), scale = ldexp(1.0, plan->point_scales[i]);
        const double least = smallest_weight(precision, row, width);
        for (uint32_t j = 0; j < width; ++j)
            put_real(precision, reals, at + (size_t)j * rows + i, fabs(row[j]) < least ? 0.0 : row[j] * scale);
        if ((plan->flags & QP_PLAN_MODES) != 0)
            put_real(precision, reals, at + (size_t)width * rows + i, plan->point_shares[i] * scale);
    }
    at += qp_plan_first_constant(plan);
    for (uint32_t c = 0; c < plan->constant_count; ++c)
        put_real(precision, reals, at + c, plan->constants[c]);
}

static void pack_tree(const qp_plan *plan, uint32_t *words) {
    memcpy(words, plan->tree, plan->tree_words * sizeof *plan->tree);
    words += plan->tree_words;
    const uint32_t count = qp_plan_anchor_words(plan);
    for (uint32_t k = 0; k < count; ++k) words[k] = 0;
    for (uint32_t i = 0; count != 0 && i < plan->point_count; ++i)
        words[i / 8] |= (uint32_t)plan->point_anchors[i] << (i % 8 * 4);
}

static void pack_head(const qp_plan *plan, size_t tree, size_t reals, uint32_t *head) {
    head[QP_HEAD_RING] = plan->ring_size;
    head[QP_HEAD_POINTS] = plan->point_count;
    head[QP_HEAD_TREE] = (uint32_t)tree;
    head[QP_HEAD_REALS] = (uint32_t)reals;
    head[QP_HEAD_FLAGS] = plan->flags;
    head[QP_HEAD_ANCHORS] = plan->tree_words;
    head[QP_HEAD_BASE] = plan->base;
    memcpy(head + QP_HEAD_ROWS, plan->rows, sizeof plan->rows);
}

qp_status qp_surface_pack(const qp_surface *const *surfaces, uint32_t n_surfaces, qp_precision precision,
                          qp_plan_pack *pack, qp_error *err) {
    uint32_t widest = 0;
    *pack = (qp_plan_pack){0};
    for (uint32_t s = 0; s < n_surfaces; ++s) {
        pack->head_words += (size_t)surfaces[s]->n_plans * QP_HEAD_WORDS;
        for (uint32_t p = 0; p < surfaces[s]->n_plans; ++p) {
            const qp_plan *plan = surfaces[s]->plans[p];
            pack->tree_words += plan->tree_words + qp_plan_anchor_words(plan);
            if (plan->ring_size > widest) widest = plan->ring_size;
            pack->real_count += (size_t)qp_plan_first_constant(plan) + plan->constant_count;
        }
    }
    if (pack->tree_words > UINT32_MAX || pack->real_count > UINT32_MAX) {
        return qp_fail(err, QP_SYSTEM,
                       "the plans of this surface hold more than 2^32 words; lower the depth");
    }
    size_t real_size = precision == QP_DOUBLE ? sizeof(double) : sizeof(float);
    pack->heads = qp_alloc(pack->head_words, sizeof(uint32_t), true);
    pack->tree = qp_alloc(pack->tree_words, sizeof(uint32_t), false);
    pack->reals = qp_alloc(pack->real_count, real_size, false);
    double *rest = qp_alloc(widest, sizeof *rest, false);
    if (pack->heads == NULL || pack->tree == NULL || pack->reals == NULL || rest == NULL) {
        free(rest);
        free(pack->heads);
        free(pack->tree);
        free(pack->reals);
        size_t bytes = pack->real_count * real_size;
        *pack = (qp_plan_pack){0};
        return qp_fail_memory(err, bytes, "packed plans");
    }
    size_t tree = 0, reals = 0;
    uint32_t *head = pack->heads;
    for (uint32_t s = 0; s < n_surfaces; ++s) {
        for (uint32_t p = 0; p < surfaces[s]->n_plans; ++p, head += QP_HEAD_WORDS) {
            const qp_plan *plan = surfaces[s]->plans[p];
            pack_head(plan, tree, reals, head);
            pack_tree(plan, pack->tree + tree);
            pack_reals(plan, precision, pack->reals, reals, rest);
            tree += plan->tree_words + qp_plan_anchor_words(plan);
            reals += (size_t)qp_plan_first_constant(plan) + plan->constant_count;
        }
    }
    free(rest);
    return QP_OK;
}
