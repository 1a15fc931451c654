/* Included by the files that compile the kernels as C, with QP_HOST_TABLE the name of the table to define. */
#include "host/device/host_kernels.h"

#include "kernels/cache_layout.h"
#include "kernels/frame_layout.h"
#include "kernels/plan_layout.h"
#include "kernels/portable.h"
#include "kernels/ring_layout.h"

#include "kernels/ring.h"

#include "kernels/real.h"
#include "kernels/spline.h"

#include "kernels/domain.cl"
#include "kernels/hull.cl"
#include "kernels/regular.cl"

#include "kernels/cached_hull.cl"
#include "kernels/fused.cl"
#include "kernels/stream_domain.cl"
#include "kernels/stream_hull.cl"

#include "kernels/real_end.h"

#define QP_REAL_DOUBLE
#include "kernels/real.h"
#include "kernels/spline.h"

#undef QP_POINT
#include "kernels/domain.cl"
#include "kernels/hull.cl"
#include "kernels/regular.cl"

#include "kernels/cached_hull.cl"
#include "kernels/fused.cl"
#include "kernels/stream_domain.cl"
#include "kernels/stream_hull.cl"

#include "kernels/real_end.h"

/* Unpacks the arguments. */
#define QP_HOST_THUNKS(suffix)                                                                               \
    static void run_hull_##suffix(const qp_host_arg *a, size_t group) {                                      \
        hull_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].memory, a[4].memory, a[5].memory,          \
                      a[6].number, a[7].memory, group);                                                      \
    }                                                                                                        \
    static void run_domain_##suffix(const qp_host_arg *a, size_t group) {                                    \
        domain_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].memory, a[4].memory, a[5].memory,        \
                        a[6].number, a[7].memory, a[8].memory, a[9].memory, a[10].memory, a[11].memory,      \
                        a[12].memory, a[13].number, group);                                                  \
    }                                                                                                        \
    static void run_regular_##suffix(const qp_host_arg *a, size_t group) {                                   \
        regular_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].number, a[4].memory, a[5].memory,       \
                         a[6].memory, a[7].memory, a[8].memory, a[9].number, group);                         \
    }                                                                                                        \
    static void run_fused_##suffix(const qp_host_arg *a, size_t group) {                                     \
        fused_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].memory, a[4].memory, a[5].memory,         \
                       a[6].number, a[7].memory, a[8].memory, a[9].memory, a[10].memory, a[11].memory,       \
                       a[12].memory, a[13].memory, a[14].number, group);                                     \
    }                                                                                                        \
    static void run_stream_hull_##suffix(const qp_host_arg *a, size_t group) {                               \
        stream_hull_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].memory, a[4].memory, a[5].memory,   \
                             a[6].number, a[7].number, a[8].number, a[9].memory, a[10].memory, group);       \
    }                                                                                                        \
    static void run_stream_domain_##suffix(const qp_host_arg *a, size_t group) {                             \
        stream_domain_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].memory, a[4].memory, a[5].memory, \
                               a[6].number, a[7].number, a[8].memory, a[9].memory, a[10].memory,             \
                               a[11].memory, a[12].memory, a[13].memory, a[14].memory, a[15].number, group); \
    }                                                                                                        \
    static void run_cached_hull_##suffix(const qp_host_arg *a, size_t group) {                               \
        cached_hull_##suffix(a[0].memory, a[1].memory, a[2].memory, a[3].memory, a[4].memory, a[5].memory,   \
                             a[6].number, a[7].memory, a[8].memory, a[9].memory, a[10].memory, a[11].memory, \
                             a[12].memory, group);                                                           \
    }                                                                                                        \
    static void run_cache_forget_##suffix(const qp_host_arg *a, size_t group) {                              \
        cache_forget_##suffix(a[0].memory, a[1].number, a[2].memory, a[3].memory, a[4].memory, group);       \
    }

QP_HOST_THUNKS(float)
QP_HOST_THUNKS(double)

const qp_host_kernels QP_HOST_TABLE[2] = {
    [QP_FLOAT] = {run_hull_float, run_domain_float, run_regular_float, run_fused_float, run_stream_hull_float,
                  run_stream_domain_float, run_cached_hull_float, run_cache_forget_float},
    [QP_DOUBLE] = {run_hull_double, run_domain_double, run_regular_double, run_fused_double,
                   run_stream_hull_double, run_stream_domain_double, run_cached_hull_double,
                   run_cache_forget_double},
};
