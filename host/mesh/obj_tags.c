/* Tag lines of OpenSubdiv's regression shapes: "t NAME I/F/S", then I integers, F floats and S words. */
#include "host/base/number.h"
#include "host/mesh/obj_reader.h"

#include <string.h>

typedef struct tag {
    const char *name;
    size_t length;
    int64_t ints, floats, words; /* counts announced */
    const char *word;            /* the first word argument */
    size_t word_length;
} tag;

/* "I/F/S" as one word. */
static qp_status read_counts(obj_reader *r, tag *t) {
    const char *word;
    size_t length;
    int64_t counts[3];
    bool good = obj_read_word(r, &word, &length);
    const char *end = good ? word + length : NULL;
    for (int i = 0; i < 3 && good; ++i) {
        if (i > 0) good = word < end && *word++ == '/';
        if (good) word = qp_read_int64(word, end, &counts[i]);
        good = good && word != NULL && counts[i] >= 0;
    }
    if (!good || word != end) {
        return obj_fail_at(r, r->line, "tag %.*s wants its three counts as I/F/S", (int)t->length, t->name);
    }
    t->ints = counts[0];
    t->floats = counts[1];
    t->words = counts[2];
    return QP_OK;
}

/* The arguments, into r->ints, r->floats and t->word. Counts that announce more than the line has are found
 * by running into its end, so that no count makes us allocate. */
static qp_status read_arguments(obj_reader *r, tag *t) {
    const char *word;
    size_t length;
    r->ints.count = r->floats.count = 0;
    for (int64_t i = 0; i < t->ints; ++i) {
        int64_t value;
        if (!obj_read_word(r, &word, &length)) goto too_few;
        if (qp_read_int64(word, word + length, &value) != word + length || value < 0 || value > INT32_MAX) {
            return obj_fail_at(r, r->line, "tag %.*s: \"%.*s\" is no index", (int)t->length, t->name,
                               (int)(length < 40 ? length : 40), word);
        }
        qp_status status = obj_push_u32(r, &r->ints, (uint32_t)value);
        if (status != QP_OK) return status;
    }
    for (int64_t i = 0; i < t->floats; ++i) {
        double value;
        if (obj_at_line_end(r)) goto too_few;
        qp_status status = obj_read_number(r, "sharpness", &value);
        if (status == QP_OK && value < 0) {
            status =
                obj_fail_at(r, r->line, "tag %.*s: sharpness %g is negative", (int)t->length, t->name, value);
        }
        /* Beyond 10 all are infinite; this keeps the conversion within a float. */
        if (status == QP_OK) status = obj_push_float(r, &r->floats, (float)(value > 1e6 ? 1e6 : value));
        if (status != QP_OK) return status;
    }
    for (int64_t i = 0; i < t->words; ++i) {
        if (!obj_read_word(r, &word, &length)) goto too_few;
        if (i == 0) {
            t->word = word;
            t->word_length = length;
        }
    }
    if (!obj_at_line_end(r)) {
        return obj_fail_at(r, r->line, "tag %.*s has more arguments than its counts say", (int)t->length,
                           t->name);
    }
    return QP_OK;
too_few:
    return obj_fail_at(r, r->line, "tag %.*s has fewer arguments than its counts say", (int)t->length,
                       t->name);
}

/* Pairs of integers; one float for all of them, or the pair that starts at integer j takes float j, as
 * OpenSubdiv's reader does. */
static qp_status add_creases(obj_reader *r, uint32_t line) {
    size_t ints = r->ints.count, floats = r->floats.count;
    if (ints < 2 || ints % 2 != 0) return obj_fail_at(r, line, "tag crease wants pairs of vertices");
    if (floats != 1 && floats + 1 < ints) {
        return obj_fail_at(r, line, "tag crease with %zu integers wants 1 float, or at least %zu", ints,
                           ints - 1);
    }
    qp_status status = QP_OK;
    for (size_t j = 0; j < ints && status == QP_OK; j += 2) {
        status = obj_push_u32(r, &r->crease_vertices, r->ints.at[j]);
        if (status == QP_OK) status = obj_push_u32(r, &r->crease_vertices, r->ints.at[j + 1]);
        if (status == QP_OK) {
            status = obj_push_float(r, &r->crease_sharpness, r->floats.at[floats > 1 ? j : 0]);
        }
        if (status == QP_OK) status = obj_push_u32(r, &r->crease_lines, line);
    }
    return status;
}

static qp_status add_corners(obj_reader *r, uint32_t line) {
    size_t ints = r->ints.count, floats = r->floats.count;
    if (ints < 1) return obj_fail_at(r, line, "tag corner names no vertex");
    if (floats != 1 && floats < ints) {
        return obj_fail_at(r, line, "tag corner with %zu integers wants 1 float, or %zu", ints, ints);
    }
    qp_status status = QP_OK;
    for (size_t j = 0; j < ints && status == QP_OK; ++j) {
        status = obj_push_u32(r, &r->corner_vertices, r->ints.at[j]);
        if (status == QP_OK) {
            status = obj_push_float(r, &r->corner_sharpness, r->floats.at[floats > 1 ? j : 0]);
        }
        if (status == QP_OK) status = obj_push_u32(r, &r->corner_lines, line);
    }
    return status;
}

