/* OpenSubdiv's evaluators of a patch table: Osd::CpuEvaluator and Osd::OmpEvaluator in float, and Far's own basis in
 * double. A frame is the update of all refined points by stencils, then the evaluation of all samples. */
#include "host/peer/osd_series.h"
#include "host/peer/refiner.h"

#include <cstring>
#include <vector>

#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/osd/cpuEvaluator.h>
#include <opensubdiv/osd/cpuPatchTable.h>
#include <opensubdiv/osd/ompEvaluator.h>

namespace Osd = OpenSubdiv::Osd;
using namespace qp_peer_osd;
using EndCap = Far::PatchTableFactory::Options::EndCapType;

namespace {

/* Patch table and stencils of all points that are not the mesh's own, and where the samples lie. */
template <typename REAL> struct Tables {
    std::unique_ptr<Far::PatchTable> patches;
    std::unique_ptr<const Far::StencilTableReal<REAL>> stencils;
    std::vector<Osd::PatchCoord> coords;
};

/* Single-crease patches stay off and infinitely sharp patches on: the CPU evaluators get the former wrong, and without
 * the latter sharp creases are not exact. */
Far::PatchTableFactory::Options table_options(unsigned level, EndCap cap) {
    Far::PatchTableFactory::Options options(level);
    options.useSingleCreasePatch = false;
    options.useInfSharpPatch = true;
    options.generateVaryingTables = false;
    options.SetEndCapType(cap);
    return options;
}

template <typename REAL>
bool make_tables(Far::TopologyRefiner &refiner, const Far::PatchTableFactory::Options &options,
                 Tables<REAL> &tables) {
    refiner.RefineAdaptive(options.GetRefineAdaptiveOptions());
    tables.patches.reset(Far::PatchTableFactory::Create(refiner, options));
    using Factory = Far::StencilTableFactoryReal<REAL>;
    typename Factory::Options stencil_options;
    stencil_options.generateIntermediateLevels = true;
    stencil_options.generateOffsets = true;
    tables.stencils.reset(Factory::Create(refiner, stencil_options));
    if (!tables.patches || !tables.stencils) return false;
    if (tables.patches->GetNumLocalPoints() > 0) {
        const Far::StencilTableReal<REAL> *all = Factory::AppendLocalPointStencilTable(
            refiner, tables.stencils.get(), tables.patches->template GetLocalPointStencilTable<REAL>());
        if (all) tables.stencils.reset(all);
    }
    return true;
}

template <typename REAL> uint64_t table_bytes(const Tables<REAL> &tables) {
    const uint64_t stencils = (uint64_t)tables.stencils->GetNumStencils(),
                   entries = tables.stencils->GetControlIndices().size();
    return stencils * 2 * sizeof(int) + entries * (sizeof(int) + sizeof(REAL)) +
           (uint64_t)tables.patches->GetNumControlVerticesTotal() * sizeof(int) +
           (uint64_t)tables.patches->GetNumPatchesTotal() * sizeof(Far::PatchParam);
}

template <typename REAL> qp_status locate(const qp_peer_task &task, Tables<REAL> &tables, qp_error *err) {
    Far::PatchMap map(*tables.patches);
    tables.coords.reserve(task.count);
    for (uint64_t i = 0; i < task.count; ++i) {
        const float u = task.uv[2 * i], v = task.uv[2 * i + 1];
        const Far::PatchMap::Handle *handle = map.FindPatch((int)task.patch[i], (double)u, (double)v);
        if (!handle)
            return qp_fail(err, QP_BAD_INPUT, "OpenSubdiv has no patch at (%.9g, %.9g) of patch %u",
                           (double)u, (double)v, task.patch[i]);
        tables.coords.emplace_back(*handle, u, v);
    }
    return QP_OK;
}

enum { CPU, OMP, FAR };

struct Evaluator : qp_peer {
    /* Float: positions of the mesh, then of all other points, 4 a point, as the evaluators like them best. */
    Tables<float> tables;
    std::unique_ptr<Osd::CpuPatchTable> cpu_patches;
    std::vector<float> given, points;
    /* Double. */
    Tables<double> double_tables;
    std::vector<Point> double_given, double_points;
};

enum { STRIDE = 4 };

qp_status fill_float(Evaluator *e, Far::TopologyRefiner &refiner,
                     const Far::PatchTableFactory::Options &options, qp_error *err) {
    const qp_mesh *mesh = e->task->mesh;
    if (!make_tables(refiner, options, e->tables)) return refused(err);
    e->cpu_patches.reset(Osd::CpuPatchTable::Create(e->tables.patches.get()));
    e->given.assign((size_t)mesh->n_vertices * STRIDE, 0);
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; ++i)
        e->given[i / 3 * STRIDE + i % 3] = (float)mesh->positions[i];
    e->points.resize(e->given.size() + (size_t)e->tables.stencils->GetNumStencils() * STRIDE);
    e->bytes = table_bytes(e->tables) + e->points.size() * sizeof(float);
    return QP_OK;
}

