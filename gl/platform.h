/* How a context comes about; apart from context.h because the headers of OSMesa and EGL bring their own,
 * older gl.h. */
#ifndef QP_GL_PLATFORM_H
#define QP_GL_PLATFORM_H

#include "host/base/status.h"

typedef void (*qp_gl_function)(void);
typedef struct qp_gl_platform {
    const char *name;
    void *context, *display;
    unsigned char *pixels; /* OSMesa draws into memory, though we never look at it */
    qp_gl_function (*find)(const char *name);
    void (*close)(struct qp_gl_platform *platform);
} qp_gl_platform;

/* Each loads its library, makes an OpenGL 4.0 core context current and fills *platform, or says why not. */
qp_status qp_gl_open_osmesa(qp_gl_platform *platform, qp_error *err);
qp_status qp_gl_open_egl(qp_gl_platform *platform, qp_error *err);

#endif
