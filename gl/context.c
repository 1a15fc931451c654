#include "gl/context.h"
#include "gl/platform.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static qp_status open_platform(qp_gl_platform *platform, qp_error *err) {
    const char *wish = getenv("QUADPLAN_GL");
    if (wish != NULL && strcmp(wish, "osmesa") == 0) return qp_gl_open_osmesa(platform, err);
    if (wish != NULL && strcmp(wish, "egl") == 0) return qp_gl_open_egl(platform, err);
    if (wish != NULL && wish[0] != '\0')
        return qp_fail(err, QP_BAD_INPUT, "QUADPLAN_GL is '%s', not osmesa or egl", wish);
    qp_error first, second;
    if (qp_gl_open_osmesa(platform, &first) == QP_OK) return QP_OK;
    if (qp_gl_open_egl(platform, &second) == QP_OK) return QP_OK;
    return qp_fail(err, QP_SYSTEM, "no GL to draw with: %.200s; %.200s", first.message, second.message);
}

static const char *load_functions(qp_gl *gl, const qp_gl_platform *platform) {
#define QP_GL_LOAD(name, TYPE)                                                                               \
    gl->name = (PFNGL##TYPE##PROC)platform->find("gl" #name);                                                \
    if (gl->name == NULL) return "gl" #name;
    QP_GL_FUNCTIONS(QP_GL_LOAD)
#undef QP_GL_LOAD
    return NULL;
}

qp_status qp_gl_open(qp_gl **out, qp_error *err) {
    *out = NULL;
    qp_gl *gl = qp_alloc(1, sizeof *gl, true);
    qp_gl_platform *platform = qp_alloc(1, sizeof *platform, true);
    qp_status status = gl && platform ? open_platform(platform, err)
                                      : qp_fail_memory(err, sizeof *gl + sizeof *platform, "a GL context");
    if (status != QP_OK) {
        free(gl);
        free(platform);
        return status;
    }
    gl->platform = platform;
    const char *missing = load_functions(gl, platform);
    GLint major = 0, minor = 0;
    if (missing == NULL) {
        gl->GetIntegerv(GL_MAJOR_VERSION, &major);
        gl->GetIntegerv(GL_MINOR_VERSION, &minor);
    }
    if (missing != NULL || major < 4) {
        status = qp_fail(err, QP_SYSTEM, "%s: %s%s, OpenGL 4.0 is needed", platform->name,
                         missing ? "there is no " : "an older OpenGL", missing ? missing : "");
        qp_gl_close(gl);
        return status;
    }
    const char *version = (const char *)gl->GetString(GL_VERSION);
    const char *renderer = (const char *)gl->GetString(GL_RENDERER);
    snprintf(gl->backend, sizeof gl->backend, "%s, OpenGL %s, %s", platform->name, version ? version : "?",
             renderer ? renderer : "?");
    qp_gl_note(gl, "glGetString");
    *out = gl;
    return QP_OK;
}

void qp_gl_close(qp_gl *gl) {
    if (gl == NULL) return;
    gl->platform->close(gl->platform);
    free(gl->platform);
    free(gl);
}

void qp_gl_note(qp_gl *gl, const char *call) {
    GLenum code = gl->GetError();
    if (code == GL_NO_ERROR || gl->failed_call != NULL) return;
    gl->failed_call = call;
    gl->failed_code = code;
}

qp_status qp_gl_status(const qp_gl *gl, qp_error *err) {
    if (gl->failed_call == NULL) return QP_OK;
    const char *name = gl->failed_code == GL_INVALID_ENUM                    ? "GL_INVALID_ENUM"
                       : gl->failed_code == GL_INVALID_VALUE                 ? "GL_INVALID_VALUE"
                       : gl->failed_code == GL_INVALID_OPERATION             ? "GL_INVALID_OPERATION"
                       : gl->failed_code == GL_INVALID_FRAMEBUFFER_OPERATION ? "an incomplete framebuffer"
                       : gl->failed_code == GL_OUT_OF_MEMORY                 ? "GL_OUT_OF_MEMORY"
                                                                             : "an unknown error";
    return qp_fail(err, QP_SYSTEM, "%s failed with %s (%s)", gl->failed_call, name, gl->backend);
}
