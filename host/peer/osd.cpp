#include "host/peer/osd.h"
#include "host/peer/refiner.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include <opensubdiv/far/patchMap.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/stencilTableFactory.h>

using namespace qp_peer_osd;

namespace {

/* Refined positions, level after level, from those of the base mesh; points has room for all. */
void interpolate(const Far::TopologyRefiner &refiner, const double *positions, std::vector<Point> &points) {
    for (size_t v = 0; v < (size_t)refiner.GetLevel(0).GetNumVertices(); ++v)
        std::memcpy(points[v].p, positions + 3 * v, sizeof points[v].p);
    Far::PrimvarRefinerReal<double> primvar(refiner);
    Point *from = points.data();
    for (int level = 1; level <= refiner.GetMaxLevel(); ++level) {
        Point *to = from + refiner.GetLevel(level - 1).GetNumVertices();
        primvar.Interpolate(level, from, to);
        from = to;
    }
}

/* The square of a patch that a refined face covers. */
struct Place {
    uint32_t patch;
    double u, v, size;
};

/* Places of a level's faces from those of its parents. A quad's children keep its orientation; children of
 * other faces start at their corner. */
std::vector<Place> child_places(const Far::TopologyLevel &parent, const Far::TopologyLevel &child,
                                const std::vector<Place> &places) {
    static const double offset[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    std::vector<Place> result((size_t)child.GetNumFaces());
    for (int f = 0; f < parent.GetNumFaces(); ++f) {
        Far::ConstIndexArray children = parent.GetFaceChildFaces(f);
        const Place &at = places[(size_t)f];
        for (int j = 0; j < children.size(); ++j) {
            Place &to = result[(size_t)children[j]];
            if (children.size() != 4) {
                to = {at.patch + (uint32_t)j, 0, 0, 1};
            } else {
                double half = at.size / 2;
                to = {at.patch, at.u + half * offset[j][0], at.v + half * offset[j][1], half};
            }
        }
    }
    return result;
}

/* What qp_osd_limit says about the rule at a vertex. */
void classify(const Far::TopologyLevel &level, int vertex, qp_osd_limit *limit) {
    Far::ConstIndexArray edges = level.GetVertexEdges(vertex);
    int faces = level.GetVertexFaces(vertex).size();
    auto semisharp = [](float s) { return s > 0 && s < QP_SHARPNESS_INFINITE; };
    Sdc::Crease::Rule rule = level.GetVertexRule(vertex);
    limit->settled = !semisharp(level.GetVertexSharpness(vertex)) && rule != Sdc::Crease::RULE_DART;
    for (int i = 0; i < edges.size(); ++i)
        limit->settled = limit->settled && !semisharp(level.GetEdgeSharpness(edges[i]));
    bool smooth = rule == Sdc::Crease::RULE_SMOOTH;
    bool boundary = faces + 1 == edges.size() && !level.IsVertexNonManifold(vertex);
    if (smooth && faces == 2) limit->settled = false;
    limit->has_normal =
        limit->settled && (smooth || (boundary && rule == Sdc::Crease::RULE_CREASE && faces == 2));
}

bool unit_normal(const Point &a, const Point &b, double n[3]) {
    for (int c = 0; c < 3; ++c)
        n[c] = a.p[(c + 1) % 3] * b.p[(c + 2) % 3] - a.p[(c + 2) % 3] * b.p[(c + 1) % 3];
    double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int c = 0; c < 3; ++c) n[c] = length > 0 ? n[c] / length : 0;
    return length > 0;
}

} // namespace

struct qp_osd {
    std::unique_ptr<Far::PatchTable> table;
    std::unique_ptr<Far::PatchMap> map;
    std::vector<Point> points; /* of all levels, then the end caps' own */
};

namespace {

qp_status uniform_limits(const qp_mesh *mesh, const double *positions, unsigned level,
                         std::vector<qp_osd_limit> &limits, qp_error *err) {
    std::unique_ptr<Far::TopologyRefiner> refiner = make_refiner(mesh);
    if (!refiner) return refused(err);
    Far::TopologyRefiner::UniformOptions options(level);
    options.fullTopologyInLastLevel = true;
    refiner->RefineUniform(options);
    std::vector<Point> points((size_t)refiner->GetNumVerticesTotal());
    interpolate(*refiner, positions, points);

    std::vector<Place> places(mesh->n_faces);
    for (uint32_t f = 0; f < mesh->n_faces; ++f) places[f] = {mesh->patch_offsets[f], 0, 0, 1};
    for (int l = 1; l <= (int)level; ++l)
        places = child_places(refiner->GetLevel(l - 1), refiner->GetLevel(l), places);

    const Far::TopologyLevel &last = refiner->GetLevel((int)level);
    size_t n = (size_t)last.GetNumVertices();
    std::vector<Point> at(n), t1(n), t2(n);
    Point *from = points.data() + (points.size() - n), *p = at.data(), *a = t1.data(), *b = t2.data();
    Far::PrimvarRefinerReal<double>(*refiner).Limit(from, p, a, b);
    static const double offset[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int f = 0; f < last.GetNumFaces(); ++f) {
        const Place &place = places[(size_t)f];
        Far::ConstIndexArray vertices = last.GetFaceVertices(f);
        for (int j = 0; j < 4 && !last.IsFaceHole(f); ++j) {
            size_t v = (size_t)vertices[j];
            qp_osd_limit limit = {};
            limit.patch = place.patch;
            limit.u = place.u + place.size * offset[j][0];
            limit.v = place.v + place.size * offset[j][1];
            std::memcpy(limit.p, at[v].p, sizeof limit.p);
            classify(last, vertices[j], &limit);
            limit.has_normal = unit_normal(t1[v], t2[v], limit.n) && limit.has_normal;
            limits.push_back(limit);
        }
    }
    return QP_OK;
}

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
    interpolate(*refiner, positions, osd->points);
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

extern "C" qp_status qp_osd_uniform_limits(const qp_mesh *mesh, const double *positions, unsigned level,
                                           qp_osd_limit **limits, size_t *count, qp_error *err) {
    *limits = nullptr;
    *count = 0;
    if (level < 1 || level > 8)
        return qp_fail(err, QP_BAD_INPUT, "uniform refinement is to levels 1 to 8, not %u", level);
    return guarded(err, [&]() {
        std::vector<qp_osd_limit> made;
        qp_status status = uniform_limits(mesh, positions, level, made, err);
        if (status != QP_OK) return status;
        *limits = static_cast<qp_osd_limit *>(qp_alloc(made.size(), sizeof(qp_osd_limit), false));
        if (!*limits) return qp_fail_memory(err, made.size() * sizeof(qp_osd_limit), "limits");
        if (!made.empty()) std::memcpy(*limits, made.data(), made.size() * sizeof(qp_osd_limit));
        *count = made.size();
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
