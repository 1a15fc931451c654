/* Parts of the program that are loaded when they are first needed, because what they link is slow to load (or may be
 * missing from the machine). */
#ifndef QP_BASE_MODULE_H
#define QP_BASE_MODULE_H

#include "host/base/status.h"

/* Loads `file` and finds `symbol` in it. It may lie beside the program (build folder), in the folder above (tests in
 * the build folder) or in `folder`, relative to the program (installed). The module is never unloaded. QP_SYSTEM, the
 * message beginning with `what`, when it is in none of them or does not load. */
qp_status qp_module_load(const char *what, const char *file, const char *folder, const char *symbol,
                         const void **found, qp_error *err);

#endif
