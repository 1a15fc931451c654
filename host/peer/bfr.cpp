/* OpenSubdiv's Bfr: a surface object for each face. A frame computes every surface's points from the mesh's positions,
 * then evaluates its samples. */
#include "host/peer/osd_series.h"
#include "host/peer/refiner.h"

#include <vector>

#include <opensubdiv/bfr/refinerSurfaceFactory.h>

namespace Bfr = OpenSubdiv::Bfr;
using namespace qp_peer_osd;

namespace {

template <typename REAL> struct Evaluator : qp_peer {
    /* A face with samples: its surface, where its points lie, and its samples. */
    struct Face {
        Bfr::Surface<REAL> surface;
        size_t points;
        uint64_t first, end;
    };
    std::unique_ptr<Far::TopologyRefiner> refiner;
    std::unique_ptr<Bfr::RefinerSurfaceFactory<>> factory;
    std::vector<Face> faces;
    std::vector<REAL> uv, given, points; /* uv: of the whole face, in Bfr's own coordinates */
};

/* Faces with samples; their samples follow each other because patches do. */
template <typename REAL> void list_faces(Evaluator<REAL> *e) {
    const qp_peer_task *task = e->task;
    uint32_t last = QP_NONE;
    for (uint64_t i = 0; i < task->count; ++i) {
        const uint32_t face = qp_patch_face(task->mesh, task->patch[i], nullptr);
        if (face != last) {
            e->faces.emplace_back();
            e->faces.back().first = i;
        }
        e->faces.back().end = i + 1;
        last = face;
    }
}

template <typename REAL> qp_status make_surfaces(Evaluator<REAL> *e, unsigned level, qp_error *err) {
    const qp_mesh *mesh = e->task->mesh;
    e->refiner = make_refiner(mesh);
    if (!e->refiner) return refused(err);
    typename Bfr::SurfaceFactory::Options options; /* its defaults where no level is given */
    if (level > 0) {
        options.SetApproxLevelSmooth((int)level);
        options.SetApproxLevelSharp((int)level);
    }
    e->factory.reset(new Bfr::RefinerSurfaceFactory<>(*e->refiner, options));
    size_t points = 0;
    for (auto &face : e->faces) {
        const uint32_t f = qp_patch_face(mesh, e->task->patch[face.first], nullptr);
        if (!e->factory->InitVertexSurface((int)f, &face.surface))
            return qp_fail(err, QP_BAD_INPUT, "Bfr has no surface for face %u", f);
        face.points = points;
        points += 3 * (size_t)face.surface.GetNumPatchPoints();
    }
    e->points.resize(points);
    e->given.assign(mesh->positions, mesh->positions + 3 * (size_t)mesh->n_vertices);
    return QP_OK;
}

template <typename REAL> void locate(Evaluator<REAL> *e) {
    const qp_peer_task *task = e->task;
    e->uv.resize(2 * task->count);
    for (auto &face : e->faces) {
        const Bfr::Parameterization parameters = face.surface.GetParameterization();
        for (uint64_t i = face.first; i < face.end; ++i) {
            const REAL uv[2] = {(REAL)task->uv[2 * i], (REAL)task->uv[2 * i + 1]};
            e->uv[2 * i] = uv[0];
            e->uv[2 * i + 1] = uv[1];
            uint32_t child;
            qp_patch_face(task->mesh, task->patch[i], &child);
            if (parameters.HasSubFaces())
                parameters.ConvertNormalizedSubFaceToCoord((int)child, uv, &e->uv[2 * i]);
        }
    }
}

template <typename REAL>
qp_status create_in(const qp_peer_series *series, const qp_peer_task *task, unsigned level, qp_peer **peer,
                    qp_error *err) {
    std::unique_ptr<Evaluator<REAL>> e(new Evaluator<REAL>);
    e->series = series;
    e->task = task;
    e->apart = nullptr;
    const double start = qp_now_ms();
    list_faces(e.get());
    qp_status status = make_surfaces(e.get(), level, err);
    if (status != QP_OK) return status;
    const double made = qp_now_ms();
    locate(e.get());
    e->setup_ms = made - start;
    e->locate_ms = qp_now_ms() - made;
    e->bytes = 0; /* the surfaces do not tell */
    *peer = e.release();
    return QP_OK;
}

qp_status create(const qp_peer_series *series, const qp_peer_task *task, unsigned level, qp_peer **peer,
                 qp_error *err) {
    *peer = nullptr;
    return guarded(err, [&]() {
        return series->in_double ? create_in<double>(series, task, level, peer, err)
                                 : create_in<float>(series, task, level, peer, err);
    });
}

template <typename REAL> void evaluate_faces(void *context, uint64_t begin, uint64_t end) {
    Evaluator<REAL> *e = static_cast<Evaluator<REAL> *>(context);
    REAL *out = static_cast<REAL *>(e->task->out);
    for (uint64_t f = begin; f < end; ++f) {
        const auto &face = e->faces[f];
        REAL *points = e->points.data() + face.points;
        face.surface.PreparePatchPoints(e->given.data(), 3, points, 3);
        for (uint64_t i = face.first; i < face.end; ++i)
            face.surface.Evaluate(&e->uv[2 * i], points, 3, out + 9 * i, out + 9 * i + 3, out + 9 * i + 6);
    }
}

qp_status evaluate(qp_peer *peer, qp_error *err) {
    return guarded(err, [&]() {
        if (peer->series->in_double)
            qp_peer_ranges(static_cast<Evaluator<double> *>(peer)->faces.size(), 16, peer->task->threads,
                           evaluate_faces<double>, static_cast<Evaluator<double> *>(peer));
        else
            qp_peer_ranges(static_cast<Evaluator<float> *>(peer)->faces.size(), 16, peer->task->threads,
                           evaluate_faces<float>, static_cast<Evaluator<float> *>(peer));
        return QP_OK;
    });
}

void destroy(qp_peer *peer) {
    if (!peer) return;
    if (peer->series->in_double)
        delete static_cast<Evaluator<double> *>(peer);
    else
        delete static_cast<Evaluator<float> *>(peer);
}

} // namespace

extern "C" const qp_peer_series qp_osd_bfr_series[QP_OSD_BFR_SERIES] = {
    {"bfr-default", "OpenSubdiv " QP_OSD_VERSION, 0, 0, true, false, 0, create, evaluate, qp_osd_read,
     destroy},
    {"bfr", "OpenSubdiv " QP_OSD_VERSION, 1, 10, true, false, 0, create, evaluate, qp_osd_read, destroy},
    {"bfr-double-default", "OpenSubdiv " QP_OSD_VERSION, 0, 0, true, true, 0, create, evaluate, qp_osd_read,
     destroy},
    {"bfr-double", "OpenSubdiv " QP_OSD_VERSION, 1, 10, true, true, 0, create, evaluate, qp_osd_read,
     destroy},
};
