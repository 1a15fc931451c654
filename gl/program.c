#include "gl/program.h"
#include "host/base/embedded.h"

#include <stdio.h>
#include <string.h>

static const char *find_source(const char *file) {
    for (const qp_embedded *e = qp_embedded_shaders; e->name != NULL; e++)
        if (strcmp(e->name, file) == 0) return (const char *)e->bytes;
    return NULL;
}

enum { MOST_FILES = 4 };

/* first: as in qp_gl_program_desc. */
static qp_status attach(qp_gl *gl, GLuint program, GLenum stage, const char *const *first, const char *file,
                        const qp_gl_program_desc *desc, qp_error *err) {
    char version[32];
    snprintf(version, sizeof version, "#version %d core\n", desc->version == 0 ? 400 : desc->version);
    /* #line: messages count lines as the file does. */
    const char *parts[2 + 2 * MOST_FILES] = {version, desc->defines != NULL ? desc->defines : ""};
    GLsizei n = 2;
    for (size_t k = 0; n < 2 + 2 * MOST_FILES; ++k) {
        const bool last = first == NULL || first[k] == NULL;
        const char *name = last ? file : first[k], *source = find_source(name);
        if (source == NULL) return qp_fail(err, QP_SYSTEM, "there is no shader %s in this program", name);
        parts[n++] = "#line 1\n";
        parts[n++] = source;
        if (last) break;
    }
    GLuint shader = gl->CreateShader(stage);
    qp_gl_note(gl, "glCreateShader");
    QP_GL(gl, ShaderSource(shader, n, parts, NULL));
    QP_GL(gl, CompileShader(shader));
    GLint good = 0;
    QP_GL(gl, GetShaderiv(shader, GL_COMPILE_STATUS, &good));
    qp_status status = QP_OK;
    if (!good) {
        char log[300] = "";
        QP_GL(gl, GetShaderInfoLog(shader, sizeof log, NULL, log));
        status = qp_fail(err, QP_SYSTEM, "shader %s: %.*s", file, (int)strcspn(log, "\n"), log);
    } else {
        QP_GL(gl, AttachShader(program, shader));
    }
    QP_GL(gl, DeleteShader(shader)); /* lives on while attached */
    return status;
}

qp_status qp_gl_make_program(qp_gl *gl, const qp_gl_program_desc *desc, GLuint *out, qp_error *err) {
    const struct {
        GLenum stage;
        const char *file;
        const char *const *first;
    } stages[] = {{GL_VERTEX_SHADER, desc->vertex, NULL},
                  {GL_TESS_CONTROL_SHADER, desc->tess_control, desc->tess_control_first},
                  {GL_TESS_EVALUATION_SHADER, desc->tess_evaluation, desc->tess_evaluation_first},
                  {GL_GEOMETRY_SHADER, desc->geometry, NULL},
                  {GL_FRAGMENT_SHADER, desc->fragment, NULL},
                  {GL_COMPUTE_SHADER, desc->compute, desc->compute_first}};
    GLuint program = gl->CreateProgram();
    qp_gl_note(gl, "glCreateProgram");
    qp_status status = QP_OK;
    for (size_t k = 0; k < sizeof stages / sizeof stages[0] && status == QP_OK; k++)
        if (stages[k].file != NULL)
            status = attach(gl, program, stages[k].stage, stages[k].first, stages[k].file, desc, err);
    if (status == QP_OK) {
        if (desc->capture_count > 0)
            QP_GL(gl, TransformFeedbackVaryings(program, desc->capture_count, desc->capture,
                                                GL_INTERLEAVED_ATTRIBS));
        QP_GL(gl, LinkProgram(program));
        GLint good = 0;
        QP_GL(gl, GetProgramiv(program, GL_LINK_STATUS, &good));
        if (!good) {
            char log[300] = "";
            QP_GL(gl, GetProgramInfoLog(program, sizeof log, NULL, log));
            status =
                qp_fail(err, QP_SYSTEM, "shader %s does not link: %.*s",
                        desc->compute != NULL ? desc->compute : desc->vertex, (int)strcspn(log, "\n"), log);
        }
    }
    if (status == QP_OK) status = qp_gl_status(gl, err);
    if (status != QP_OK)
        QP_GL(gl, DeleteProgram(program));
    else
        *out = program;
    return status;
}
