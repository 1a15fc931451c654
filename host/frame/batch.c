/* Cuts a layout into batches that fit the device, and hands it over. Within a batch the scratch buffer holds
 * each patch's control points one after the other: the worst case, as nothing is released before
 * the batch is done. (The paper gives every patch as many points as the deepest one needs; prefix sums cost
 * nothing here, because the host knows every patch's level.) */
#include "host/frame/frame.h"
#include "kernels/frame_layout.h"

#include <stdlib.h>

static void put_wide(uint32_t *word, uint64_t value) {
    word[0] = (uint32_t)value;
    word[1] = (uint32_t)(value >> 32);
}

static void write_entry(const qp_frame *frame, const qp_frame_item *item, const qp_frame_batch *batch,
                        uint64_t support, uint32_t *entry) {
    const qp_frame_plan plan = qp_frame_plan_of(frame, item->patch);
    for (uint32_t i = 0; i < QP_ENTRY_WORDS; ++i) entry[i] = 0;
    entry[QP_ENTRY_HEAD] = plan.index * QP_HEAD_WORDS;
    entry[QP_ENTRY_ROTATION] = plan.rotation;
    entry[QP_ENTRY_ROWS] = qp_frame_rows(frame, item);
    entry[QP_ENTRY_SAMPLES] = item->samples;
    entry[QP_ENTRY_LEVEL] = item->level;
    entry[QP_ENTRY_ORIGIN] = qp_frame_origin(plan.surface, item->patch);
    put_wide(entry + QP_ENTRY_RING, plan.ring);
    put_wide(entry + QP_ENTRY_SUPPORT, support);
    put_wide(entry + QP_ENTRY_GRID, item->grid);
    put_wide(entry + QP_ENTRY_OUT, item->out - batch->first_sample);
    if (qp_frame_is_cached(frame)) put_wide(entry + QP_ENTRY_NUMBERS, qp_cache_first(frame, item->patch));
}

/* Appends the batch that starts at item `begin`; *end is the first item it leaves out. */
static qp_status cut_batch(qp_frame *frame, size_t begin, size_t *end, uint32_t *next_entry, size_t *capacity,
                           qp_error *err) {
    const qp_frame_layout *layout = &frame->layout;
    const qp_device_info *info = qp_device_get_info(frame->device);
    const uint64_t most_samples = info->max_buffer_bytes / (6 * frame->real_size);
    uint64_t scratch = info->memory_bytes / 4;
    if (scratch == 0 || scratch > info->max_buffer_bytes) scratch = info->max_buffer_bytes;
    const uint64_t most_points = scratch / (4 * frame->real_size);
    if (!qp_grow((void **)&frame->batches, capacity, frame->n_batches + 1, sizeof *frame->batches))
        return qp_fail_memory(err, sizeof *frame->batches, "a frame");
    qp_frame_batch *batch = &frame->batches[frame->n_batches++];
    *batch = (qp_frame_batch){.first_sample = layout->items[begin].out};
    size_t i = begin;
    for (; i < layout->n_items; ++i) {
        const qp_frame_item *item = &layout->items[i];
        const bool fast = qp_frame_is_fast(frame, item->patch);
        const uint64_t points = fast ? 0 : qp_frame_rows(frame, item);
        const bool full = batch->points + points > most_points && !qp_frame_has_ring(frame);
        if (i > begin && (batch->n_samples + item->samples > most_samples || full)) break;
        batch->n_samples += item->samples;
        batch->points += points;
        frame->all_points += points;
        if (points > frame->largest_points) frame->largest_points = points;
        if (fast)
            ++batch->n_regular;
        else
            ++batch->n_general;
    }
    batch->first_general = *next_entry;
    batch->first_regular = *next_entry + batch->n_general;
    *next_entry += batch->n_general + batch->n_regular;
    if (batch->points > frame->peak_points) frame->peak_points = batch->points;
    if (batch->n_general > frame->peak_patches) frame->peak_patches = batch->n_general;
    *end = i;
    return QP_OK;
}

/* Entries of one batch: those of the general kernels first, in order of their plans, so that patches with the
 * same weights follow each other, unless the order of patches is asked for. count: scratch, [n_plans + 1]. */
