/* What the parts of the OBJ reader share: obj.c (lines, vertices, faces) and obj_tags.c (tag lines). */
#ifndef QP_MESH_OBJ_READER_H
#define QP_MESH_OBJ_READER_H

#include "host/mesh/mesh.h"

/* Growing arrays: count in use, capacity allocated. */
typedef struct u32_list {
    uint32_t *at;
    size_t count, capacity;
} u32_list;
typedef struct float_list {
    float *at;
    size_t count, capacity;
} float_list;
typedef struct double_list {
    double *at;
    size_t count, capacity;
} double_list;

enum { OBJ_NAMES = 16, OBJ_NAME_CHARS = 40, OBJ_WARNINGS = 2 * OBJ_NAMES + 1 };

typedef struct obj_reader {
    const char *name; /* of the file, for messages */
    const char *at, *end;
    uint32_t line;
    qp_error *err;

    double_list positions, texcoords;
    u32_list face_offsets; /* first corner of each face; the last entry is missing while reading */
    u32_list face_lines, face_vertices, corner_texcoords;
    uint32_t normals;     /* vn lines so far */
    uint32_t last_normal; /* the largest vn index used, from 1, and where */
    uint32_t last_normal_line;
    bool has_texcoords;

    u32_list crease_vertices, crease_lines;
    float_list crease_sharpness;
    u32_list corner_vertices, corner_lines;
    float_list corner_sharpness;
    u32_list hole_faces, hole_lines;
    int boundary, fvar_boundary, crease_method, triangle_rule;

    u32_list ints; /* arguments of the tag being read */
    float_list floats;

    /* Unknown keywords and tags seen, each warned of once; kept until the mesh is known to be good, so that a
     * refused file gives one line only. */
    char names[2][OBJ_NAMES][OBJ_NAME_CHARS];
    unsigned name_count[2];
    char warnings[OBJ_WARNINGS][480];
    unsigned warning_count;
} obj_reader;

enum { OBJ_KEYWORD = 0, OBJ_TAG = 1 }; /* first index of names */

/* Appends; QP_SYSTEM when memory is out, QP_BAD_INPUT beyond 2^31 - 1 elements. */
qp_status obj_push_u32(obj_reader *r, u32_list *list, uint32_t value);
qp_status obj_push_float(obj_reader *r, float_list *list, float value);
qp_status obj_push_double(obj_reader *r, double_list *list, double value);

/* QP_BAD_INPUT with "NAME:LINE: reason". */
qp_status obj_fail_at(obj_reader *r, uint32_t line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Skips blanks and continued line ends (a backslash before the end of a line). */
void obj_skip_blanks(obj_reader *r);
/* Blanks skipped, is this the end of the line or the start of a comment? */
bool obj_at_line_end(obj_reader *r);
/* The next word; false at the end of the line. */
bool obj_read_word(obj_reader *r, const char **word, size_t *length);
/* Whether a word is this text. */
bool obj_word_is(const char *word, size_t length, const char *text);
/* A number and nothing glued to it. */
qp_status obj_read_number(obj_reader *r, const char *what, double *value);

/* Remembers a name of a kind; true the first time it is seen, false also when the table is full. */
bool obj_new_name(obj_reader *r, int kind, const char *word, size_t length);
/* Queues one line of warning, "NAME:LINE: text". */
void obj_warn(obj_reader *r, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Reads the rest of a tag line, after its "t". */
qp_status obj_read_tag(obj_reader *r);
/* Checks tag indices once all vertices and faces are known. */
qp_status obj_check_tags(obj_reader *r, uint32_t n_vertices, uint32_t n_faces);

#endif
