#include "gl/platform.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <string.h>

/* Entry points, loaded at run time. */
static struct {
    PFNEGLGETPROCADDRESSPROC find;
    PFNEGLGETPLATFORMDISPLAYPROC get_platform_display;
    PFNEGLINITIALIZEPROC initialize;
    PFNEGLBINDAPIPROC bind_api;
    PFNEGLCREATECONTEXTPROC create_context;
    PFNEGLMAKECURRENTPROC make_current;
    PFNEGLDESTROYCONTEXTPROC destroy_context;
    PFNEGLTERMINATEPROC terminate;
} egl;

/* As in platform_osmesa.c: dlsym's result, bit for bit. */
static bool load(void *library, const char *name, void *function) {
    void *symbol = dlsym(library, name);
    memcpy(function, &symbol, sizeof symbol);
    return symbol != NULL;
}

static qp_gl_function find(const char *name) {
    return (qp_gl_function)egl.find(name);
}

static void close_egl(qp_gl_platform *platform) {
    egl.make_current(platform->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    egl.destroy_context(platform->display, platform->context);
    /* The display stays, for the next context: terminating it would unload the driver, which leaks. */
}

static bool load_all(void *library) {
    return load(library, "eglGetProcAddress", &egl.find) &&
           load(library, "eglGetPlatformDisplay", &egl.get_platform_display) &&
           load(library, "eglInitialize", &egl.initialize) && load(library, "eglBindAPI", &egl.bind_api) &&
           load(library, "eglCreateContext", &egl.create_context) &&
           load(library, "eglMakeCurrent", &egl.make_current) &&
           load(library, "eglDestroyContext", &egl.destroy_context) &&
           load(library, "eglTerminate", &egl.terminate);
}

qp_status qp_gl_open_egl(qp_gl_platform *platform, qp_error *err) {
    void *library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) library = dlopen("libEGL.so", RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) return qp_fail(err, QP_SYSTEM, "EGL: libEGL.so.1 cannot be loaded");
    if (!load_all(library)) return qp_fail(err, QP_SYSTEM, "EGL: older than version 1.5");
    EGLDisplay display =
        egl.get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, (void *)EGL_DEFAULT_DISPLAY, NULL);
    if (display == EGL_NO_DISPLAY || !egl.initialize(display, NULL, NULL))
        return qp_fail(err, QP_SYSTEM, "EGL: no surfaceless display");
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 4,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 0,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_NONE};
    EGLContext context = EGL_NO_CONTEXT;
    if (egl.bind_api(EGL_OPENGL_API))
        context = egl.create_context(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (context == EGL_NO_CONTEXT) {
        egl.terminate(display);
        return qp_fail(err, QP_SYSTEM, "EGL: no OpenGL 4.0 core context");
    }
    *platform = (qp_gl_platform){"EGL surfaceless", context, display, NULL, find, close_egl};
    if (!egl.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        close_egl(platform);
        return qp_fail(err, QP_SYSTEM, "EGL: the context cannot be made current");
    }
    return QP_OK;
}
