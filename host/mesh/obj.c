/* Wavefront OBJ: v, vt, vn, f in all index forms, and tag lines (obj_tags.c). Groups, materials, lines,
 * points and the like are skipped; an unknown keyword is warned of once. One pass over the text, then index
 * checks that need the final counts, then qp_mesh_analyse. */
#include "host/base/number.h"
#include "host/mesh/obj_reader.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Lists, messages ---- */

static qp_status grow_list(obj_reader *r, void *list, size_t *capacity, size_t count, size_t size) {
    if (count >= INT32_MAX) return obj_fail_at(r, r->line, "more than 2^31 - 1 elements of one kind");
    void *block;
    memcpy(&block, list, sizeof block);
    /* Doubling: a million faces should not copy their arrays twenty times. */
    bool good = qp_grow(&block, capacity, 2 * count + 64, size);
    memcpy(list, &block, sizeof block);
    return good ? QP_OK : qp_fail_memory(r->err, 2 * count * size, r->name);
}

qp_status obj_push_u32(obj_reader *r, u32_list *list, uint32_t value) {
    if (list->count == list->capacity) {
        qp_status status = grow_list(r, &list->at, &list->capacity, list->count, sizeof *list->at);
        if (status != QP_OK) return status;
    }
    list->at[list->count++] = value;
    return QP_OK;
}

qp_status obj_push_float(obj_reader *r, float_list *list, float value) {
    if (list->count == list->capacity) {
        qp_status status = grow_list(r, &list->at, &list->capacity, list->count, sizeof *list->at);
        if (status != QP_OK) return status;
    }
    list->at[list->count++] = value;
    return QP_OK;
}

qp_status obj_push_double(obj_reader *r, double_list *list, double value) {
    if (list->count == list->capacity) {
        qp_status status = grow_list(r, &list->at, &list->capacity, list->count, sizeof *list->at);
        if (status != QP_OK) return status;
    }
    list->at[list->count++] = value;
    return QP_OK;
}

qp_status obj_fail_at(obj_reader *r, uint32_t line, const char *format, ...) {
    char reason[200];
    va_list args;
    va_start(args, format);
    vsnprintf(reason, sizeof reason, format, args);
    va_end(args);
    return qp_fail(r->err, QP_BAD_INPUT, "%.250s:%u: %s", r->name, line, reason);
}

bool obj_new_name(obj_reader *r, int kind, const char *word, size_t length) {
    if (length >= OBJ_NAME_CHARS) length = OBJ_NAME_CHARS - 1;
    for (unsigned i = 0; i < r->name_count[kind]; ++i) {
        if (strncmp(r->names[kind][i], word, length) == 0 && r->names[kind][i][length] == '\0') return false;
    }
    if (r->name_count[kind] == OBJ_NAMES) return false;
    char *name = r->names[kind][r->name_count[kind]++];
    memcpy(name, word, length);
    name[length] = '\0';
    return true;
}

void obj_warn(obj_reader *r, const char *format, ...) {
    if (r->warning_count == OBJ_WARNINGS) return;
    char *line = r->warnings[r->warning_count++];
    int used = snprintf(line, sizeof r->warnings[0], "%.250s:%u: ", r->name, r->line);
    va_list args;
    va_start(args, format);
    vsnprintf(line + used, sizeof r->warnings[0] - (size_t)used, format, args);
    va_end(args);
    for (char *c = line; *c != '\0'; ++c) {
        if ((unsigned char)*c < 0x20 || *c == 0x7f) *c = '?';
    }
}

/* ---- Words and lines ---- */

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}
static bool is_line_end(char c) {
    return c == '\n' || c == '\r';
}

/* Steps over one line end: LF, CR LF or CR. */
static void step_line_end(obj_reader *r) {
    if (*r->at == '\r') ++r->at;
    if (r->at < r->end && *r->at == '\n') ++r->at;
    ++r->line;
}

/* A backslash that ends its line, at the reader's place. */
static bool at_continuation(const obj_reader *r) {
    return r->end - r->at >= 2 && r->at[0] == '\\' && is_line_end(r->at[1]);
}

void obj_skip_blanks(obj_reader *r) {
    for (;;) {
        if (r->at < r->end && is_blank(*r->at)) {
            ++r->at;
        } else if (at_continuation(r)) {
            ++r->at;
            step_line_end(r);
        } else {
            return;
        }
    }
}

bool obj_at_line_end(obj_reader *r) {
    obj_skip_blanks(r);
    return r->at == r->end || is_line_end(*r->at) || *r->at == '#';
}

