/* What measurements of speed share. */
#ifndef QP_BASE_MEASURE_H
#define QP_BASE_MEASURE_H

#include <stddef.h>

/* Sorts values (at least one, none of them NaN) and returns their median. */
double qp_median(double *values, size_t count);

/* Milliseconds of processor time of all threads of this process, from an arbitrary origin. */
double qp_processor_ms(void);

/* Milliseconds to set bytes of block, on all cores: what the time of a vertex stream is compared with. */
double qp_memset_ms(void *block, size_t bytes);

#endif
