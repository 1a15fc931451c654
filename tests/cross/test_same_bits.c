/* The same bits everywhere: vertices, derivatives and flags of a fixed list of cases (stream_cases.h) have the hashes that
 * stream_hashes.txt records, on every runtime that this machine has. docs/same-bits.md tells about them.
 *
 * The test runs itself once a runtime, in that runtime's environment:
 *   test_same_bits --list                   prints the OpenCL devices: id, platform, name
 *   test_same_bits --device ID MOST CASE    prints the hashes of cases of size MOST or less, of number CASE or (-1) of all
 *
 * QUADPLAN_RECORD=1 writes the record instead, from the host, where all runtimes agree.
 * QUADPLAN_OPENCL_LIBRARIES names more OpenCL drivers (files, separated by colons) to run the cases on. */
#define _GNU_SOURCE
#include "host/device/device.h"
#include "tests/cross/stream_cases.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

enum { LINE = 1024, MOST_RUNTIMES = 64 };

/* ---- In a runtime's environment ---- */

static int print_devices(void) {
    qp_device_info *list = NULL;
    size_t count = 0;
    qp_error err;
    if (qp_device_list(&list, &count, &err) != QP_OK) return 1;
    for (size_t i = 0; i + 1 < count; ++i)
        printf("device\t%s\t%s\t%s\n", list[i].id, list[i].platform, list[i].name);
    free(list);
    return 0;
}

static qp_status print_hashes(qp_device *device, const stream_case *c, int index, qp_error *err) {
    const bool is_double = stream_case_precision(index) == QP_DOUBLE;
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    void *scratch = NULL;
    qp_stream stream;
    const qp_surface_options surface_options = {.depth = c->depth};
    const qp_frame_options options = {.precision = stream_case_precision(index),
                                      .want_hash = 1,
                                      .want_derivatives = 1,
                                      .no_regular_pass = c->no_regular_pass};
    qp_status status = stream_case_mesh(c, &mesh, err);
    if (status == QP_OK) status = qp_surface_create(mesh, &surface_options, &surface, err);
    if (status == QP_OK) status = qp_frame_create(device, surface, &options, &frame, err);
    if (status == QP_OK) status = stream_case_eval(c, mesh, frame, &scratch, &stream, err);
    if (status == QP_OK) {
        uint64_t rest =
            qp_hash(stream.derivatives,
                    (size_t)stream.n_samples * 6 * (is_double ? sizeof(double) : sizeof(float)), 0);
        rest = qp_hash(stream.flags, (size_t)stream.n_samples, rest);
        printf("hash %d %016" PRIx64 " %016" PRIx64 "\n", index, stream.hash, rest);
        fflush(stdout);
    }
    free(scratch);
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    return status;
}

static int run_cases(const char *which, int most, int only) {
    qp_error err;
    qp_device *device = NULL;
    if (qp_device_open(which, &device, &err) != QP_OK) {
        printf("error %s\n", err.message);
        return 1;
    }
    int failed = 0;
    for (int i = 0; i < STREAM_CASES; ++i) {
        const stream_case *c = stream_case_of(i);
        if ((int)c->size > most || (only >= 0 && i != only)) continue;
        if (stream_case_is_model(c) && check_models() == NULL) continue;
        if (stream_case_precision(i) == QP_DOUBLE && !qp_device_has_double(device)) continue;
        if (print_hashes(device, c, i, &err) == QP_OK) continue;
        printf("error case %d: %s\n", i, err.message);
        failed = 1;
    }
    qp_device_free(device);
    return failed;
}

/* ---- The record, and what runtimes made ---- */

typedef struct hashes {
    bool there;
    uint64_t vertices, rest;
} hashes;

typedef struct runtime {
    char name[LINE], before[LINE], device[40]; /* `before` precedes the command: variables, a wrapper */
    case_size most;
} runtime;

static hashes recorded[STREAM_CASES], host[STREAM_CASES];
static runtime runtimes[MOST_RUNTIMES];
static int n_runtimes;
static const char *self;

static void record_path(char *path, size_t size) {
    const char *source = getenv("QUADPLAN_SOURCE_DIR");
    snprintf(path, size, "%s/tests/cross/stream_hashes.txt", source != NULL ? source : ".");
}

