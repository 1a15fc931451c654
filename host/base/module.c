#define _GNU_SOURCE
#include "host/base/module.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

qp_status qp_module_load(const char *what, const char *file, const char *folder, const char *symbol,
                         const void **found, qp_error *err) {
    char program[4096];
    *found = NULL;
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    if (length < 0) return qp_fail(err, QP_SYSTEM, "cannot tell where the program lies: %s", strerror(errno));
    program[length] = '\0';
    char *slash = strrchr(program, '/');
    if (slash != NULL) slash[1] = '\0';
    const char *const places[] = {"", "../", folder};
    for (size_t i = 0; i < sizeof places / sizeof *places; ++i) {
        char path[sizeof program + 512];
        snprintf(path, sizeof path, "%s%s/%s", program, places[i], file);
        if (access(path, R_OK) != 0) continue;
        void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (module == NULL) return qp_fail(err, QP_SYSTEM, "%s: %s", what, dlerror());
        *found = dlsym(module, symbol);
        if (*found == NULL) return qp_fail(err, QP_SYSTEM, "%s: %s has no %s", what, path, symbol);
        return QP_OK;
    }
    return qp_fail(err, QP_SYSTEM, "%s: there is no %s near %s", what, file, program);
}
