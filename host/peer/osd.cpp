#include "host/peer/osd.h"

#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <opensubdiv/far/error.h>
#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

namespace {

struct Point {
    double p[3];
    void Clear(void * = nullptr) {
        p[0] = p[1] = p[2] = 0;
    }
    void AddWithWeight(const Point &from, double weight) {
        for (int c = 0; c < 3; ++c) p[c] += weight * from.p[c];
    }
};

/* The last thing OpenSubdiv said; it reports through callbacks and null pointers. */
thread_local std::string last_message;

void keep_message(Far::ErrorType, const char *message) {
    last_message = message;
}
void drop_warning(const char *) {
}

/* Runs body, which may throw or return a status of its own. */
template <typename BODY> qp_status guarded(qp_error *err, BODY body) {
    try {
        last_message.clear();
        Far::SetErrorCallback(keep_message);
        Far::SetWarningCallback(drop_warning);
        return body();
    } catch (const std::bad_alloc &) {
        return qp_fail(err, QP_SYSTEM, "OpenSubdiv: out of memory");
    } catch (const std::exception &e) {
        return qp_fail(err, QP_SYSTEM, "OpenSubdiv: %s", e.what());
    } catch (...) {
        return qp_fail(err, QP_SYSTEM, "OpenSubdiv: unknown exception");
    }
}

qp_status refused(qp_error *err) {
    for (char &c : last_message)
        if (c == '\n') c = ' ';
    return qp_fail(err, QP_BAD_INPUT, "OpenSubdiv refuses the mesh: %s",
                   last_message.empty() ? "no reason given" : last_message.c_str());
}

Sdc::Options scheme_options(const qp_mesh *mesh) {
    Sdc::Options options;
    options.SetVtxBoundaryInterpolation(mesh->boundary == QP_BOUNDARY_NONE ? Sdc::Options::VTX_BOUNDARY_NONE
                                        : mesh->boundary == QP_BOUNDARY_EDGE_ONLY
                                            ? Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
                                            : Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
    options.SetCreasingMethod(mesh->crease_method == QP_CREASE_CHAIKIN ? Sdc::Options::CREASE_CHAIKIN
                                                                       : Sdc::Options::CREASE_UNIFORM);
    options.SetTriangleSubdivision(mesh->triangle_rule == QP_TRIANGLE_SMOOTH ? Sdc::Options::TRI_SUB_SMOOTH
                                                                             : Sdc::Options::TRI_SUB_CATMARK);
    return options;
}

std::vector<int> to_int(const uint32_t *values, size_t count) {
    return std::vector<int>(values, values + count);
}

std::unique_ptr<Far::TopologyRefiner> make_refiner(const qp_mesh *mesh) {
    std::vector<int> sizes(mesh->n_faces), vertices = to_int(mesh->face_vertices, mesh->n_corners);
    for (uint32_t f = 0; f < mesh->n_faces; ++f) sizes[f] = (int)qp_face_size(mesh, f);
    std::vector<int> creases = to_int(mesh->crease_vertices, 2 * (size_t)mesh->n_creases);
    std::vector<int> corners = to_int(mesh->corner_tag_vertices, mesh->n_corner_tags);
    std::vector<int> holes = to_int(mesh->hole_tag_faces, mesh->n_hole_tags);
    Far::TopologyDescriptor d;
    d.numVertices = (int)mesh->n_vertices;
    d.numFaces = (int)mesh->n_faces;
    d.numVertsPerFace = sizes.data();
    d.vertIndicesPerFace = vertices.data();
    d.numCreases = (int)mesh->n_creases;
    d.creaseVertexIndexPairs = creases.data();
    d.creaseWeights = mesh->crease_sharpness;
    d.numCorners = (int)mesh->n_corner_tags;
    d.cornerVertexIndices = corners.data();
    d.cornerWeights = mesh->corner_tag_sharpness;
    d.numHoles = (int)mesh->n_hole_tags;
    d.holeIndices = holes.data();
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    return std::unique_ptr<Far::TopologyRefiner>(
        Factory::Create(d, Factory::Options(Sdc::SCHEME_CATMARK, scheme_options(mesh))));
}

} // namespace

struct qp_osd {
    std::unique_ptr<Far::PatchTable> table;
    std::unique_ptr<Far::PatchMap> map;
    std::vector<Point> points; /* of all levels, then the end caps' own */
};

namespace {

qp_status fill(qp_osd *osd, const qp_mesh *mesh, const double *positions, unsigned depth, qp_error *err) {
    std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(mesh);
    if (!refiner) return refused(err);
    Far::PatchTableFactory::Options options(depth);
    options.useSingleCreasePatch = false;
    options.useInfSharpPatch = true;
    options.generateLegacySharpCornerPatches = false;
    options.generateVaryingTables = false;
    options.SetEndCapType(Far::PatchTableFactory::Options::ENDCAP_GREGORY_BASIS);
    options.SetPatchPrecision<double>();
    refiner->RefineAdaptive(options.GetRefineAdaptiveOptions());
    osd->table.reset(Far::PatchTableFactory::Create(*refiner, options));
    if (!osd->table) return refused(err);
    osd->map.reset(new Far::PatchMap(*osd->table));

    size_t refined = (size_t)refiner->GetNumVerticesTotal();
    osd->points.resize(refined + (size_t)osd->table->GetNumLocalPoints());
    for (size_t v = 0; v < mesh->n_vertices; ++v)
        std::memcpy(osd->points[v].p, positions + 3 * v, sizeof osd->points[v].p);
    Far::PrimvarRefinerReal<double> primvar(*refiner);
    Point *from = osd->points.data();
    for (int level = 1; level <= refiner->GetMaxLevel(); ++level) {
        Point *to = from + refiner->GetLevel(level - 1).GetNumVertices();
        primvar.Interpolate(level, from, to);
        from = to;
    }
    if (osd->table->GetNumLocalPoints() > 0)
        osd->table->GetLocalPointStencilTable<double>()->UpdateValues(osd->points.data(),
                                                                      osd->points.data() + refined);
    return QP_OK;
}

void evaluate(const qp_osd *osd, uint32_t patch, double u, double v, qp_osd_sample *out) {
    std::memset(out, 0, sizeof *out);
    const Far::PatchMap::Handle *handle = osd->map->FindPatch((int)patch, u, v);
    if (!handle) {
        out->missing = true;
        return;
    }
    Far::PatchDescriptor::Type type = osd->table->GetPatchDescriptor(*handle).GetType();
    out->end_cap = type != Far::PatchDescriptor::REGULAR;
    double w[20], wu[20], wv[20];
    osd->table->EvaluateBasis(*handle, u, v, w, wu, wv);
    Far::ConstIndexArray indices = osd->table->GetPatchVertices(*handle);
    for (int i = 0; i < indices.size(); ++i) {
        const double *p = osd->points[(size_t)indices[i]].p;
        for (int c = 0; c < 3; ++c) {
            out->p[c] += w[i] * p[c];
            out->du[c] += wu[i] * p[c];
            out->dv[c] += wv[i] * p[c];
        }
    }
}

} // namespace

extern "C" qp_status qp_osd_create(const qp_mesh *mesh, const double *positions, unsigned depth, qp_osd **osd,
                                   qp_error *err) {
    *osd = nullptr;
    if (depth < 1 || depth > 10)
        return qp_fail(err, QP_BAD_INPUT, "OpenSubdiv refines to levels 1 to 10, not %u", depth);
    return guarded(err, [&]() {
        std::unique_ptr<qp_osd> made(new qp_osd);
        qp_status status = fill(made.get(), mesh, positions, depth, err);
        if (status == QP_OK) *osd = made.release();
        return status;
    });
}

extern "C" void qp_osd_free(qp_osd *osd) {
    delete osd;
}

extern "C" qp_status qp_osd_eval(const qp_osd *osd, uint32_t patch, size_t count, const double *uv,
                                 qp_osd_sample *samples, qp_error *err) {
    return guarded(err, [&]() {
        for (size_t i = 0; i < count; ++i) evaluate(osd, patch, uv[2 * i], uv[2 * i + 1], &samples[i]);
        return QP_OK;
    });
}

extern "C" qp_status qp_osd_time_setup(const qp_mesh *mesh, unsigned level, double *refine_ms,
                                       double *patch_ms, double *stencil_ms, qp_error *err) {
    if (level < 1 || level > 10)
        return qp_fail(err, QP_BAD_INPUT, "OpenSubdiv refines to levels 1 to 10, not %u", level);
    return guarded(err, [&]() {
        std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(mesh);
        if (!refiner) return refused(err);
        Far::PatchTableFactory::Options options(level);
        options.useInfSharpPatch = true;
        options.generateVaryingTables = false;
        options.SetEndCapType(Far::PatchTableFactory::Options::ENDCAP_BSPLINE_BASIS);
        double start = qp_now_ms();
        refiner->RefineAdaptive(options.GetRefineAdaptiveOptions());
        double refined = qp_now_ms();
        std::unique_ptr<Far::PatchTable> table(Far::PatchTableFactory::Create(*refiner, options));
        double tabled = qp_now_ms();
        Far::StencilTableFactory::Options stencil_options;
        stencil_options.generateIntermediateLevels = true;
        stencil_options.generateOffsets = true;
        std::unique_ptr<const Far::StencilTable> stencils(
            Far::StencilTableFactory::Create(*refiner, stencil_options));
        if (table && stencils && table->GetLocalPointStencilTable())
            stencils.reset(Far::StencilTableFactory::AppendLocalPointStencilTable(
                *refiner, stencils.get(), table->GetLocalPointStencilTable()));
        double done = qp_now_ms();
        if (!table || !stencils) return refused(err);
        *refine_ms = refined - start;
        *patch_ms = tabled - refined;
        *stencil_ms = done - tabled;
        return QP_OK;
    });
}

qp_status qp_osd_base_tags(const qp_mesh *mesh, qp_osd_tags *tags, qp_error *err) {
    return guarded(err, [&]() -> qp_status {
        std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(mesh);
        if (!refiner) return refused(err);
        const Far::TopologyLevel level = refiner->GetLevel(0);
        tags->n_edges = (uint32_t)level.GetNumEdges();
        for (uint32_t i = 0; i < mesh->n_edges; ++i) {
            const uint32_t *v = mesh->edge_vertices + 2 * (size_t)i;
            const int e = level.FindEdge((int)v[0], (int)v[1]);
            if (e < 0) return qp_fail(err, QP_CHECK_FAILED, "OpenSubdiv has no edge %u %u", v[0], v[1]);
            tags->edge_sharpness[i] = level.GetEdgeSharpness(e);
            tags->edge_flags[i] = (uint8_t)((level.IsEdgeBoundary(e) ? QP_EDGE_BOUNDARY : 0) |
                                            (level.IsEdgeNonManifold(e) ? QP_EDGE_NONMANIFOLD : 0));
        }
        for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
            tags->vertex_sharpness[v] = level.GetVertexSharpness((int)v);
            tags->vertex_flags[v] =
                (uint8_t)((level.IsVertexBoundary((int)v) ? QP_VERTEX_BOUNDARY : 0) |
                          (level.IsVertexNonManifold((int)v) ? QP_VERTEX_NONMANIFOLD : 0));
        }
        for (uint32_t f = 0; f < mesh->n_faces; ++f) {
            tags->face_flags[f] = level.IsFaceHole((int)f) ? QP_FACE_HOLE : 0;
        }
        return QP_OK;
    });
}