static void write_batch(qp_frame *frame, const qp_frame_batch *batch, size_t begin, size_t end,
                        uint32_t *count, uint32_t *entries) {
    const qp_frame_layout *layout = &frame->layout;
    uint32_t regular = batch->first_regular;
    for (uint32_t p = 0; p <= frame->n_plans; ++p) count[p] = 0;
    for (size_t i = begin; i < end; ++i) {
        uint32_t patch = layout->items[i].patch;
        if (!qp_frame_is_fast(frame, patch)) ++count[qp_frame_plan_of(frame, patch).index + 1];
    }
    for (uint32_t p = 0; p < frame->n_plans; ++p) count[p + 1] += count[p];
    const bool by_patch = frame->options.supports.issue_order == QP_ISSUE_BY_PATCH;
    uint32_t next = batch->first_general;
    uint64_t support = 0;
    for (size_t i = begin; i < end; ++i) {
        const qp_frame_item *item = &layout->items[i];
        if (qp_frame_is_fast(frame, item->patch)) {
            write_entry(frame, item, batch, 0, entries + QP_ENTRY_WORDS * (size_t)regular++);
        } else {
            const uint32_t of_plan = batch->first_general + count[qp_frame_plan_of(frame, item->patch).index]++;
            const uint32_t at = by_patch ? next++ : of_plan;
            qp_ring_note(frame, at, i);
            write_entry(frame, item, batch, support, entries + QP_ENTRY_WORDS * (size_t)at);
            support += qp_frame_rows(frame, item);
        }
    }
}

static qp_status write_entries(qp_frame *frame, uint32_t **entries, const size_t *ends, qp_error *err) {
    const size_t bytes = frame->layout.n_items * QP_ENTRY_WORDS * sizeof(uint32_t);
    uint32_t *count = qp_alloc((size_t)frame->n_plans + 1, sizeof *count, false);
    *entries = qp_alloc(frame->layout.n_items, QP_ENTRY_WORDS * sizeof(uint32_t), false);
    if (count == NULL || *entries == NULL) {
        free(count);
        return qp_fail_memory(err, bytes, "the patches of a frame");
    }
    for (size_t b = 0; b < frame->n_batches; ++b)
        write_batch(frame, &frame->batches[b], b == 0 ? 0 : ends[b - 1], ends[b], count, *entries);
    free(count);
    return QP_OK;
}

/* A page-aligned block of at least `bytes`; contents are not kept. */
static qp_status reserve_pages(void **block, size_t *have, size_t bytes, const char *what, qp_error *err) {
    const size_t page = 4096;
    if (*block != NULL && bytes <= *have) return QP_OK;
    free(*block);
    *block = NULL;
    *have = 0;
    if (bytes > SIZE_MAX - page) return qp_fail_memory(err, bytes, what);
    const size_t rounded = (bytes / page + 1) * page;
    *block = aligned_alloc(page, rounded);
    if (*block == NULL) return qp_fail_memory(err, bytes, what);
    *have = rounded;
    return QP_OK;
}

/* The stream's memory, and a buffer over each batch's part of it. */
static qp_status wrap_stream(qp_frame *frame, qp_error *err) {
    const size_t samples = (size_t)frame->layout.n_evaluated, sample_bytes = 6 * frame->real_size;
    qp_status status = reserve_pages(&frame->vertices, &frame->vertex_bytes, samples * sample_bytes,
                                     "the vertex stream", err);
    if (status == QP_OK)
        status = reserve_pages((void **)&frame->flags, &frame->flag_bytes, samples, "the vertex stream", err);
    if (status == QP_OK && frame->layout.order != NULL)
        status = reserve_pages(&frame->ordered, &frame->ordered_bytes,
                               samples * ((frame->options.want_derivatives ? 2 : 1) * sample_bytes + 1),
                               "the vertex stream", err);
    if (status == QP_OK && frame->options.want_derivatives)
        status = reserve_pages(&frame->derivatives, &frame->derivative_bytes, samples * sample_bytes,
                               "derivatives", err);
    for (size_t b = 0; b < frame->n_batches && status == QP_OK; ++b) {
        qp_frame_batch *batch = &frame->batches[b];
        if (frame->options.want_derivatives)
            status = qp_buffer_wrap(frame->device, &batch->derivatives,
                                    (char *)frame->derivatives + (size_t)batch->first_sample * sample_bytes,
                                    (size_t)batch->n_samples * sample_bytes, "derivatives", err);
        if (status != QP_OK) break;
        status = qp_buffer_wrap(frame->device, &batch->vertices,
                                (char *)frame->vertices + (size_t)batch->first_sample * sample_bytes,
                                (size_t)batch->n_samples * sample_bytes, "the vertex stream", err);
        if (status == QP_OK)
            status = qp_buffer_wrap(frame->device, &batch->flags, frame->flags + batch->first_sample,
                                    (size_t)batch->n_samples, "the vertex stream", err);
    }
    return status;
}

