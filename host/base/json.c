#include "host/base/json.h"
#include "host/base/number.h"

#include <inttypes.h>
#include <math.h>

/* Length of the UTF-8 sequence at s, or 0 if it is not one (overlong forms and surrogates included). */
static int utf8_length(const unsigned char *s) {
    if (s[0] < 0x80) return 1;
    int length = s[0] >= 0xc2 && s[0] < 0xe0   ? 2
                 : s[0] >= 0xe0 && s[0] < 0xf0 ? 3
                 : s[0] >= 0xf0 && s[0] < 0xf5 ? 4
                                               : 0;
    for (int i = 1; i < length; ++i) {
        if ((s[i] & 0xc0) != 0x80) return 0;
    }
    if (s[0] == 0xe0 && s[1] < 0xa0) return 0;
    if (s[0] == 0xed && s[1] >= 0xa0) return 0;
    if (s[0] == 0xf0 && s[1] < 0x90) return 0;
    if (s[0] == 0xf4 && s[1] >= 0x90) return 0;
    return length;
}

static void put_string(FILE *file, const char *text) {
    fputc('"', file);
    for (const unsigned char *s = (const unsigned char *)text; *s != '\0';) {
        int length = utf8_length(s);
        if (length == 0) {
            fputs("\\ufffd", file);
            length = 1;
        } else if (*s == '"' || *s == '\\') {
            fprintf(file, "\\%c", *s);
        } else if (*s < 0x20) {
            fprintf(file, "\\u%04x", *s);
        } else {
            fwrite(s, 1, (size_t)length, file);
        }
        s += length;
    }
    fputc('"', file);
}

static void put_key(qp_json *json, const char *key) {
    if (json->comma) fputs(", ", json->file);
    json->comma = true;
    if (key != NULL) {
        put_string(json->file, key);
        fputs(": ", json->file);
    }
}

static void open_bracket(qp_json *json, char opener, char closer) {
    fputc(opener, json->file);
    json->closers[json->depth++] = closer;
    json->comma = false;
}

void qp_json_begin(qp_json *json, FILE *file) {
    *json = (qp_json){.file = file};
    open_bracket(json, '{', '}');
}

void qp_json_finish(qp_json *json) {
    while (json->depth > 0) qp_json_close(json);
    fputc('\n', json->file);
}

void qp_json_open_object(qp_json *json, const char *key) {
    put_key(json, key);
    open_bracket(json, '{', '}');
}

void qp_json_open_array(qp_json *json, const char *key) {
    put_key(json, key);
    open_bracket(json, '[', ']');
}

void qp_json_close(qp_json *json) {
    fputc(json->closers[--json->depth], json->file);
    json->comma = true;
}

void qp_json_text(qp_json *json, const char *key, const char *value) {
    put_key(json, key);
    if (value == NULL) {
        fputs("null", json->file);
    } else {
        put_string(json->file, value);
    }
}

void qp_json_integer(qp_json *json, const char *key, uint64_t value) {
    put_key(json, key);
    fprintf(json->file, "%" PRIu64, value);
}

void qp_json_real(qp_json *json, const char *key, double value) {
    put_key(json, key);
    if (!isfinite(value)) {
        fputs("null", json->file);
        return;
    }
    char text[QP_NUMBER_CHARS];
    qp_write_double(text, value);
    fputs(text, json->file);
}

void qp_json_bool(qp_json *json, const char *key, bool value) {
    put_key(json, key);
    fputs(value ? "true" : "false", json->file);
}