static void read_record(void) {
    char path[4096], line[LINE];
    record_path(path, sizeof path);
    FILE *file = fopen(path, "r");
    if (file == NULL) return;
    while (fgets(line, sizeof line, file) != NULL) {
        char name[LINE], wanted[LINE];
        hashes h = {.there = true};
        if (sscanf(line, "%1000s %" SCNx64 " %" SCNx64, name, &h.vertices, &h.rest) != 3) continue;
        for (int i = 0; i < STREAM_CASES; ++i) {
            stream_case_name(i, wanted, sizeof wanted);
            if (strcmp(name, wanted) == 0) recorded[i] = h;
        }
    }
    fclose(file);
}

static void write_record(void) {
    char path[4096], name[LINE];
    record_path(path, sizeof path);
    FILE *file = fopen(path, "w");
    if (!CHECK(file != NULL)) return;
    fprintf(file, "# Hashes of the vertex stream (as `quadplan eval` prints it), and of derivatives and "
                  "flags, the same on every runtime.\n"
                  "# Written by scripts/record-hashes; the cases are those of stream_cases.h.\n");
    for (int i = 0; i < STREAM_CASES; ++i) {
        const hashes *new = host[i].there ? &host[i] : &recorded[i], *old = &recorded[i];
        stream_case_name(i, name, sizeof name);
        if (!new->there) continue;
        fprintf(file, "%s %016" PRIx64 " %016" PRIx64 "\n", name, new->vertices, new->rest);
        const bool same = old->there && old->vertices == new->vertices && old->rest == new->rest;
        if (!same) printf("%s %s\n", old->there ? "changed:" : "new:", name);
    }
    CHECK(fclose(file) == 0);
}

