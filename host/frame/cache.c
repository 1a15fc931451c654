#include "host/frame/cache.h"
#include "host/frame/frame.h"
#include "kernels/cache_layout.h"
#include "kernels/frame_layout.h"

#include <stdlib.h>
#include <string.h>

bool qp_frame_is_cached(const qp_frame *frame) {
    return frame->options.supports.kind == QP_SUPPORTS_CACHE;
}

static bool is_bounded(const qp_frame *frame) {
    return frame->options.supports.cache_policy != QP_CACHE_ALL;
}

static size_t place_bytes(const qp_frame *frame) {
    return 4 * frame->real_size;
}

/* Words of tags of a cache of this shape. */
static size_t tag_words(const qp_frame *frame, uint32_t places, uint32_t sets) {
    return is_bounded(frame) ? 2 * (size_t)places + sets : places;
}

/* Sets and places for `bytes` of points and tags together. */
static void choose_shape(const qp_frame *frame, uint32_t *places, uint32_t *sets, uint32_t *ways) {
    const qp_supports_options *o = &frame->options.supports;
    *ways = o->cache_policy == QP_CACHE_DIRECT ? 1 : QP_CACHE_MOST_WAYS;
    const uint64_t set_bytes = *ways * (place_bytes(frame) + 2 * sizeof(uint32_t)) + sizeof(uint32_t);
    uint64_t n = o->cache_bytes / set_bytes;
    if (n > UINT32_MAX / QP_CACHE_MOST_WAYS) n = UINT32_MAX / QP_CACHE_MOST_WAYS;
    *sets = (uint32_t)n;
    *places = *sets * *ways;
}

/* ---- tables ---- */

/* `bytes` of a buffer of which the first `keep` are to stay as they are and the rest is to be 0. */
static qp_status renew(qp_frame *frame, qp_buffer *buffer, size_t bytes, size_t keep, const char *what,
                       qp_error *err) {
    char *content = qp_alloc(bytes, 1, true);
    if (content == NULL) return qp_fail_memory(err, bytes, what);
    qp_status status = QP_OK;
    if (keep != 0) status = qp_buffer_read(frame->device, buffer, 0, content, keep, err);
    if (status == QP_OK) status = qp_frame_upload(frame, buffer, content, bytes, what, err);
    free(content);
    return status;
}

/* Stamps of the shadow, and how many patches share a point. */
static qp_status upload_seen(qp_frame *frame, uint32_t keep, qp_error *err) {
    qp_cache *c = &frame->cache;
    const qp_unique *u = c->unique;
    const size_t words = is_bounded(frame) ? 2 * (size_t)u->n_points : 2;
    uint32_t *seen = qp_alloc(words, sizeof *seen, true);
    if (seen == NULL) return qp_fail_memory(err, words * sizeof *seen, "a cache of control points");
    qp_status status = QP_OK;
    if (keep != 0)
        status = qp_buffer_read(frame->device, &c->seen, 0, seen, 2 * (size_t)keep * sizeof *seen, err);
    for (uint32_t i = 0; is_bounded(frame) && i < u->n_points; ++i) seen[2 * (size_t)i + 1] = u->shares[i];
    if (status == QP_OK)
        status =
            qp_frame_upload(frame, &c->seen, seen, words * sizeof *seen, "a cache of control points", err);
    free(seen);
    return status;
}

/* Tags without those of numbers from `keep` on; counts what is left. */
static qp_status renew_tags(qp_frame *frame, uint32_t keep, qp_error *err) {
    qp_cache *c = &frame->cache;
    const size_t words = tag_words(frame, c->places, c->sets);
    uint32_t *tags = qp_alloc(words, sizeof *tags, true);
    if (tags == NULL) return qp_fail_memory(err, words * sizeof *tags, "a cache of control points");
    qp_status status = QP_OK;
    const size_t old = is_bounded(frame) ? words : keep;
    if (keep != 0) status = qp_buffer_read(frame->device, &c->tags, 0, tags, old * sizeof *tags, err);
    c->valid = 0;
    for (uint32_t i = 0; i < c->places; ++i) {
        if (is_bounded(frame)) {
            if (tags[2 * (size_t)i + 1] > keep) tags[2 * (size_t)i + 1] = 0;
            c->valid += tags[2 * (size_t)i + 1] != 0;
        } else {
            c->valid += tags[i] == QP_CACHE_VALID;
        }
    }
    if (status == QP_OK)
        status =
            qp_frame_upload(frame, &c->tags, tags, words * sizeof *tags, "a cache of control points", err);
    free(tags);
    return status;
}