qp_status fill_double(Evaluator *e, Far::TopologyRefiner &refiner, Far::PatchTableFactory::Options options,
                      qp_error *err) {
    const qp_mesh *mesh = e->task->mesh;
    options.SetPatchPrecision<double>();
    if (!make_tables(refiner, options, e->double_tables)) return refused(err);
    e->double_given.resize(mesh->n_vertices);
    for (size_t v = 0; v < mesh->n_vertices; ++v)
        std::memcpy(e->double_given[v].p, mesh->positions + 3 * v, sizeof e->double_given[v].p);
    e->double_points.resize(mesh->n_vertices + (size_t)e->double_tables.stencils->GetNumStencils());
    e->bytes = table_bytes(e->double_tables) + e->double_points.size() * sizeof(Point);
    return QP_OK;
}

qp_status create(const qp_peer_series *series, const qp_peer_task *task, unsigned level, qp_peer **peer,
                 qp_error *err) {
    *peer = nullptr;
    return guarded(err, [&]() -> qp_status {
        static const EndCap caps[] = {EndCap::ENDCAP_BSPLINE_BASIS, EndCap::ENDCAP_GREGORY_BASIS,
                                      EndCap::ENDCAP_BILINEAR_BASIS};
        std::unique_ptr<Evaluator> e(new Evaluator);
        e->series = series;
        e->task = task;
        e->apart = nullptr;
        const double start = qp_now_ms();
        std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(task->mesh);
        if (!refiner) return refused(err);
        const Far::PatchTableFactory::Options options =
            table_options(level, caps[series->variant % QP_OSD_CAPS]);
        const bool in_double = series->in_double;
        qp_status status = in_double ? fill_double(e.get(), *refiner, options, err)
                                     : fill_float(e.get(), *refiner, options, err);
        if (status != QP_OK) return status;
        const double made = qp_now_ms();
        e->setup_ms = made - start;
        status = in_double ? locate(*task, e->double_tables, err) : locate(*task, e->tables, err);
        e->locate_ms = qp_now_ms() - made;
        if (status == QP_OK) *peer = e.release();
        return status;
    });
}

/* The same calls with either of Osd's evaluators. */
template <typename EVALUATOR> bool evaluate_float(Evaluator *e) {
    std::memcpy(e->points.data(), e->given.data(), e->given.size() * sizeof(float));
    const Far::StencilTableReal<float> &stencils = *e->tables.stencils;
    const Osd::BufferDescriptor from(0, STRIDE, STRIDE), to((int)e->given.size(), STRIDE, STRIDE);
    const int n = stencils.GetNumStencils();
    if (n > 0 &&
        !EVALUATOR::EvalStencils(e->points.data(), from, e->points.data(), to, stencils.GetSizes().data(),
                                 stencils.GetOffsets().data(), stencils.GetControlIndices().data(),
                                 stencils.GetWeights().data(), 0, n))
        return false;
    const Osd::BufferDescriptor source(0, 3, STRIDE), p(0, 3, 9), du(3, 3, 9), dv(6, 3, 9);
    float *out = static_cast<float *>(e->task->out);
    return EVALUATOR::EvalPatches(
        e->points.data(), source, out, p, out, du, out, dv, (int)e->tables.coords.size(),
        e->tables.coords.data(), e->cpu_patches->GetPatchArrayBuffer(), e->cpu_patches->GetPatchIndexBuffer(),
        e->cpu_patches->GetPatchParamBuffer());
}