bool obj_read_word(obj_reader *r, const char **word, size_t *length) {
    if (obj_at_line_end(r)) return false;
    *word = r->at;
    while (r->at < r->end && !is_blank(*r->at) && !is_line_end(*r->at) && !at_continuation(r)) ++r->at;
    *length = (size_t)(r->at - *word);
    return true;
}

bool obj_word_is(const char *word, size_t length, const char *text) {
    return strlen(text) == length && memcmp(word, text, length) == 0;
}

qp_status obj_read_number(obj_reader *r, const char *what, double *value) {
    obj_skip_blanks(r);
    const char *after = qp_read_double(r->at, r->end, value);
    if (after != NULL && (after == r->end || is_blank(*after) || is_line_end(*after) || *after == '\\')) {
        r->at = after;
        return QP_OK;
    }
    const char *word;
    size_t length;
    if (!obj_read_word(r, &word, &length)) return obj_fail_at(r, r->line, "%s is missing", what);
    return obj_fail_at(r, r->line, "%s \"%.*s\" is no finite number", what, (int)(length < 40 ? length : 40),
                       word);
}

/* To the start of the next line; a comment ends at its own line whatever its last character. */
static void next_line(obj_reader *r) {
    bool comment = false;
    while (r->at < r->end && !is_line_end(*r->at)) {
        comment = comment || *r->at == '#';
        if (!comment && at_continuation(r)) {
            ++r->at;
            step_line_end(r);
        } else {
            ++r->at;
        }
    }
    if (r->at < r->end) step_line_end(r);
}

/* ---- Vertices and faces ---- */

/* `count` to `most` numbers; the first `keep` go into the list, missing ones as 0. */
static qp_status read_numbers(obj_reader *r, const char *what, int count, int most, int keep,
                              double_list *list) {
    for (int i = 0; i < most || i < keep; ++i) {
        double value = 0;
        if (i < count || (i < most && !obj_at_line_end(r))) {
            qp_status status = obj_read_number(r, what, &value);
            if (status != QP_OK) return status;
        }
        if (i < keep && !(fabs(value) <= QP_COORDINATE_LIMIT)) {
            return obj_fail_at(r, r->line, "%s %g is beyond %g", what, value, QP_COORDINATE_LIMIT);
        }
        if (i < keep) {
            qp_status status = obj_push_double(r, list, value);
            if (status != QP_OK) return status;
        }
    }
    if (!obj_at_line_end(r)) return obj_fail_at(r, r->line, "more numbers than a %s line can have", what);
    return QP_OK;
}

/* One index of a face: from 1, or negative and counted back from the latest element. */
static qp_status read_index(obj_reader *r, const char **at, const char *end, size_t count, const char *what,
                            uint32_t *index) {
    int64_t value;
    const char *after = qp_read_int64(*at, end, &value);
    if (after == NULL) {
        return obj_fail_at(r, r->line, "\"%.*s\" is no %s index", (int)(end - *at < 40 ? end - *at : 40), *at,
                           what);
    }
    *at = after;
    if (value == 0 || value > INT32_MAX || value < -(int64_t)count) {
        return obj_fail_at(r, r->line, "%s index %lld is out of range (%zu so far)", what, (long long)value,
                           count);
    }
    *index = (uint32_t)(value > 0 ? value - 1 : (int64_t)count + value);
    return QP_OK;
}

/* One corner of a face: V, V/T, V//N or V/T/N; empty fields are let pass. */
static qp_status read_corner(obj_reader *r, const char *word, const char *end) {
    uint32_t vertex, texcoord = QP_NONE, normal;
    const char *at = word;
    qp_status status = read_index(r, &at, end, r->positions.count / 3, "vertex", &vertex);
    if (status == QP_OK && at < end && *at == '/') {
        ++at;
        if (at < end && *at != '/') {
            status = read_index(r, &at, end, r->texcoords.count / 2, "texture", &texcoord);
            r->has_texcoords = true;
        }
        if (status == QP_OK && at < end && *at == '/') {
            ++at;
            if (at < end) {
                status = read_index(r, &at, end, r->normals, "normal", &normal);
                if (status == QP_OK && normal + 1 > r->last_normal) {
                    r->last_normal = normal + 1;
                    r->last_normal_line = r->line;
                }
            }
        }
    }
    if (status != QP_OK) return status;
    if (at != end) {
        return obj_fail_at(r, r->line, "\"%.*s\" is no face corner", (int)(end - word < 40 ? end - word : 40),
                           word);
    }
    status = obj_push_u32(r, &r->face_vertices, vertex);
    return status == QP_OK ? obj_push_u32(r, &r->corner_texcoords, texcoord) : status;
}

