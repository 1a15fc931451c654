/* JSON objects into structs, by tables: every key is known, every number finite and in range. */
#ifndef QP_SCENE_FIELDS_H
#define QP_SCENE_FIELDS_H

#include "host/base/status.h"

typedef enum qp_field_kind {
    QP_FIELD_NUMBER,  /* double in [low, high] */
    QP_FIELD_COUNT,   /* uint32_t in [low, high] */
    QP_FIELD_COUNTS,  /* uint32_t[3]: an integer or an array of one to three, in [low, high] */
    QP_FIELD_SEED,    /* uint64_t, 0 or more */
    QP_FIELD_FLAG,    /* bool */
    QP_FIELD_VECTOR,  /* double[3] in [low, high] */
    QP_FIELD_COLOUR,  /* double[3], linear light: "#rrggbb" (sRGB), or three numbers 0 to 100 */
    QP_FIELD_PALETTE, /* double[high][3] and, at count_offset, a uint32_t: one to `high` colours */
    QP_FIELD_TEXT,    /* char *, not empty; the struct owns it and starts with NULL */
    QP_FIELD_CHOICE,  /* an enum: index in names */
    QP_FIELD_SECTION, /* an object of its own table */
    QP_FIELD_LIST, /* uint32_t: how many objects an array holds, up to `high`; qp_fields_parse_item reads them */
} qp_field_kind;

/* One key; a table ends with a key of NULL. */
typedef struct qp_field {
    const char *key;
    qp_field_kind kind;
    size_t offset; /* in the struct */
    double low, high;
    const char *const *names;       /* ends with NULL */
    const struct qp_field *section; /* offsets are of the same struct */
    size_t count_offset;
    int given; /* index in the given array that becomes true; 0: none */
} qp_field;

/* Reads JSON text into *target. QP_BAD_INPUT: "NAME:LINE: ..." for what is not JSON, "NAME: section.key: ..."
 * otherwise. Texts already stored stay in *target on failure. */
qp_status qp_fields_parse(const char *name, const char *text, size_t length, const qp_field *fields,
                          void *target, bool *given, qp_error *err);

/* Reads object `index` of the list `key` of the same text, which qp_fields_parse has taken. */
qp_status qp_fields_parse_item(const char *name, const char *text, size_t length, const char *key,
                               uint32_t index, const qp_field *fields, void *target, bool *given,
                               qp_error *err);

#endif
