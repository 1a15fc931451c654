/* The module of OpenSubdiv. */
#include "host/peer/osd_series.h"

const qp_peer_module qp_peer_module_table = {
    {{qp_osd_far_series, QP_OSD_FAR_SERIES}, {qp_osd_bfr_series, QP_OSD_BFR_SERIES}}};