static qp_status read_face(obj_reader *r) {
    const char *word;
    size_t length, first = r->face_vertices.count;
    uint32_t line = r->line;
    qp_status status = obj_push_u32(r, &r->face_offsets, (uint32_t)first);
    if (status == QP_OK) status = obj_push_u32(r, &r->face_lines, line);
    while (status == QP_OK && obj_read_word(r, &word, &length)) status = read_corner(r, word, word + length);
    if (status == QP_OK && r->face_vertices.count - first < 3) {
        status = obj_fail_at(r, line, "a face with fewer than 3 vertices");
    }
    return status;
}

static qp_status read_keyword(obj_reader *r, const char *word, size_t length) {
    static const char *const skipped[] = {"g",      "o",      "s",          "usemtl",   "mtllib",   "l",
                                          "p",      "mg",     "bevel",      "c_interp", "d_interp", "lod",
                                          "usemap", "maplib", "shadow_obj", "trace_obj"};
    if (length == 1 && word[0] == 'v') return read_numbers(r, "coordinate", 3, 8, 3, &r->positions);
    if (length == 1 && word[0] == 'f') return read_face(r);
    if (length == 1 && word[0] == 't') return obj_read_tag(r);
    if (obj_word_is(word, length, "vt")) return read_numbers(r, "texture coordinate", 1, 3, 2, &r->texcoords);
    if (obj_word_is(word, length, "vn")) {
        ++r->normals; /* only counted: the surface has its own */
        return QP_OK;
    }
    for (size_t i = 0; i < sizeof skipped / sizeof skipped[0]; ++i) {
        if (obj_word_is(word, length, skipped[i])) return QP_OK;
    }
    if (obj_new_name(r, OBJ_KEYWORD, word, length)) {
        obj_warn(r, "unknown keyword %.*s ignored", (int)(length < 40 ? length : 40), word);
    }
    return QP_OK;
}

static qp_status read_lines(obj_reader *r) {
    if (r->end - r->at >= 3 && memcmp(r->at, "\xef\xbb\xbf", 3) == 0) r->at += 3; /* byte order mark */
    while (r->at < r->end) {
        const char *word;
        size_t length;
        if (obj_read_word(r, &word, &length)) {
            qp_status status = read_keyword(r, word, length);
            if (status != QP_OK) return status;
        }
        next_line(r);
    }
    return QP_OK;
}

/* ---- The mesh ---- */

/* Positive indices may point ahead in the file: they are checked when everything is known. */
static qp_status check_indices(obj_reader *r) {
    size_t vertices = r->positions.count / 3, texcoords = r->texcoords.count / 2, faces = r->face_lines.count;
    for (size_t f = 0; f < faces; ++f) {
        size_t end = f + 1 < faces ? r->face_offsets.at[f + 1] : r->face_vertices.count;
        for (size_t c = r->face_offsets.at[f]; c < end; ++c) {
            if (r->face_vertices.at[c] >= vertices) {
                return obj_fail_at(r, r->face_lines.at[f], "vertex index %u is out of range (%zu vertices)",
                                   r->face_vertices.at[c] + 1, vertices);
            }
            if (r->corner_texcoords.at[c] != QP_NONE && r->corner_texcoords.at[c] >= texcoords) {
                return obj_fail_at(r, r->face_lines.at[f], "texture index %u is out of range (%zu)",
                                   r->corner_texcoords.at[c] + 1, texcoords);
            }
        }
    }
    if (r->last_normal > r->normals) {
        return obj_fail_at(r, r->last_normal_line, "normal index %u is out of range (%u)", r->last_normal,
                           r->normals);
    }
    return obj_check_tags(r, (uint32_t)vertices, (uint32_t)faces);
}

/* Hands a list's block over; a list that never grew gives an empty block, so that no array is NULL. */
#define TAKE(destination, list)                                                                              \
    ((destination) = (list).at != NULL ? (list).at : qp_alloc(0, 1, false), (list).at = NULL,                \
     (destination) != NULL)

