/* The series of the module of OpenSubdiv, by the file that makes them. */
#ifndef QP_PEER_OSD_SERIES_H
#define QP_PEER_OSD_SERIES_H

#include "host/peer/peer.h"

#define QP_OSD_VERSION "3.5"
enum { QP_OSD_CAPS = 3, QP_OSD_FAR_SERIES = 9, QP_OSD_BFR_SERIES = 4 };

#ifdef __cplusplus
extern "C" {
#endif
extern const qp_peer_series qp_osd_far_series[QP_OSD_FAR_SERIES], qp_osd_bfr_series[QP_OSD_BFR_SERIES];
#ifdef __cplusplus
}
#endif
#endif
