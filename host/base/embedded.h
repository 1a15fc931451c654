/* Text files that the build puts into the binary (cmake/embed.cmake). */
#ifndef QP_BASE_EMBEDDED_H
#define QP_BASE_EMBEDDED_H

#include <stddef.h>

typedef struct qp_embedded {
    const char *name;           /* without folder, e.g. "hull.cl"; NULL ends a table */
    const unsigned char *bytes; /* length bytes and a NUL */
    size_t length;
} qp_embedded;

extern const qp_embedded qp_embedded_kernels[]; /* kernels/ *.cl and *.h; in libquadplan */
extern const qp_embedded qp_embedded_shaders[]; /* gl/shaders/ *.glsl; in the program */
extern const qp_embedded qp_embedded_scripts[]; /* bench/ *.py; in the program */

#endif
