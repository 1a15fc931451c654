#include "host/peer/refiner.h"

#include <string>
#include <vector>

#include <opensubdiv/far/error.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

namespace {

/* The last thing OpenSubdiv said. */
thread_local std::string last_message;

void keep_message(Far::ErrorType, const char *message) {
    last_message = message;
}
void drop_warning(const char *) {
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

} // namespace

namespace qp_peer_osd {

void listen() {
    last_message.clear();
    Far::SetErrorCallback(keep_message);
    Far::SetWarningCallback(drop_warning);
}

qp_status refused(qp_error *err) {
    for (char &c : last_message)
        if (c == '\n') c = ' ';
    return qp_fail(err, QP_BAD_INPUT, "OpenSubdiv refuses the mesh: %s",
                   last_message.empty() ? "no reason given" : last_message.c_str());
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

} // namespace qp_peer_osd
