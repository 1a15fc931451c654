/* Shader programs from the embedded GLSL files. */
#ifndef QP_GL_PROGRAM_H
#define QP_GL_PROGRAM_H

#include "gl/context.h"

/* Sources of a program: names of files in gl/shaders/, NULL for a stage that is not used. */
typedef struct qp_gl_program_desc {
    const char *vertex, *tess_control, *tess_evaluation, *geometry, *fragment, *compute;
    /* Files put before a stage's own: NULL, or a list that ends in NULL. */
    const char *const *tess_control_first, *const *tess_evaluation_first, *const *compute_first;
    int version;                /* of GLSL; 0: 400 */
    const char *defines;        /* lines put after #version in every stage, or NULL */
    const char *const *capture; /* transform feedback varyings, interleaved */
    int capture_count;
} qp_gl_program_desc;

/* Compiles and links. QP_SYSTEM with the first line of the compiler's log. */
qp_status qp_gl_make_program(qp_gl *gl, const qp_gl_program_desc *desc, GLuint *program, qp_error *err);

#endif
