/* What the C++ faces of OpenSubdiv share: its refiner of one of our meshes, and its errors as ours. */
#ifndef QP_PEER_REFINER_H
#define QP_PEER_REFINER_H

#include "host/mesh/mesh.h"

#include <exception>
#include <memory>
#include <new>

#include <opensubdiv/far/topologyRefiner.h>

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

namespace qp_peer_osd {

/* The mesh goes over with its tags as given, not as made effective. Null when OpenSubdiv refuses it. */
std::unique_ptr<Far::TopologyRefiner> make_refiner(const qp_mesh *mesh);

/* A position, as Far interpolates. */
struct Point {
    double p[3];
    void Clear(void * = nullptr) {
        p[0] = p[1] = p[2] = 0;
    }
    void AddWithWeight(const Point &from, double weight) {
        for (int c = 0; c < 3; ++c) p[c] += weight * from.p[c];
    }
};

/* QP_BAD_INPUT with the last thing OpenSubdiv said on this thread. */
qp_status refused(qp_error *err);
/* Forgets that, and listens from now on: OpenSubdiv reports through callbacks and null pointers. */
void listen();

/* Runs body, which may throw or return a status of its own. */
template <typename BODY> qp_status guarded(qp_error *err, BODY body) {
    try {
        listen();
        return body();
    } catch (const std::bad_alloc &) {
        return qp_fail(err, QP_SYSTEM, "OpenSubdiv: out of memory");
    } catch (const std::exception &e) {
        return qp_fail(err, QP_SYSTEM, "OpenSubdiv: %s", e.what());
    } catch (...) {
        return qp_fail(err, QP_SYSTEM, "OpenSubdiv: unknown exception");
    }
}

} // namespace qp_peer_osd

#endif
