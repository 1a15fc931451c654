/* Who owns the samples that patches have in common. (How their bits travel: copies.c.)
 *
 * Equal bits. Every place on the perimeter of a patch belongs to one entity of the mesh: a vertex, an edge (of which an n-gon's
 * children hold halves), the centre or a spoke of an n-gon. The entity alone names an owner patch, and the place its coordinates in that
 * patch; so all patches that meet there take one and the same evaluation, whatever their plans, depths, rotations and numbers are, and
 * any two of them have the same bits. There is nothing to fix afterwards: no other evaluation of that place is ever seen.
 *
 * Exact maps. A coordinate goes from a patch to the owner by t -> t, 1 - t, 2t, or 2t - 1 and their mirror images. On the device, a
 * coordinate is its distance to the nearer end of [0,1] and a sign; 1 - t flips the sign, and 2t doubles the distance d or makes it
 * 1 - 2d with 2d in [1/2, 1], which is exact (Sterbenz). Halving could lose the last bit of a subnormal, and the middle 1 - d/2 of
 * digits beyond the precision; so where quads and n-gons meet, a child of the n-gon is the owner and coordinates only ever double.
 *
 * Normals. They are shared along edges below infinite sharpness, which excludes boundary and non-manifold ones. At a vertex, fans fall
 * into sectors between infinitely sharp edges. With at most two such edges and a vertex below infinite sharpness the surface has a
 * tangent plane in each sector (smooth or dart vertex: one sector; crease or boundary: two), and the sector's lowest corner owns its
 * normal. More edges or an infinite vertex make a corner, where every patch has its own. */
#include "host/frame/share.h"

#include <stdlib.h>

static bool is_sharp(const qp_mesh *mesh, uint32_t edge) {
    return mesh->edge_sharpness[edge] >= QP_SHARPNESS_INFINITE;
}
static bool has_surface(const qp_surface *surface, uint32_t face) {
    return surface->patch_plan[surface->mesh->patch_offsets[face]] != QP_NONE;
}

/* ---- Owners over the mesh ---- */

static void find_edge_owners(qp_share *share) {
    const qp_mesh *mesh = share->surface->mesh;
    for (uint32_t e = 0; e < mesh->n_edges; ++e) share->edge_owner[e] = QP_NONE;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        const uint32_t face = mesh->corner_face[h];
        uint32_t *owner = &share->edge_owner[mesh->corner_edge[h]];
        if (!has_surface(share->surface, face)) continue;
        if (*owner == QP_NONE ||
            (qp_face_size(mesh, face) != 4 && qp_face_size(mesh, mesh->corner_face[*owner]) == 4))
            *owner = h;
    }
}

/* Gives the whole sector of corner h the owner h. */
static void mark_sector(qp_share *share, uint32_t h) {
    const qp_mesh *mesh = share->surface->mesh;
    uint32_t c = h;
    share->corner_normal[h] = h;
    /* Counter-clockwise across the half-edge before the corner, then clockwise across its own; a closed sector ends where it began. */
    for (;;) {
        const uint32_t before = qp_corner_prev(mesh, c);
        if (is_sharp(mesh, mesh->corner_edge[before])) break;
        c = mesh->corner_twin[before];
        if (c == QP_NONE || share->corner_normal[c] == h) break;
        share->corner_normal[c] = h;
    }
    for (c = h; !is_sharp(mesh, mesh->corner_edge[c]);) {
        const uint32_t twin = mesh->corner_twin[c];
        if (twin == QP_NONE) break;
        c = qp_corner_next(mesh, twin);
        if (share->corner_normal[c] == h) break;
        share->corner_normal[c] = h;
    }
}

/* sharp: infinitely sharp edges at each vertex. */
static void find_vertex_owners(qp_share *share, const uint32_t *sharp) {
    const qp_mesh *mesh = share->surface->mesh;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) share->corner_normal[h] = QP_NONE;
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        const bool plane = mesh->vertex_sharpness[v] < QP_SHARPNESS_INFINITE && sharp[v] <= 2;
        share->vertex_owner[v] = QP_NONE;
        for (uint32_t i = mesh->vertex_offsets[v]; i < mesh->vertex_offsets[v + 1]; ++i) {
            const uint32_t h = mesh->vertex_corners[i];
            if (!has_surface(share->surface, mesh->corner_face[h])) continue;
            if (share->vertex_owner[v] == QP_NONE) share->vertex_owner[v] = h;
            if (plane && share->corner_normal[h] == QP_NONE) mark_sector(share, h);
        }
    }
}

qp_status qp_share_create(const qp_surface *surface, qp_share **made, qp_error *err) {
    const qp_mesh *mesh = surface->mesh;
    *made = NULL;
    qp_share *share = qp_alloc(1, sizeof *share, true);
    uint32_t *sharp = qp_alloc(mesh->n_vertices, sizeof *sharp, true);
    if (share != NULL) {
        share->surface = surface;
        share->edge_owner = qp_alloc(mesh->n_edges, sizeof(uint32_t), false);
        share->vertex_owner = qp_alloc(mesh->n_vertices, sizeof(uint32_t), false);
        share->corner_normal = qp_alloc(mesh->n_corners, sizeof(uint32_t), false);
    }
    if (share == NULL || sharp == NULL || share->edge_owner == NULL || share->vertex_owner == NULL ||
        share->corner_normal == NULL) {
        free(sharp);
        qp_share_free(share);
        return qp_fail_memory(err, mesh->n_corners * (size_t)8, "the owners of edges");
    }
    for (size_t i = 0; i < 2 * (size_t)mesh->n_edges; ++i)
        sharp[mesh->edge_vertices[i]] += is_sharp(mesh, (uint32_t)(i / 2));
    find_edge_owners(share);
    find_vertex_owners(share, sharp);
    free(sharp);
    *made = share;
    return QP_OK;
}