/* Points, tags and stamps for the numbers at hand; of those before, the points below `keep` stay. */
static qp_status shape(qp_frame *frame, uint32_t keep, qp_error *err) {
    qp_cache *c = &frame->cache;
    const size_t old_bytes = is_bounded(frame) ? c->places * place_bytes(frame) : keep * place_bytes(frame);
    if (is_bounded(frame)) {
        choose_shape(frame, &c->places, &c->sets, &c->ways);
    } else {
        c->places = c->sets = c->unique->n_points;
        c->ways = 1;
    }
    const size_t bytes = c->places * place_bytes(frame);
    qp_status status =
        renew(frame, &c->points, bytes, keep == 0 ? 0 : old_bytes, "a cache of control points", err);
    if (status == QP_OK) status = renew_tags(frame, keep, err);
    if (status == QP_OK) status = upload_seen(frame, is_bounded(frame) ? keep : 0, err);
    if (keep == 0) c->now = 0;
    return status;
}

qp_status qp_cache_number(qp_frame *frame, qp_plan_pack *pack, uint32_t **rings, qp_error *err) {
    qp_cache *c = &frame->cache;
    const uint32_t keep = c->ready ? c->unique->n_base : 0;
    c->ready = false;
    qp_unique *unique;
    qp_status status = qp_unique_create(frame, pack, rings, &unique, err);
    if (status != QP_OK) return status;
    qp_unique_free(c->unique);
    c->unique = unique;
    status = qp_frame_upload(frame, &c->numbers, unique->numbers,
                             (size_t)unique->n_needed * sizeof *unique->numbers,
                             "the numbers of control points", err);
    if (status == QP_OK) status = shape(frame, keep, err);
    c->ready = status == QP_OK;
    return status;
}

uint64_t qp_cache_first(const qp_frame *frame, uint32_t patch) {
    const qp_unique *u = frame->cache.unique;
    const uint8_t step = frame->patch_step == NULL ? 0 : frame->patch_step[patch];
    uint64_t surface = 0;
    for (uint8_t s = 0; s < step; ++s) surface += s == 0 || frame->deep[s - 1] != NULL;
    return u->first[surface * u->n_patches + patch];
}

/* ---- evaluation ---- */

static qp_status write_control(qp_frame *frame, qp_error *err) {
    const qp_cache *c = &frame->cache;
    uint32_t control[QP_CACHE_WORDS] = {[QP_CACHE_POLICY] = (uint32_t)frame->options.supports.cache_policy,
                                        [QP_CACHE_PLACES] = c->places,
                                        [QP_CACHE_SETS] = c->sets,
                                        [QP_CACHE_WAYS] = c->ways,
                                        [QP_CACHE_NOW] = c->now};
    return qp_frame_upload(frame, &frame->cache.control, control, sizeof control, "a cache of control points",
                           err);
}

qp_status qp_cache_begin(qp_frame *frame, qp_error *err) {
    qp_cache *c = &frame->cache;
    /* The shadow's clock must not come round to a stamp that is still about. */
    if (c->now > UINT32_MAX / 4) c->ready = false;
    qp_status status = QP_OK;
    if (!c->ready) {
        status = shape(frame, 0, err);
        c->ready = status == QP_OK;
    }
    return status == QP_OK ? write_control(frame, err) : status;
}

qp_status qp_cache_launch(qp_frame *frame, const qp_frame_batch *batch, double *ms, qp_error *err) {
    const qp_cache *c = &frame->cache;
    if (batch->points > INT32_MAX) /* or a place's version might come round during a launch */
        return qp_fail(err, QP_SYSTEM, "a cache takes no more than 2^31 control points a launch");
    const qp_arg args[] = {QP_ARGS_PLANS(frame), {NULL, batch->first_general},
                           {&c->numbers, 0},     {&c->control, 0},
                           {&c->tags, 0},        {&c->points, 0},
                           {&c->seen, 0},        {&frame->support, 0}};
    return qp_launch(frame->device, &frame->program, QP_KERNEL_CACHED_HULL, args,
                     sizeof args / sizeof args[0], batch->n_general, ms, err);
}

static uint64_t counter(const uint32_t *control, uint32_t word) {
    return control[word] | (uint64_t)control[word + 1] << 32;
}

