#include "gl/platform.h"

#include <GL/osmesa.h>
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 16 };

typedef OSMesaContext (*create_function)(const int *, OSMesaContext);
typedef GLboolean (*make_current_function)(OSMesaContext, void *, GLenum, GLsizei, GLsizei);
typedef void (*destroy_function)(OSMesaContext);
typedef OSMESAproc (*find_function)(const char *);

static find_function osmesa_find;
static destroy_function osmesa_destroy;

/* ISO C has no cast from an object pointer to a function pointer; POSIX promises that the bits are the same.
 */
static bool load(void *library, const char *name, void *function) {
    void *symbol = dlsym(library, name);
    memcpy(function, &symbol, sizeof symbol);
    return symbol != NULL;
}

static qp_gl_function find(const char *name) {
    return (qp_gl_function)osmesa_find(name);
}

static void close_osmesa(qp_gl_platform *platform) {
    osmesa_destroy(platform->context);
    free(platform->pixels);
}

qp_status qp_gl_open_osmesa(qp_gl_platform *platform, qp_error *err) {
    /* Never closed again: the LLVM in it does not survive being unloaded. */
    void *library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) library = dlopen("libOSMesa.so", RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) return qp_fail(err, QP_SYSTEM, "OSMesa: libOSMesa.so.8 cannot be loaded");
    create_function create;
    make_current_function make_current;
    if (!load(library, "OSMesaCreateContextAttribs", &create) ||
        !load(library, "OSMesaMakeCurrent", &make_current) ||
        !load(library, "OSMesaDestroyContext", &osmesa_destroy) ||
        !load(library, "OSMesaGetProcAddress", &osmesa_find))
        return qp_fail(err, QP_SYSTEM, "OSMesa: too old (no OSMesaCreateContextAttribs)");
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              4,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              0,
                              0};
    OSMesaContext context = create(attributes, NULL);
    if (context == NULL) return qp_fail(err, QP_SYSTEM, "OSMesa: no OpenGL 4.0 core context");
    unsigned char *pixels = qp_alloc((size_t)SIDE * SIDE, 4, true);
    if (pixels == NULL || !make_current(context, pixels, GL_UNSIGNED_BYTE, SIDE, SIDE)) {
        osmesa_destroy(context);
        free(pixels);
        return qp_fail(err, QP_SYSTEM, "OSMesa: the context cannot be made current");
    }
    *platform = (qp_gl_platform){"OSMesa", context, NULL, pixels, find, close_osmesa};
    return QP_OK;
}
