/* What a test needs: CHECK macros that count and go on, and an exit code. A test's main ends in
 * `return check_report();`. Exit 0 good, 1 some check failed, 77 skipped. */
#ifndef QP_TESTS_CHECK_H
#define QP_TESTS_CHECK_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Under a sanitizer most things are some ten times as slow, and what counts is that every line runs: long tests take fewer
 * meshes and samples there. */
#if defined(__SANITIZE_ADDRESS__)
enum { CHECK_SANITIZED = 1 };
#else
enum { CHECK_SANITIZED = 0 };
#endif

static unsigned long check_count, check_failures;

/* Counts one check; prints the first 20 that fail. */
static inline int check_that(int good, const char *file, int line, const char *text) {
    ++check_count;
    if (!good && ++check_failures <= 20) fprintf(stderr, "%s:%d: failed: %s\n", file, line, text);
    return good;
}
static inline int check_near(double a, double b, double tolerance, const char *file, int line,
                             const char *text) {
    /* Written so that NaN fails. */
    int good = fabs(a - b) <= tolerance;
    check_that(good, file, line, text);
    if (!good && check_failures <= 20)
        fprintf(stderr, "    %.17g and %.17g differ by %.3g, more than %.3g\n", a, b, fabs(a - b), tolerance);
    return good;
}

#define CHECK(condition) check_that((condition) != 0, __FILE__, __LINE__, #condition)
#define CHECK_NEAR(a, b, tolerance) check_near((a), (b), (tolerance), __FILE__, __LINE__, #a " is near " #b)
/* For a qp_status with its qp_error: prints the message on failure. */
#define CHECK_OK(call, error)                                                                                \
    (check_that((call) == 0, __FILE__, __LINE__, #call) ? 1                                                  \
                                                        : (fprintf(stderr, "    %s\n", (error).message), 0))

static inline int check_report(void) {
    if (check_count == 0) {
        fprintf(stderr, "no check was made\n");
        return 1;
    }
    printf("%lu checks, %lu failed\n", check_count, check_failures);
    return check_failures != 0;
}

/* Folder of the models, or NULL. */
static inline const char *check_models(void) {
    const char *folder = getenv("QUADPLAN_MODELS");
    return folder != NULL && folder[0] != '\0' ? folder : NULL;
}
/* Whether to take the counts that the issues ask for, in minutes, rather than those of every day. */
static inline int check_full(void) {
    const char *full = getenv("QUADPLAN_FULL");
    return full != NULL && full[0] == '1';
}
/* `return check_skip_models();` from a main that cannot go on without them. */
static inline int check_skip_models(void) {
    printf("skipped: QUADPLAN_MODELS not set\n");
    return 77;
}

#endif
