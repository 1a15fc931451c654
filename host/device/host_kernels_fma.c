/* The kernels for x86-64 processors with AVX2 and FMA. */
#ifdef __x86_64__

/* Headers first: what they define is for any processor. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC target("avx2,fma")
#endif

#define QP_HOST_TABLE qp_host_kernels_fma
#include "host/device/host_kernels_body.h"

#ifdef __clang__
#pragma clang attribute pop
#endif

#else
typedef int qp_no_such_processor; /* ISO C wants something in a file */
#endif