static qp_status add_holes(obj_reader *r, uint32_t line) {
    qp_status status = QP_OK;
    for (size_t j = 0; j < r->ints.count && status == QP_OK; ++j) {
        status = obj_push_u32(r, &r->hole_faces, r->ints.at[j]);
        if (status == QP_OK) status = obj_push_u32(r, &r->hole_lines, line);
    }
    return status;
}

/* A tag whose one integer is a choice from 0 to `last`. */
static qp_status set_number(obj_reader *r, const tag *t, uint32_t line, uint32_t last, int *choice) {
    if (r->ints.count != 1 || r->ints.at[0] > last) {
        return obj_fail_at(r, line, "tag %.*s wants one integer from 0 to %u", (int)t->length, t->name, last);
    }
    *choice = (int)r->ints.at[0];
    return QP_OK;
}

/* A tag whose first word is one of two. */
static qp_status set_word(obj_reader *r, const tag *t, uint32_t line, const char *first, const char *second,
                          int *choice) {
    if (t->word != NULL && obj_word_is(t->word, t->word_length, first)) {
        *choice = 0;
    } else if (t->word != NULL && obj_word_is(t->word, t->word_length, second)) {
        *choice = 1;
    } else {
        return obj_fail_at(r, line, "tag %.*s wants \"%s\" or \"%s\"", (int)t->length, t->name, first,
                           second);
    }
    return QP_OK;
}

qp_status obj_read_tag(obj_reader *r) {
    static const char *const edits[] = {"vertexedit", "edgeedit", "faceedit"};
    static const char *const known[] = {"crease",         "corner",
                                        "hole",           "interpolateboundary",
                                        "creasemethod",   "facevaryinginterpolateboundary",
                                        "smoothtriangles"};
    enum { CREASE, CORNER, HOLE, BOUNDARY, CREASE_METHOD, FVAR_BOUNDARY, TRIANGLES, KNOWN };
    uint32_t line = r->line;
    tag t = {0};
    if (!obj_read_word(r, &t.name, &t.length)) return obj_fail_at(r, line, "a tag line without a tag");
    if (t.length > 64) return obj_fail_at(r, line, "a tag name of %zu characters", t.length);
    for (int i = 0; i < 3; ++i) {
        if (!obj_word_is(t.name, t.length, edits[i])) continue;
        if (obj_new_name(r, OBJ_TAG, "vertexedit", 10)) {
            obj_warn(r, "hierarchical edits are ignored (%s)", edits[i]);
        }
        return QP_OK;
    }
    int kind = 0;
    while (kind < KNOWN && !obj_word_is(t.name, t.length, known[kind])) ++kind;
    if (kind == KNOWN) {
        if (obj_new_name(r, OBJ_TAG, t.name, t.length)) {
            obj_warn(r, "unknown tag %.*s ignored", (int)t.length, t.name);
        }
        return QP_OK;
    }
    qp_status status = read_counts(r, &t);
    if (status == QP_OK) status = read_arguments(r, &t);
    if (status != QP_OK) return status;
    switch (kind) {
    case CREASE:
        return add_creases(r, line);
    case CORNER:
        return add_corners(r, line);
    case HOLE:
        return add_holes(r, line);
    case BOUNDARY:
        return set_number(r, &t, line, 2, &r->boundary);
    case FVAR_BOUNDARY:
        return set_number(r, &t, line, 5, &r->fvar_boundary);
    case CREASE_METHOD:
        return set_word(r, &t, line, "normal", "chaikin", &r->crease_method);
    default:
        return set_word(r, &t, line, "catmark", "smooth", &r->triangle_rule);
    }
}

static qp_status check_list(obj_reader *r, const u32_list *list, const u32_list *lines, size_t per_line,
                            uint32_t limit, const char *what) {
    for (size_t i = 0; i < list->count; ++i) {
        if (list->at[i] >= limit) {
            return obj_fail_at(r, lines->at[i / per_line], "tag names %s %u, but there are %u (from 0)", what,
                               list->at[i], limit);
        }
    }
    return QP_OK;
}

qp_status obj_check_tags(obj_reader *r, uint32_t n_vertices, uint32_t n_faces) {
    qp_status status = check_list(r, &r->crease_vertices, &r->crease_lines, 2, n_vertices, "vertex");
    if (status == QP_OK)
        status = check_list(r, &r->corner_vertices, &r->corner_lines, 1, n_vertices, "vertex");
    if (status == QP_OK) status = check_list(r, &r->hole_faces, &r->hole_lines, 1, n_faces, "face");
    return status;
}
