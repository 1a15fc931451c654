/* The series of the module of OpenSubdiv, by the file that makes them. */
#ifndef QP_PEER_OSD_SERIES_H
#define QP_PEER_OSD_SERIES_H

#include "host/peer/peer.h"

#define QP_OSD_VERSION "3.5"
enum { QP_OSD_CAPS = 3, QP_OSD_FAR_SERIES = 9, QP_OSD_BFR_SERIES = 4 };

#ifdef __cplusplus
extern "C" {
#endif
/* The .read of them all: 9 numbers a sample, position and derivatives, in task->out. */
static inline void qp_osd_read(const qp_peer *peer, uint64_t i, double p[3], double du[3], double dv[3]) {
    double *const to[3] = {p, du, dv};
    for (uint64_t c = 0; c < 9; ++c)
        to[c / 3][c % 3] = peer->series->in_double ? ((const double *)peer->task->out)[9 * i + c]
                                                   : (double)((const float *)peer->task->out)[9 * i + c];
}

extern const qp_peer_series qp_osd_far_series[QP_OSD_FAR_SERIES], qp_osd_bfr_series[QP_OSD_BFR_SERIES];
#ifdef __cplusplus
}
#endif
#endif
