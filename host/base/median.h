/* The median of repeated measurements. */
#ifndef QP_BASE_MEDIAN_H
#define QP_BASE_MEDIAN_H

#include <stddef.h>

/* Sorts values (at least one, none of them NaN) and returns their median. */
double qp_median(double *values, size_t count);

#endif
