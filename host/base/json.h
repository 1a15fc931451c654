/* JSON out: one value after another to a file, commas and nesting kept here. */
#ifndef QP_BASE_JSON_H
#define QP_BASE_JSON_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct qp_json {
    FILE *file;
    char closers[16]; /* the bracket that ends each open object or array */
    int depth;        /* at most 16 */
    bool comma;       /* the next value follows another one */
} qp_json;

/* Starts the outermost object. */
void qp_json_begin(qp_json *json, FILE *file);
/* Ends whatever is open and the line. */
void qp_json_finish(qp_json *json);

/* key: NULL inside an array. */
void qp_json_open_object(qp_json *json, const char *key);
void qp_json_open_array(qp_json *json, const char *key);
void qp_json_close(qp_json *json);

/* Bytes that are not UTF-8 become U+FFFD. NULL is written as null. */
void qp_json_text(qp_json *json, const char *key, const char *value);
void qp_json_integer(qp_json *json, const char *key, uint64_t value);
/* The digits that read back to the same double; null where it is not finite, as JSON has no such numbers. */
void qp_json_real(qp_json *json, const char *key, double value);
void qp_json_bool(qp_json *json, const char *key, bool value);

#endif