static qp_status fill_mesh(obj_reader *r, qp_mesh *mesh) {
    mesh->n_vertices = (uint32_t)(r->positions.count / 3);
    mesh->n_faces = (uint32_t)r->face_lines.count;
    mesh->n_corners = (uint32_t)r->face_vertices.count;
    mesh->n_creases = (uint32_t)r->crease_sharpness.count;
    mesh->n_corner_tags = (uint32_t)r->corner_vertices.count;
    mesh->n_hole_tags = (uint32_t)r->hole_faces.count;
    mesh->boundary = (qp_boundary)r->boundary;
    mesh->crease_method = (qp_crease_method)r->crease_method;
    mesh->triangle_rule = (qp_triangle_rule)r->triangle_rule;
    mesh->fvar_boundary = r->fvar_boundary;
    qp_status status = obj_push_u32(r, &r->face_offsets, mesh->n_corners);
    if (status != QP_OK) return status;
    bool good = TAKE(mesh->positions, r->positions);
    good = TAKE(mesh->face_offsets, r->face_offsets) && good;
    good = TAKE(mesh->face_vertices, r->face_vertices) && good;
    good = TAKE(mesh->face_lines, r->face_lines) && good;
    good = TAKE(mesh->crease_vertices, r->crease_vertices) && good;
    good = TAKE(mesh->crease_sharpness, r->crease_sharpness) && good;
    good = TAKE(mesh->corner_tag_vertices, r->corner_vertices) && good;
    good = TAKE(mesh->corner_tag_sharpness, r->corner_sharpness) && good;
    good = TAKE(mesh->hole_tag_faces, r->hole_faces) && good;
    if (r->has_texcoords) {
        mesh->n_texcoords = (uint32_t)(r->texcoords.count / 2);
        good = TAKE(mesh->texcoords, r->texcoords) && good;
        good = TAKE(mesh->corner_texcoords, r->corner_texcoords) && good;
    }
    return good ? QP_OK : qp_fail_memory(r->err, 1, r->name);
}

static void free_reader(obj_reader *r) {
    free(r->positions.at);
    free(r->texcoords.at);
    free(r->face_offsets.at);
    free(r->face_lines.at);
    free(r->face_vertices.at);
    free(r->corner_texcoords.at);
    free(r->crease_vertices.at);
    free(r->crease_lines.at);
    free(r->crease_sharpness.at);
    free(r->corner_vertices.at);
    free(r->corner_lines.at);
    free(r->corner_sharpness.at);
    free(r->hole_faces.at);
    free(r->hole_lines.at);
    free(r->ints.at);
    free(r->floats.at);
    free(r);
}

qp_status qp_mesh_parse_obj(const char *name, const char *text, size_t length, const qp_mesh_options *options,
                            qp_mesh **result, qp_error *err) {
    *result = NULL;
    obj_reader *r = qp_alloc(1, sizeof *r, true);
    qp_mesh *mesh = qp_alloc(1, sizeof *mesh, true);
    if (r == NULL || mesh == NULL) {
        free(r);
        free(mesh);
        return qp_fail_memory(err, sizeof *r, name);
    }
    r->name = name;
    r->at = text;
    r->end = text + length;
    r->line = 1;
    r->err = err;
    r->boundary = QP_BOUNDARY_EDGE_ONLY;
    r->fvar_boundary = 5;
    qp_status status = read_lines(r);
    if (status == QP_OK) status = check_indices(r);
    if (status == QP_OK) status = fill_mesh(r, mesh);
    if (status == QP_OK) status = qp_mesh_analyse(mesh, name, options, err);
    if (status == QP_OK && options != NULL && options->warn != NULL) {
        for (unsigned i = 0; i < r->warning_count; ++i) options->warn(options->warn_context, r->warnings[i]);
    }
    free_reader(r);
    if (status != QP_OK) {
        qp_mesh_free(mesh);
        return status;
    }
    *result = mesh;
    return QP_OK;
}

/* The whole of an open file, which may be a pipe. */
static qp_status read_all(FILE *file, const char *path, char **text, size_t *length, qp_error *err) {
    size_t capacity = 0;
    void *block = NULL;
    *length = 0;
    for (;;) {
        if (!qp_grow(&block, &capacity, *length < ((size_t)1 << 16) ? (size_t)1 << 16 : 2 * *length, 1)) {
            free(block);
            return qp_fail_memory(err, 2 * *length, path);
        }
        size_t got = fread((char *)block + *length, 1, capacity - *length, file);
        *length += got;
        if (*length < capacity) break;
    }
    *text = block;
    return ferror(file) ? qp_fail(err, QP_BAD_INPUT, "%.300s: cannot be read: %s", path, strerror(errno))
                        : QP_OK;
}

qp_status qp_mesh_read_obj(const char *path, const qp_mesh_options *options, qp_mesh **mesh, qp_error *err) {
    *mesh = NULL;
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return qp_fail(err, QP_BAD_INPUT, "%.300s: cannot be opened: %s", path, strerror(errno));
    char *text = NULL;
    size_t length = 0;
    qp_status status = read_all(file, path, &text, &length, err);
    fclose(file);
    if (status == QP_OK) status = qp_mesh_parse_obj(path, text, length, options, mesh, err);
    free(text);
    return status;
}