void update_double(void *context, uint64_t begin, uint64_t end) {
    Evaluator *e = static_cast<Evaluator *>(context);
    const Point *from = e->double_points.data();
    Point *to = e->double_points.data() + e->double_given.size();
    e->double_tables.stencils->UpdateValues(from, to, (int)begin, (int)end);
}

void evaluate_double(void *context, uint64_t begin, uint64_t end) {
    const Evaluator *e = static_cast<const Evaluator *>(context);
    const Far::PatchTable &table = *e->double_tables.patches;
    for (uint64_t i = begin; i < end; ++i) {
        const Osd::PatchCoord &at = e->double_tables.coords[i];
        double w[20], wu[20], wv[20], sum[9] = {};
        table.EvaluateBasis(at.handle, (double)at.s, (double)at.t, w, wu, wv);
        Far::ConstIndexArray indices = table.GetPatchVertices(at.handle);
        for (int j = 0; j < indices.size(); ++j) {
            const double *p = e->double_points[(size_t)indices[j]].p;
            for (int c = 0; c < 3; ++c) {
                sum[c] += w[j] * p[c];
                sum[3 + c] += wu[j] * p[c];
                sum[6 + c] += wv[j] * p[c];
            }
        }
        std::memcpy(static_cast<double *>(e->task->out) + 9 * i, sum, sizeof sum);
    }
}

qp_status evaluate(qp_peer *peer, qp_error *err) {
    return guarded(err, [&]() -> qp_status {
        Evaluator *e = static_cast<Evaluator *>(peer);
        bool good = true;
        switch (peer->series->variant / QP_OSD_CAPS) {
        case CPU:
            good = evaluate_float<Osd::CpuEvaluator>(e);
            break;
        case OMP:
            Osd::OmpEvaluator::SetNumThreads((int)peer->task->threads);
            good = evaluate_float<Osd::OmpEvaluator>(e);
            break;
        case FAR:
            std::memcpy(e->double_points.data(), e->double_given.data(),
                        e->double_given.size() * sizeof(Point));
            qp_peer_ranges((uint64_t)e->double_tables.stencils->GetNumStencils(), 1024, peer->task->threads,
                           update_double, e);
            qp_peer_ranges(peer->task->count, 1024, peer->task->threads, evaluate_double, e);
            break;
        }
        return good ? QP_OK : qp_fail(err, QP_SYSTEM, "OpenSubdiv's evaluator refuses its arguments");
    });
}

void destroy(qp_peer *peer) {
    delete static_cast<Evaluator *>(peer);
}

} // namespace

#define FAR_LIBRARY "OpenSubdiv " QP_OSD_VERSION
#define FAR_SERIES(name, parallel, in_double, evaluator, cap)                                                \
    {                                                                                                        \
        name, FAR_LIBRARY, 1, 10, parallel, in_double, (evaluator)*QP_OSD_CAPS + (cap), create, evaluate,    \
            qp_osd_read, destroy                                                                             \
    }

extern "C" const qp_peer_series qp_osd_far_series[QP_OSD_FAR_SERIES] = {
    FAR_SERIES("osd-cpu/bspline", false, false, CPU, 0),
    FAR_SERIES("osd-cpu/gregory", false, false, CPU, 1),
    FAR_SERIES("osd-cpu/bilinear", false, false, CPU, 2),
    FAR_SERIES("osd-omp/bspline", true, false, OMP, 0),
    FAR_SERIES("osd-omp/gregory", true, false, OMP, 1),
    FAR_SERIES("osd-omp/bilinear", true, false, OMP, 2),
    FAR_SERIES("far-double/bspline", true, true, FAR, 0),
    FAR_SERIES("far-double/gregory", true, true, FAR, 1),
    FAR_SERIES("far-double/bilinear", true, true, FAR, 2),
};
