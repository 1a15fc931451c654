#define _POSIX_C_SOURCE 200809L
#include "host/scene/fields.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct reader {
    const char *name;
    char *base;
    bool *given;
    qp_error *err;
} reader;

/* "NAME: section.key: must be WHAT" */
static qp_status refuse(const reader *r, const char *place, const char *what) {
    return qp_fail(r->err, QP_BAD_INPUT, "%.200s: %.100s must be %s", r->name, place, what);
}

static qp_status read_number(const reader *r, const json_t *value, const qp_field *f, const char *place,
                             double *out) {
    char what[100];
    double x = json_number_value(value);
    if (json_is_number(value) && isfinite(x) && x >= f->low && x <= f->high) {
        *out = x;
        return QP_OK;
    }
    snprintf(what, sizeof what, "a number from %g to %g", f->low, f->high);
    return refuse(r, place, what);
}

static qp_status read_count(const reader *r, const json_t *value, const qp_field *f, const char *place,
                            uint32_t *out) {
    char what[100];
    json_int_t x = json_integer_value(value);
    if (json_is_integer(value) && (double)x >= f->low && (double)x <= f->high) {
        *out = (uint32_t)x;
        return QP_OK;
    }
    snprintf(what, sizeof what, "an integer from %.0f to %.0f", f->low, f->high);
    return refuse(r, place, what);
}

static qp_status read_counts(const reader *r, const json_t *value, const qp_field *f, const char *place,
                             uint32_t out[3]) {
    if (!json_is_array(value)) return read_count(r, value, f, place, out);
    size_t n = json_array_size(value);
    if (n < 1 || n > 3) return refuse(r, place, "an integer or an array of one to three");
    for (size_t k = 0; k < n; k++) {
        qp_status status = read_count(r, json_array_get(value, k), f, place, out + k);
        if (status != QP_OK) return status;
    }
    return QP_OK;
}

static qp_status read_vector(const reader *r, const json_t *value, const qp_field *f, const char *place,
                             double out[3]) {
    if (json_array_size(value) != 3) return refuse(r, place, "an array of three numbers");
    for (size_t k = 0; k < 3; k++) {
        qp_status status = read_number(r, json_array_get(value, k), f, place, out + k);
        if (status != QP_OK) return status;
    }
    return QP_OK;
}

static double linear_of_srgb(unsigned byte) {
    double x = byte / 255.0;
    return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
}

static qp_status read_colour(const reader *r, const json_t *value, const char *place, double out[3]) {
    const char *text = json_string_value(value);
    if (text == NULL) {
        static const qp_field range = {.low = 0, .high = 100};
        if (!json_is_array(value)) return refuse(r, place, "\"#rrggbb\" or an array of three numbers");
        return read_vector(r, value, &range, place, out);
    }
    if (strlen(text) != 7 || text[0] != '#' || strspn(text + 1, "0123456789abcdefABCDEF") != 6)
        return refuse(r, place, "\"#rrggbb\" or an array of three numbers");
    unsigned long bits = strtoul(text + 1, NULL, 16);
    for (int k = 0; k < 3; k++) out[k] = linear_of_srgb((unsigned)(bits >> (16 - 8 * k)) & 255u);
    return QP_OK;
}

static qp_status read_palette(const reader *r, const json_t *value, const qp_field *f, const char *place,
                              double (*out)[3]) {
    char what[100];
    size_t n = json_array_size(value);
    snprintf(what, sizeof what, "an array of one to %.0f colours", f->high);
    if (n < 1 || (double)n > f->high) return refuse(r, place, what);
    for (size_t k = 0; k < n; k++) {
        qp_status status = read_colour(r, json_array_get(value, k), place, out[k]);
        if (status != QP_OK) return status;
    }
    *(uint32_t *)(void *)(r->base + f->count_offset) = (uint32_t)n;
    return QP_OK;
}

static qp_status read_choice(const reader *r, const json_t *value, const qp_field *f, const char *place,
                             char *out) {
    char what[160] = "one of";
    const char *text = json_string_value(value);
    for (int k = 0; f->names[k] != NULL; k++) {
        if (text != NULL && strcmp(text, f->names[k]) == 0) {
            memcpy(out, &k, sizeof k); /* an enum of small values has an int's size and bits here */
            return QP_OK;
        }
        size_t used = strlen(what);
        snprintf(what + used, sizeof what - used, "%s %s", k ? "," : "", f->names[k]);
    }
    return refuse(r, place, what);
}