void qp_share_free(qp_share *share) {
    if (share == NULL) return;
    free(share->edge_owner);
    free(share->vertex_owner);
    free(share->corner_normal);
    free(share);
}

/* ---- Owners as patches ---- */

/* Corner of a patch that lies at a corner of the mesh. */
static qp_side side_at_corner(const qp_mesh *mesh, uint32_t h) {
    const uint32_t face = mesh->corner_face[h], i = h - mesh->face_offsets[face];
    const uint32_t first = mesh->patch_offsets[face];
    return qp_face_size(mesh, face) == 4 ? (qp_side){first, i} : (qp_side){first + i, 0};
}

/* The edge of a child from the middle of an edge to its end, given the child that holds its start. */
static qp_side second_half(const qp_mesh *mesh, uint32_t h) {
    return (qp_side){side_at_corner(mesh, qp_corner_next(mesh, h)).patch, 3};
}

/* Owner of a base edge (of half of it, for a child) that a patch has as part of half-edge h. half: 0 the first, 1 the second, 2 the
 * whole. */
static qp_edge_owner base_edge_owner(const qp_share *share, uint32_t h, uint32_t half) {
    const qp_mesh *mesh = share->surface->mesh;
    const uint32_t edge = mesh->corner_edge[h], o = share->edge_owner[edge];
    qp_edge_owner owner = {.own = o == h, .normal = !is_sharp(mesh, edge)};
    owner.reversed = mesh->face_vertices[o] != mesh->face_vertices[h];
    const qp_side start = side_at_corner(mesh, o);
    if (qp_face_size(mesh, mesh->corner_face[o]) == 4) {
        owner.side[0] = start; /* edge i of a quad starts at its corner i */
        return owner;
    }
    /* Edge 0 of the child at the start is the first half of half-edge o. */
    owner.split = half == 2;
    const uint32_t which = owner.reversed ? 1u - half : half;
    if (owner.split) {
        owner.side[0] = start;
        owner.side[1] = second_half(mesh, o);
    } else {
        owner.side[0] = which == 0 ? start : second_half(mesh, o);
    }
    return owner;
}

qp_edge_owner qp_share_edge(const qp_share *share, uint32_t face, uint32_t child, uint32_t edge) {
    const qp_mesh *mesh = share->surface->mesh;
    const uint32_t first = mesh->face_offsets[face], size = qp_face_size(mesh, face);
    const uint32_t patch = mesh->patch_offsets[face] + child;
    const uint32_t next = child + 1 == size ? 0 : child + 1, before = child == 0 ? size - 1 : child - 1;
    if (size == 4) return base_edge_owner(share, first + edge, 2);
    if (edge == 0) return base_edge_owner(share, first + child, 0);
    if (edge == 3) return base_edge_owner(share, first + before, 1);
    /* A spoke: edge 1 of one child and, the other way, edge 2 of the next. */
    const uint32_t other = edge == 1 ? next : before;
    qp_edge_owner owner = {.normal = true, .own = child < other, .reversed = true};
    owner.side[0] = (qp_side){patch - child + other, edge == 1 ? 2 : 1};
    if (owner.own) {
        owner.side[0] = (qp_side){patch, edge};
        owner.reversed = false;
    }
    return owner;
}

qp_corner_owner qp_share_corner(const qp_share *share, uint32_t face, uint32_t child, uint32_t corner) {
    const qp_mesh *mesh = share->surface->mesh;
    const uint32_t first = mesh->face_offsets[face], size = qp_face_size(mesh, face);
    const uint32_t patches = mesh->patch_offsets[face];
    if (size == 4 || corner == 0) { /* a vertex of the mesh */
        const uint32_t h = first + (size == 4 ? corner : child), n = share->corner_normal[h];
        return (qp_corner_owner){side_at_corner(mesh, share->vertex_owner[mesh->face_vertices[h]]),
                                 n == QP_NONE ? (qp_side){QP_NONE, 0} : side_at_corner(mesh, n)};
    }
    if (corner == 2) return (qp_corner_owner){{patches, 2}, {patches, 2}}; /* the centre */
    /* The middle of the edge that starts at child `at`: its corner 1, and the next one's corner 3. Both have a normal in common, also
     * where the edge is sharp. */
    const uint32_t at = corner == 1 ? child : child == 0 ? size - 1 : child - 1;
    const uint32_t edge = mesh->corner_edge[first + at];
    const qp_side middle = {side_at_corner(mesh, share->edge_owner[edge]).patch, 1}, here = {patches + at, 1};
    return (qp_corner_owner){middle, is_sharp(mesh, edge) ? here : middle};
}