qp_status qp_cache_report(qp_frame *frame, qp_supports_report *report, qp_error *err) {
    qp_cache *c = &frame->cache;
    const qp_unique *u = c->unique;
    uint32_t control[QP_CACHE_WORDS];
    qp_status status = qp_buffer_read(frame->device, &c->control, 0, control, sizeof control, err);
    if (status != QP_OK) return status;
    c->now = control[QP_CACHE_NOW];
    c->valid += counter(control, QP_CACHE_FILLED);
    report->capacity_bytes =
        c->places * (uint64_t)place_bytes(frame) + tag_words(frame, c->places, c->sets) * sizeof(uint32_t);
    report->peak_bytes = c->valid * place_bytes(frame);
    report->hits = counter(control, QP_CACHE_HITS);
    report->misses_cold = counter(control, QP_CACHE_COLD);
    report->misses_capacity = counter(control, QP_CACHE_OVER);
    report->misses_conflict = counter(control, QP_CACHE_CONFLICT);
    report->duplicates = counter(control, QP_CACHE_DUPLICATES);
    report->points_computed = report->misses_cold + report->misses_capacity + report->misses_conflict;
    report->points_needed = report->hits + report->points_computed;
    report->invalidated = c->invalidated;
    report->index_bytes = u->n_needed * sizeof *u->numbers +
                          (is_bounded(frame) ? 2 * (uint64_t)u->n_points * sizeof(uint32_t) : 0);
    c->invalidated = 0;
    return QP_OK;
}

void qp_cache_distrust(qp_frame *frame) {
    frame->cache.ready = false;
}

/* ---- positions that move ---- */

/* Which vertices have other bits than before; false when none has. */
static bool find_moved(const qp_frame *frame, const char *positions, uint8_t *moved) {
    const char *before = frame->cache.positions;
    const size_t step = 3 * frame->real_size, first = QP_POSITION_FIRST * frame->real_size;
    bool any = false;
    for (uint32_t v = 0; v < frame->surface->mesh->n_vertices; ++v) {
        moved[v] = memcmp(before + first + v * step, positions + first + v * step, step) != 0;
        any = any || moved[v] != 0;
    }
    return any;
}

static qp_status forget(qp_frame *frame, const uint32_t *list, uint32_t count, qp_error *err) {
    qp_cache *c = &frame->cache;
    qp_status status = write_control(frame, err);
    if (status == QP_OK)
        status = qp_frame_upload(frame, &c->list, list, count * sizeof *list, "moved control points", err);
    const qp_arg args[] = {{&c->list, 0}, {NULL, count}, {&c->control, 0}, {&c->tags, 0}, {&c->seen, 0}};
    double ms = 0;
    if (status == QP_OK)
        status = qp_launch(frame->device, &frame->program, QP_KERNEL_CACHE_FORGET, args,
                           sizeof args / sizeof args[0],
                           count / QP_CACHE_FORGET + (count % QP_CACHE_FORGET != 0), &ms, err);
    /* Also after a failure: what was started writes its time into ms. */
    qp_error finish_error;
    const qp_status finished = qp_device_finish(frame->device, &finish_error);
    if (status == QP_OK && finished != QP_OK) status = qp_fail(err, finished, "%s", finish_error.message);
    uint32_t control[QP_CACHE_WORDS] = {0};
    if (status == QP_OK) status = qp_buffer_read(frame->device, &c->control, 0, control, sizeof control, err);
    if (status != QP_OK) return status;
    c->invalidated += counter(control, QP_CACHE_DROPPED);
    c->valid -= counter(control, QP_CACHE_DROPPED);
    return QP_OK;
}

qp_status qp_cache_move(qp_frame *frame, const void *positions, size_t bytes, qp_error *err) {
    qp_cache *c = &frame->cache;
    if (c->positions != NULL && c->ready && c->unique->n_points != 0) {
        const uint32_t n_vertices = frame->surface->mesh->n_vertices;
        uint8_t *moved = qp_alloc(n_vertices, 1, true);
        uint32_t *list = NULL, count = 0;
        if (moved == NULL) return qp_fail_memory(err, n_vertices, "moved vertices");
        qp_status status = QP_OK;
        if (find_moved(frame, positions, moved)) {
            status = qp_unique_affected(c->unique, moved, &list, &count, err);
            if (status == QP_OK && count != 0) status = forget(frame, list, count, err);
        }
        free(moved);
        free(list);
        if (status != QP_OK) {
            c->ready = false;
            return status;
        }
    }
    if (c->position_bytes != bytes) {
        free(c->positions);
        c->positions = malloc(bytes);
        c->position_bytes = c->positions == NULL ? 0 : bytes;
        if (c->positions == NULL) return qp_fail_memory(err, bytes, "positions");
    }
    memcpy(c->positions, positions, bytes);
    return QP_OK;
}

void qp_cache_free(qp_frame *frame) {
    qp_cache *c = &frame->cache;
    qp_buffer *const buffers[] = {&c->numbers, &c->control, &c->tags, &c->points, &c->seen, &c->list};
    for (size_t i = 0; i < sizeof buffers / sizeof buffers[0]; ++i) qp_buffer_free(frame->device, buffers[i]);
    qp_unique_free(c->unique);
    free(c->positions);
    *c = (qp_cache){0};
}