static qp_status read_text(const reader *r, const json_t *value, const char *place, char *out) {
    const char *text = json_string_value(value);
    if (text == NULL || text[0] == '\0') return refuse(r, place, "a text");
    char *copy = strdup(text);
    if (copy == NULL) return qp_fail_memory(r->err, strlen(text), "a text");
    memcpy(out, &copy, sizeof copy);
    return QP_OK;
}

static qp_status read_list(const reader *r, const json_t *value, const qp_field *f, const char *place,
                           uint32_t *out) {
    char what[100];
    snprintf(what, sizeof what, "an array of up to %.0f objects", f->high);
    if (!json_is_array(value) || (double)json_array_size(value) > f->high) return refuse(r, place, what);
    *out = (uint32_t)json_array_size(value);
    return QP_OK;
}

static qp_status read_object(const reader *r, json_t *object, const qp_field *fields, const char *place);

static qp_status read_value(const reader *r, json_t *value, const qp_field *f, const char *place) {
    void *out = r->base + f->offset;
    if (f->given) r->given[f->given] = true;
    switch (f->kind) {
    case QP_FIELD_NUMBER:
        return read_number(r, value, f, place, out);
    case QP_FIELD_COUNT:
        return read_count(r, value, f, place, out);
    case QP_FIELD_COUNTS:
        return read_counts(r, value, f, place, out);
    case QP_FIELD_SEED:
        if (!json_is_integer(value) || json_integer_value(value) < 0)
            return refuse(r, place, "an integer, 0 or more");
        *(uint64_t *)out = (uint64_t)json_integer_value(value);
        return QP_OK;
    case QP_FIELD_FLAG:
        if (!json_is_boolean(value)) return refuse(r, place, "true or false");
        *(bool *)out = json_is_true(value);
        return QP_OK;
    case QP_FIELD_VECTOR:
        return read_vector(r, value, f, place, out);
    case QP_FIELD_COLOUR:
        return read_colour(r, value, place, out);
    case QP_FIELD_PALETTE:
        return read_palette(r, value, f, place, out);
    case QP_FIELD_TEXT:
        return read_text(r, value, place, out);
    case QP_FIELD_CHOICE:
        return read_choice(r, value, f, place, out);
    case QP_FIELD_LIST:
        return read_list(r, value, f, place, out);
    default:
        return read_object(r, value, f->section, place);
    }
}

static qp_status read_object(const reader *r, json_t *object, const qp_field *fields, const char *place) {
    if (!json_is_object(object)) return refuse(r, place, "an object { ... }");
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value) {
        const qp_field *f = fields;
        while (f->key != NULL && strcmp(f->key, key) != 0) f++;
        char inner[120];
        snprintf(inner, sizeof inner, "%.50s%s%.50s", place, place[0] ? "." : "", key);
        if (f->key == NULL) return qp_fail(r->err, QP_BAD_INPUT, "%.200s: unknown key %s", r->name, inner);
        qp_status status = read_value(r, value, f, inner);
        if (status != QP_OK) return status;
    }
    return QP_OK;
}

qp_status qp_fields_parse(const char *name, const char *text, size_t length, const qp_field *fields,
                          void *target, bool *given, qp_error *err) {
    json_error_t trouble;
    json_t *root = json_loadb(text, length, JSON_REJECT_DUPLICATES, &trouble);
    if (root == NULL) return qp_fail(err, QP_BAD_INPUT, "%.200s:%d: %s", name, trouble.line, trouble.text);
    reader r = {name, target, given, err};
    qp_status status;
    if (json_is_object(root))
        status = read_object(&r, root, fields, "");
    else
        status = qp_fail(err, QP_BAD_INPUT, "%.200s: a scene is an object { ... }", name);
    json_decref(root);
    return status;
}

qp_status qp_fields_parse_item(const char *name, const char *text, size_t length, const char *key,
                               uint32_t index, const qp_field *fields, void *target, bool *given,
                               qp_error *err) {
    json_error_t trouble;
    json_t *root = json_loadb(text, length, JSON_REJECT_DUPLICATES, &trouble);
    if (root == NULL) return qp_fail(err, QP_BAD_INPUT, "%.200s:%d: %s", name, trouble.line, trouble.text);
    reader r = {name, target, given, err};
    char place[60];
    snprintf(place, sizeof place, "%.40s[%u]", key, (unsigned)index);
    qp_status status = read_object(&r, json_array_get(json_object_get(root, key), index), fields, place);
    json_decref(root);
    return status;
}
