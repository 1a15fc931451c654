#define _GNU_SOURCE
#include "host/base/measure.h"
#include "host/base/status.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double qp_median(double *values, size_t count) {
    qsort(values, count, sizeof *values, compare_doubles);
    return count % 2 == 1 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

double qp_processor_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static void set_part(void *context, size_t begin, size_t end, unsigned worker) {
    memset((unsigned char *)context + begin, (int)(worker & 255), end - begin);
}

double qp_memset_ms(void *block, size_t bytes) {
    double begin = qp_now_ms();
    qp_parallel(bytes, bytes / (4 * qp_thread_count()) + 1, set_part, block);
    return qp_now_ms() - begin;
}