/* Coordinates in the device's form, with the padding that whole blocks of lanes read. */
static qp_status upload_grid(qp_frame *frame, qp_buffer *buffer, const double *from, size_t points,
                             qp_error *err) {
    const size_t count = points + QP_PADDING;
    void *signs = qp_alloc(count, frame->real_size, true);
    if (signs == NULL) return qp_fail_memory(err, count * frame->real_size, "tessellation grids");
    for (size_t i = 0; i < points; ++i) {
        const double s = qp_signed_coordinate(from[i], frame->options.precision);
        if (frame->options.precision == QP_DOUBLE)
            ((double *)signs)[i] = s;
        else
            ((float *)signs)[i] = (float)s;
    }
    qp_status status = qp_frame_upload(frame, buffer, signs, count * frame->real_size, "tessellation grids", err);
    free(signs);
    return status;
}

qp_status qp_frame_upload_layout(qp_frame *frame, qp_error *err) {
    const qp_frame_layout *layout = &frame->layout;
    size_t *ends = NULL, ends_capacity = 0, batch_capacity = 0;
    uint32_t *entries = NULL, next_entry = 0;
    qp_status status = QP_OK;
    if (layout->n_items > UINT32_MAX)
        return qp_fail(err, QP_BAD_INPUT, "too many patches for one frame (%zu)", layout->n_items);
    for (size_t begin = 0; begin < layout->n_items && status == QP_OK;) {
        size_t end = begin;
        status = cut_batch(frame, begin, &end, &next_entry, &batch_capacity, err);
        if (status == QP_OK && !qp_grow((void **)&ends, &ends_capacity, frame->n_batches, sizeof *ends))
            status = qp_fail_memory(err, frame->n_batches * sizeof *ends, "a frame");
        if (status == QP_OK) ends[frame->n_batches - 1] = end;
        begin = end;
    }
    if (status == QP_OK) status = qp_ring_start_notes(frame, err);
    if (status == QP_OK) status = write_entries(frame, &entries, ends, err);
    if (status == QP_OK)
        status = qp_frame_upload(frame, &frame->entries, entries, layout->n_items * QP_ENTRY_WORDS * sizeof(uint32_t),
                        "the patches of a frame", err);
    if (status == QP_OK)
        status = upload_grid(frame, &frame->grid_u, layout->grid_u, layout->grid_points, err);
    if (status == QP_OK)
        status = upload_grid(frame, &frame->grid_v, layout->grid_v, layout->grid_points, err);
    if (status == QP_OK && qp_frame_has_ring(frame))
        status = qp_ring_reserve(frame, err);
    else if (status == QP_OK)
        status = qp_buffer_reserve(frame->device, &frame->support,
                                   (size_t)frame->peak_points * 4 * frame->real_size, "control points", err);
    if (status == QP_OK) status = wrap_stream(frame, err);
    free(entries);
    free(ends);
    return status;
}

qp_supports_report qp_frame_scratch_report(const qp_frame *frame) {
    const uint64_t bytes = 4 * frame->real_size;
    qp_supports_report report = {.kind = frame->options.supports.kind,
                                 .capacity_bytes = frame->peak_points * bytes,
                                 .worst_case_bytes = frame->all_points * bytes,
                                 .largest_bytes = frame->largest_points * bytes,
                                 .peak_bytes = frame->peak_points * bytes,
                                 .allocated_bytes = frame->all_points * bytes,
                                 .in_flight = frame->peak_patches,
                                 .points_needed = frame->all_points,
                                 .points_computed = frame->all_points};
    for (size_t b = 0; b < frame->n_batches; ++b) report.allocations += frame->batches[b].n_general;
    return report;
}

void qp_frame_drop_layout(qp_frame *frame) {
    for (size_t b = 0; b < frame->n_batches; ++b) {
        qp_buffer_free(frame->device, &frame->batches[b].vertices);
        qp_buffer_free(frame->device, &frame->batches[b].flags);
        qp_buffer_free(frame->device, &frame->batches[b].derivatives);
    }
    free(frame->batches);
    free(frame->ring.items);
    frame->ring.items = NULL;
    frame->batches = NULL;
    frame->n_batches = 0;
    frame->peak_points = frame->all_points = frame->largest_points = frame->peak_patches = 0;
    frame->tessellated = false;
    qp_layout_free(&frame->layout);
}