/* Adds a runtime; what is printed by its command is compared later. */
static void add(const char *device, case_size most, const char *before, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
static void add(const char *device, case_size most, const char *before, const char *format, ...) {
    if (!CHECK(n_runtimes < MOST_RUNTIMES)) return;
    runtime *r = &runtimes[n_runtimes++];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(r->name, sizeof r->name, format, arguments);
    va_end(arguments);
    snprintf(r->before, sizeof r->before, "%s", before);
    snprintf(r->device, sizeof r->device, "%s", device);
    r->most = CHECK_SANITIZED ? CASE_TINY : most;
}

/* Starts this test again. The shell is given nothing but this test's own words and paths from its environment. */
static FILE *start(const char *before, const char *arguments) {
    char command[4 * LINE];
    snprintf(command, sizeof command, "%s timeout 500 '%s' %s 2>&1", before, self, arguments);
    fflush(stdout);
    return popen(command, "r");
}

static void run(const runtime *r) {
    char arguments[LINE], line[LINE], message[LINE] = "";
    int cases = 0, differences = 0;
    snprintf(arguments, sizeof arguments, "--device %s %d -1", r->device, (int)r->most);
    FILE *pipe = start(r->before, arguments);
    if (!CHECK(pipe != NULL)) return;
    while (fgets(line, sizeof line, pipe) != NULL) {
        int i;
        hashes h = {.there = true};
        if (sscanf(line, "hash %d %" SCNx64 " %" SCNx64, &i, &h.vertices, &h.rest) != 3) {
            if (message[0] == '\0' || strncmp(line, "error", 5) == 0)
                snprintf(message, sizeof message, "%s", line);
            continue;
        }
        if (!CHECK(i >= 0 && i < STREAM_CASES)) break;
        if (!host[i].there) host[i] = h; /* the first runtime is the host */
        ++cases;
        if (CHECK(h.vertices == host[i].vertices && h.rest == host[i].rest)) continue;
        stream_case_name(i, arguments, sizeof arguments);
        printf("  %s: %s differ\n", arguments,
               h.vertices != host[i].vertices ? "vertices" : "derivatives or flags");
        ++differences;
    }
    const int code = pclose(pipe);
    printf("%s: %d cases, %d different\n", r->name, cases, differences);
    if (!CHECK(WIFEXITED(code) && WEXITSTATUS(code) == 0 && cases > 0)) printf("  %s\n", message);
}

/* ---- Which runtimes there are ---- */

/* PoCL: numbers of threads, ways to make a group of its items, sizes of a group. */
static void add_pocl(const char *device, const char *name, const char *before) {
    static const struct {
        const char *name;
        int items;
    } methods[] = {{"loops", 5}, {"workitemrepl", 2}, {"cbs", 32}};
    const int known =
        strncmp(name, "pthread", 7) == 0 ? 2 : 3; /* cbs came with 4.0, when devices were named anew */
    char with[2 * LINE];
    add(device, CASE_LARGE, before, "PoCL (%s)", name);
    if (CHECK_SANITIZED) return;
    snprintf(with, sizeof with, "%s POCL_MAX_PTHREAD_COUNT=1 POCL_CPU_MAX_CU_COUNT=1", before);
    add(device, CASE_SMALL, with, "PoCL, one thread");
    for (int i = 0; i < known; ++i) {
        snprintf(with, sizeof with, "%s POCL_WORK_GROUP_METHOD=%s QUADPLAN_GROUP_ITEMS=%d", before,
                 methods[i].name, methods[i].items);
        add(device, CASE_TINY, with, "PoCL, work-group method %s, groups of %d items", methods[i].name,
            methods[i].items);
    }
}

/* Adds what a list of devices in an environment shows; returns whether PoCL / Rusticl was among them. */
static void add_devices(const char *before, case_size most, bool *pocl, bool *rusticl) {
    char line[LINE];
    FILE *pipe = start(before, "--list");
    if (!CHECK(pipe != NULL)) return;
    while (fgets(line, sizeof line, pipe) != NULL) {
        char id[40], platform[300], name[300];
        if (sscanf(line, "device\t%39[^\t]\t%299[^\t]\t%299[^\n]", id, platform, name) != 3) continue;
        if (strstr(platform, "Portable Computing Language") != NULL) {
            add_pocl(id, name, before);
            *pocl = true;
        } else if (strstr(platform, "rusticl") != NULL) {
            if (!CHECK_SANITIZED) add(id, CASE_TINY, before, "Rusticl (%s)", name);
            *rusticl = true;
        } else if (!CHECK_SANITIZED) {
            add(id, most, before, "%s (%s)", platform, name);
        }
    }
    pclose(pipe);
}

static void find_runtimes(void) {
    char cache[LINE], with[2 * LINE];
    const char *folder = getenv("QUADPLAN_BINARY_DIR"), *more = getenv("QUADPLAN_OPENCL_LIBRARIES");
    bool pocl = false, rusticl = false, ignored = false;
    add("host", CASE_LARGE, "", "host");
    add("host", CASE_LARGE, "QUADPLAN_HOST_PLAIN=1", "host, kernels for any processor");
    if (!CHECK_SANITIZED)
        add("host", CASE_LARGE, "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4 QUADPLAN_THREADS=1",
            "host, one thread, the C library's functions without fma");
    snprintf(cache, sizeof cache, "RUSTICL_ENABLE=llvmpipe MESA_SHADER_CACHE_DIR='%s/mesa-cache'",
             folder != NULL ? folder : ".");
    add_devices(cache, CASE_LARGE, &pocl, &rusticl);
    if (!pocl) printf("not there: PoCL\n");
    if (CHECK_SANITIZED) {
        printf("left out under sanitizers: larger cases, and everything but the host and PoCL\n");
        return;
    }
    if (!rusticl) printf("not there: Rusticl\n");
    if (system("command -v oclgrind >/dev/null") == 0) {
        const char *const before = "oclgrind --build-options -cl-opt-disable";
        add("0.0", CASE_TINY, before, "Oclgrind");
        snprintf(with, sizeof with, "QUADPLAN_GROUP_ITEMS=7 %s", before);
        add("0.0", CASE_TINY, with, "Oclgrind, groups of 7 items");
    } else {
        printf("not there: Oclgrind\n");
    }
    while (more != NULL && *more != '\0') {
        const int length = (int)strcspn(more, ":");
        snprintf(with, sizeof with, "OCL_ICD_VENDORS='%.*s'", length, more);
        add_devices(with, CASE_SMALL, &ignored, &ignored);
        more += length + (more[length] == ':');
    }
}

int main(int argc, char **argv) {
    self = argv[0];
    if (argc == 2 && strcmp(argv[1], "--list") == 0) return print_devices();
    if (argc == 5 && strcmp(argv[1], "--device") == 0)
        return run_cases(argv[2], atoi(argv[3]), atoi(argv[4]));
    const char *record = getenv("QUADPLAN_RECORD");
    read_record();
    find_runtimes();
    for (int i = 0; i < n_runtimes; ++i) run(&runtimes[i]);
    if (check_models() == NULL) printf("models skipped: QUADPLAN_MODELS not set\n");
    if (record != NULL && record[0] != '\0') {
        if (check_failures == 0) write_record();
        return check_report();
    }
    for (int i = 0; i < STREAM_CASES; ++i) {
        char name[LINE];
        if (!host[i].there) continue;
        stream_case_name(i, name, sizeof name);
        if (!CHECK(recorded[i].there && recorded[i].vertices == host[i].vertices &&
                   recorded[i].rest == host[i].rest))
            printf("  %s: not as recorded (scripts/record-hashes, if that is meant)\n", name);
    }
    return check_report();
}
