/* From faces and tags as given to adjacency and effective sharpness. Every step is linear in corners,
 * vertices and tags, whatever the valence: half-edges are bucketed by their lower vertex, and within a bucket
 * an array indexed by the upper vertex finds the edge.
 *
 * What "effective" means follows OpenSubdiv (Far::TopologyRefinerFactory), so that both mean the same
 * surface:
 * - an edge is non-manifold when it has more than two faces or two that run the same way along it;
 * - a vertex is non-manifold when it ends such an edge or when its faces form more than one fan;
 * - boundary and non-manifold edges are infinitely sharp;
 * - so is the vertex of a lone face under edge-and-corner, and any non-manifold vertex but one that an
 * interior non-manifold crease runs through (two such edges, no boundary, more faces than edges). */
#include "host/mesh/mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* "NAME:LINE: face F" or "NAME: face F". */
static const char *face_place(const qp_mesh *mesh, const char *name, uint32_t face, char *text, size_t size) {
    if (mesh->face_lines != NULL) {
        snprintf(text, size, "%.300s:%u: face %u", name, mesh->face_lines[face], face);
    } else {
        snprintf(text, size, "%.300s: face %u", name, face);
    }
    return text;
}

static qp_status check_faces(const qp_mesh *mesh, const char *name, qp_error *err) {
    char place[360];
    if (mesh->n_faces == 0) return qp_fail(err, QP_BAD_INPUT, "%.300s: the mesh has no faces", name);
    if (mesh->n_vertices > INT32_MAX || mesh->n_corners > INT32_MAX || mesh->n_creases > INT32_MAX) {
        return qp_fail(err, QP_BAD_INPUT, "%.300s: more than 2^31 - 1 vertices, face corners or creases",
                       name);
    }
    uint32_t *last_face = qp_alloc(mesh->n_vertices, sizeof *last_face, false);
    if (last_face == NULL) return qp_fail_memory(err, mesh->n_vertices * sizeof *last_face, "checking faces");
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) last_face[v] = QP_NONE;
    qp_status status = QP_OK;
    /* Vertices are named as their source numbers them: from 1 in a file. */
    uint32_t base = mesh->face_lines != NULL;
    for (uint32_t f = 0; f < mesh->n_faces && status == QP_OK; ++f) {
        if (qp_face_size(mesh, f) < 3) {
            status = qp_fail(err, QP_BAD_INPUT, "%s has fewer than 3 vertices",
                             face_place(mesh, name, f, place, sizeof place));
        }
        for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1] && status == QP_OK; ++c) {
            uint32_t v = mesh->face_vertices[c];
            if (v >= mesh->n_vertices) {
                status = qp_fail(err, QP_BAD_INPUT, "%s uses vertex %llu of %u",
                                 face_place(mesh, name, f, place, sizeof place), (unsigned long long)v + base,
                                 mesh->n_vertices);
            } else if (last_face[v] == f) {
                status = qp_fail(err, QP_BAD_INPUT, "%s uses vertex %u twice",
                                 face_place(mesh, name, f, place, sizeof place), v + base);
            } else {
                last_face[v] = f;
            }
        }
    }
    free(last_face);
    return status;
}

static qp_status check_sharpness(const float *sharpness, uint32_t count, const char *name, const char *what,
                                 qp_error *err) {
    for (uint32_t i = 0; i < count; ++i) {
        if (!(sharpness[i] >= 0)) {
            return qp_fail(err, QP_BAD_INPUT, "%.300s: %s %u has sharpness %g (must be 0 or more)", name,
                           what, i, (double)sharpness[i]);
        }
    }
    return QP_OK;
}

static qp_status check_index(const uint32_t *index, size_t count, uint32_t limit, const char *name,
                             const char *what, qp_error *err) {
    for (size_t i = 0; i < count; ++i) {
        if (index[i] >= limit) {
            return qp_fail(err, QP_BAD_INPUT, "%.300s: a %s tag names %u of %u", name, what, index[i], limit);
        }
    }
    return QP_OK;
}

static qp_status check_values(const qp_mesh *mesh, const char *name, qp_error *err) {
    for (size_t i = 0; i < (size_t)mesh->n_vertices * 3; ++i) {
        if (!(fabs(mesh->positions[i]) <= QP_COORDINATE_LIMIT)) {
            return qp_fail(err, QP_BAD_INPUT,
                           "%.300s: a coordinate of vertex %zu is %g (must be within 1e18)", name, i / 3,
                           mesh->positions[i]);
        }
    }
    if ((unsigned)mesh->boundary > QP_BOUNDARY_EDGE_ONLY ||
        (unsigned)mesh->crease_method > QP_CREASE_CHAIKIN ||
        (unsigned)mesh->triangle_rule > QP_TRIANGLE_SMOOTH) {
        return qp_fail(err, QP_BAD_INPUT, "%.300s: unknown boundary, crease or triangle rule", name);
    }
    qp_status status = check_sharpness(mesh->crease_sharpness, mesh->n_creases, name, "crease", err);
    if (status == QP_OK) {
        status = check_sharpness(mesh->corner_tag_sharpness, mesh->n_corner_tags, name, "corner", err);
    }
    if (status == QP_OK) {
        status = check_index(mesh->crease_vertices, (size_t)mesh->n_creases * 2, mesh->n_vertices, name,
                             "crease", err);
    }
    if (status == QP_OK) {
        status = check_index(mesh->corner_tag_vertices, mesh->n_corner_tags, mesh->n_vertices, name, "corner",
                             err);
    }
    if (status == QP_OK) {
        status = check_index(mesh->hole_tag_faces, mesh->n_hole_tags, mesh->n_faces, name, "hole", err);
    }
    return status;
}

/* ---- Corners, edges, twins ---- */

static bool build_corners(qp_mesh *mesh) {
    mesh->corner_face = qp_alloc(mesh->n_corners, sizeof(uint32_t), false);
    mesh->vertex_offsets = qp_alloc((size_t)mesh->n_vertices + 1, sizeof(uint32_t), true);
    mesh->vertex_corners = qp_alloc(mesh->n_corners, sizeof(uint32_t), false);
    mesh->patch_offsets = qp_alloc((size_t)mesh->n_faces + 1, sizeof(uint32_t), false);
    if (mesh->corner_face == NULL || mesh->vertex_offsets == NULL || mesh->vertex_corners == NULL ||
        mesh->patch_offsets == NULL) {
        return false;
    }
    uint32_t patches = 0;
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        uint32_t size = qp_face_size(mesh, f);
        mesh->patch_offsets[f] = patches;
        patches += size == 4 ? 1 : size;
        for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1]; ++c) mesh->corner_face[c] = f;
    }
    mesh->patch_offsets[mesh->n_faces] = mesh->n_patches = patches;
    /* Counting sort of corners by vertex: offsets[v] runs ahead while filling and ends as the start of v + 1.
     */
    uint32_t *offsets = mesh->vertex_offsets;
    for (uint32_t c = 0; c < mesh->n_corners; ++c) ++offsets[mesh->face_vertices[c]];
    uint32_t sum = 0;
    for (uint32_t v = 0; v <= mesh->n_vertices; ++v) {
        uint32_t count = offsets[v];
        offsets[v] = sum;
        sum += count;
    }
    for (uint32_t c = 0; c < mesh->n_corners; ++c) {
        mesh->vertex_corners[offsets[mesh->face_vertices[c]]++] = c;
    }
    memmove(offsets + 1, offsets, (size_t)mesh->n_vertices * sizeof *offsets);
    offsets[0] = 0;
    return true;
}

/* Working memory of build_edges. An *item* is a half-edge (a corner's number) or, after all of those, a
 * crease. */
typedef struct edge_work {
    uint32_t *bucket; /* [n_vertices + 1] first item of each lower vertex in order */
    uint32_t *order;  /* [items] by lower vertex, stable */
    uint32_t *stamp;  /* [n_vertices] the lower vertex whose bucket last met this upper vertex */
    uint32_t *slot;   /* [n_vertices] and the group it got then */
    uint32_t *group;  /* [items] items on one edge share a group; QP_NONE: a crease on no edge */
    uint32_t *number; /* [groups] edge of a group */
} edge_work;

static void free_edge_work(edge_work *w) {
    free(w->bucket);
    free(w->order);
    free(w->stamp);
    free(w->slot);
    free(w->group);
    free(w->number);
}

static void item_vertices(const qp_mesh *mesh, uint32_t item, uint32_t *low, uint32_t *high) {
    uint32_t a, b;
    if (item < mesh->n_corners) {
        a = mesh->face_vertices[item];
        b = mesh->face_vertices[qp_corner_next(mesh, item)];
    } else {
        a = mesh->crease_vertices[2 * (size_t)(item - mesh->n_corners)];
        b = mesh->crease_vertices[2 * (size_t)(item - mesh->n_corners) + 1];
    }
    *low = a < b ? a : b;
    *high = a < b ? b : a;
}

static uint32_t group_items(const qp_mesh *mesh, edge_work *w, uint32_t items) {
    uint32_t low, high, groups = 0, sum = 0;
    for (uint32_t i = 0; i < items; ++i) {
        item_vertices(mesh, i, &low, &high);
        ++w->bucket[low];
    }
    for (uint32_t v = 0; v <= mesh->n_vertices; ++v) {
        uint32_t count = w->bucket[v];
        w->bucket[v] = sum;
        sum += count;
    }
    for (uint32_t i = 0; i < items; ++i) {
        item_vertices(mesh, i, &low, &high);
        w->order[w->bucket[low]++] = i;
    }
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) w->stamp[v] = QP_NONE;
    for (uint32_t k = 0; k < items; ++k) {
        uint32_t i = w->order[k];
        item_vertices(mesh, i, &low, &high);
        if (w->stamp[high] != low) {
            if (i >= mesh->n_corners) { /* creases come last in a bucket: no half-edge joins these two */
                w->group[i] = QP_NONE;
                continue;
            }
            w->stamp[high] = low;
            w->slot[high] = groups++;
        }
        w->group[i] = w->slot[high];
    }
    return groups;
}

/* Numbers the edges by first appearance and fills everything about them but sharpness; crease_edge gets the
 * edge of every crease, or QP_NONE. */
static bool build_edges(qp_mesh *mesh, uint32_t *crease_edge) {
    uint32_t items = mesh->n_corners + mesh->n_creases;
    edge_work w = {.bucket = qp_alloc((size_t)mesh->n_vertices + 1, sizeof(uint32_t), true),
                   .order = qp_alloc(items, sizeof(uint32_t), false),
                   .stamp = qp_alloc(mesh->n_vertices, sizeof(uint32_t), false),
                   .slot = qp_alloc(mesh->n_vertices, sizeof(uint32_t), false),
                   .group = qp_alloc(items, sizeof(uint32_t), false)};
    uint32_t *first = NULL;
    bool good = false;
    if (w.bucket == NULL || w.order == NULL || w.stamp == NULL || w.slot == NULL || w.group == NULL)
        goto done;
    uint32_t edges = mesh->n_edges = group_items(mesh, &w, items);
    w.number = qp_alloc(edges, sizeof(uint32_t), false);
    first = qp_alloc(edges, sizeof(uint32_t), false);
    mesh->corner_edge = qp_alloc(mesh->n_corners, sizeof(uint32_t), false);
    mesh->corner_twin = qp_alloc(mesh->n_corners, sizeof(uint32_t), false);
    mesh->edge_vertices = qp_alloc((size_t)edges * 2, sizeof(uint32_t), false);
    mesh->edge_face_count = qp_alloc(edges, sizeof(uint32_t), true);
    mesh->edge_flags = qp_alloc(edges, sizeof(uint8_t), true);
    mesh->edge_sharpness = qp_alloc(edges, sizeof(float), true);
    if (w.number == NULL || first == NULL || mesh->corner_edge == NULL || mesh->corner_twin == NULL ||
        mesh->edge_vertices == NULL || mesh->edge_face_count == NULL || mesh->edge_flags == NULL ||
        mesh->edge_sharpness == NULL) {
        goto done;
    }
    for (uint32_t g = 0; g < edges; ++g) w.number[g] = QP_NONE;
    uint32_t known = 0;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        uint32_t *number = &w.number[w.group[h]];
        mesh->corner_twin[h] = QP_NONE;
        if (*number == QP_NONE) {
            *number = known++;
            item_vertices(mesh, h, &mesh->edge_vertices[2 * (size_t)*number],
                          &mesh->edge_vertices[2 * (size_t)*number + 1]);
        }
        uint32_t e = mesh->corner_edge[h] = *number;
        uint32_t faces = ++mesh->edge_face_count[e];
        if (faces == 1) {
            first[e] = h;
        } else if (faces == 2 && mesh->face_vertices[h] != mesh->face_vertices[first[e]]) {
            mesh->corner_twin[h] = first[e];
            mesh->corner_twin[first[e]] = h;
        } else {
            /* A third face, or a second one that runs the same way: undo a pairing already made. */
            mesh->edge_flags[e] |= QP_EDGE_NONMANIFOLD;
            uint32_t paired = mesh->corner_twin[first[e]];
            if (paired != QP_NONE) mesh->corner_twin[first[e]] = mesh->corner_twin[paired] = QP_NONE;
        }
    }
    for (uint32_t e = 0; e < edges; ++e) {
        if (mesh->edge_face_count[e] == 1) mesh->edge_flags[e] |= QP_EDGE_BOUNDARY;
    }
    for (uint32_t i = 0; i < mesh->n_creases; ++i) {
        uint32_t group = w.group[mesh->n_corners + i];
        crease_edge[i] = group == QP_NONE ? QP_NONE : w.number[group];
    }
    good = true;
done:
    free(first);
    free_edge_work(&w);
    return good;
}

/* ---- Vertices and effective tags ---- */

/* Corners in the fan of the vertex's first corner. Going counter-clockwise about a vertex leads from corner c
 * to the twin of the half-edge before c, clockwise to the corner after c's twin. */
static uint32_t fan_size(const qp_mesh *mesh, uint32_t vertex) {
    uint32_t start = mesh->vertex_corners[mesh->vertex_offsets[vertex]];
    uint32_t count = 1, c = start;
    while ((c = mesh->corner_twin[qp_corner_prev(mesh, c)]) != QP_NONE && c != start) ++count;
    if (c == start) return count;
    for (c = start; mesh->corner_twin[c] != QP_NONE; ++count) {
        c = qp_corner_next(mesh, mesh->corner_twin[c]);
    }
    return count;
}

typedef struct edge_counts {
    uint32_t edges, boundary, nonmanifold;
} edge_counts;

static void count_edges(const qp_mesh *mesh, edge_counts *counts) {
    for (size_t i = 0; i < (size_t)mesh->n_edges * 2; ++i) {
        edge_counts *at = &counts[mesh->edge_vertices[i]];
        ++at->edges;
        at->boundary += (mesh->edge_flags[i / 2] & QP_EDGE_BOUNDARY) != 0;
        at->nonmanifold += (mesh->edge_flags[i / 2] & QP_EDGE_NONMANIFOLD) != 0;
    }
}

static void flag_vertices(qp_mesh *mesh, const edge_counts *counts) {
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        uint32_t faces = mesh->vertex_offsets[v + 1] - mesh->vertex_offsets[v];
        uint8_t flags = 0;
        if (faces == 0) flags |= QP_VERTEX_UNUSED;
        if (counts[v].boundary > 0) flags |= QP_VERTEX_BOUNDARY;
        if (counts[v].nonmanifold > 0 || (faces > 0 && fan_size(mesh, v) != faces)) {
            flags |= QP_VERTEX_NONMANIFOLD;
        }
        mesh->vertex_flags[v] = flags;
    }
}

/* Holes as tagged; and, under boundary rule "none", the faces at every vertex with a boundary edge that was
 * not tagged infinitely sharp. Must run on edge sharpness as tagged. */
static void flag_holes(qp_mesh *mesh) {
    for (uint32_t i = 0; i < mesh->n_hole_tags; ++i)
        mesh->face_flags[mesh->hole_tag_faces[i]] |= QP_FACE_HOLE;
    if (mesh->boundary != QP_BOUNDARY_NONE) return;
    for (uint32_t e = 0; e < mesh->n_edges; ++e) {
        if (!(mesh->edge_flags[e] & QP_EDGE_BOUNDARY) || mesh->edge_sharpness[e] >= QP_SHARPNESS_INFINITE)
            continue;
        /* A bit of its own, so that a vertex of high valence is walked once only. */
        mesh->vertex_flags[mesh->edge_vertices[2 * (size_t)e]] |= 0x80;
        mesh->vertex_flags[mesh->edge_vertices[2 * (size_t)e + 1]] |= 0x80;
    }
    for (uint32_t c = 0; c < mesh->n_corners; ++c) {
        if (mesh->vertex_flags[mesh->face_vertices[c]] & 0x80)
            mesh->face_flags[mesh->corner_face[c]] |= QP_FACE_HOLE;
    }
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) mesh->vertex_flags[v] &= 0x7f;
}

static float clamp_sharpness(float s) {
    return s > QP_SHARPNESS_INFINITE ? QP_SHARPNESS_INFINITE : s;
}

static void sharpen(qp_mesh *mesh, const edge_counts *counts) {
    for (uint32_t e = 0; e < mesh->n_edges; ++e) {
        if (mesh->edge_flags[e] != 0) mesh->edge_sharpness[e] = QP_SHARPNESS_INFINITE;
    }
    for (uint32_t i = 0; i < mesh->n_corner_tags; ++i) {
        mesh->vertex_sharpness[mesh->corner_tag_vertices[i]] = clamp_sharpness(mesh->corner_tag_sharpness[i]);
    }
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        uint32_t faces = mesh->vertex_offsets[v + 1] - mesh->vertex_offsets[v];
        edge_counts n = counts[v];
        bool lone = faces == 1 && n.edges == 2 && mesh->boundary == QP_BOUNDARY_EDGE_AND_CORNER;
        bool through = n.nonmanifold == 2 && n.boundary == 0 && faces > n.edges;
        if (lone || ((mesh->vertex_flags[v] & QP_VERTEX_NONMANIFOLD) && !through)) {
            mesh->vertex_sharpness[v] = QP_SHARPNESS_INFINITE;
        }
    }
}

static qp_status build_vertices(qp_mesh *mesh, qp_error *err) {
    edge_counts *counts = qp_alloc(mesh->n_vertices, sizeof *counts, true);
    mesh->vertex_flags = qp_alloc(mesh->n_vertices, sizeof(uint8_t), true);
    mesh->vertex_sharpness = qp_alloc(mesh->n_vertices, sizeof(float), true);
    mesh->face_flags = qp_alloc(mesh->n_faces, sizeof(uint8_t), true);
    bool good = counts != NULL && mesh->vertex_flags != NULL && mesh->vertex_sharpness != NULL &&
                mesh->face_flags != NULL;
    if (good) {
        count_edges(mesh, counts);
        flag_vertices(mesh, counts);
        flag_holes(mesh);
        sharpen(mesh, counts);
    }
    free(counts);
    return good ? QP_OK : qp_fail_memory(err, mesh->n_vertices * sizeof *counts, "vertices of the mesh");
}

/* Sets sharpness as tagged (a later crease on the same edge wins) and drops creases on no edge. */
static void apply_creases(qp_mesh *mesh, const uint32_t *crease_edge, const char *name,
                          const qp_mesh_options *options) {
    uint32_t kept = 0, missing[2] = {0, 0}, dropped = 0;
    for (uint32_t i = 0; i < mesh->n_creases; ++i) {
        uint32_t a = mesh->crease_vertices[2 * (size_t)i], b = mesh->crease_vertices[2 * (size_t)i + 1];
        if (crease_edge[i] == QP_NONE) {
            if (dropped++ == 0) {
                missing[0] = a;
                missing[1] = b;
            }
            continue;
        }
        mesh->edge_sharpness[crease_edge[i]] = clamp_sharpness(mesh->crease_sharpness[i]);
        mesh->crease_vertices[2 * (size_t)kept] = a;
        mesh->crease_vertices[2 * (size_t)kept + 1] = b;
        mesh->crease_sharpness[kept++] = mesh->crease_sharpness[i];
    }
    mesh->n_creases = kept;
    if (dropped == 0 || options == NULL || options->warn == NULL) return;
    char line[480];
    snprintf(line, sizeof line,
             "%.300s: %u crease%s on edges that the mesh does not have ignored (first: %u %u)", name, dropped,
             dropped == 1 ? "" : "s", missing[0], missing[1]);
    options->warn(options->warn_context, line);
}

/* Bounding box of the vertices that faces use. */
static void measure_box(qp_mesh *mesh) {
    for (int k = 0; k < 3; ++k) {
        mesh->box_min[k] = INFINITY;
        mesh->box_max[k] = -INFINITY;
    }
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        if (mesh->vertex_flags[v] & QP_VERTEX_UNUSED) continue;
        for (int k = 0; k < 3; ++k) {
            double x = mesh->positions[3 * (size_t)v + (size_t)k];
            if (x < mesh->box_min[k]) mesh->box_min[k] = x;
            if (x > mesh->box_max[k]) mesh->box_max[k] = x;
        }
    }
    double square = 0;
    for (int k = 0; k < 3; ++k) {
        double extent = mesh->box_max[k] - mesh->box_min[k];
        square += extent * extent;
    }
    mesh->diagonal = square > 0 ? sqrt(square) : 1;
}

qp_status qp_mesh_analyse(qp_mesh *mesh, const char *name, const qp_mesh_options *options, qp_error *err) {
    if (options != NULL) {
        if (options->override_boundary) mesh->boundary = options->boundary;
        if (options->override_crease_method) mesh->crease_method = options->crease_method;
        if (options->override_triangle_rule) mesh->triangle_rule = options->triangle_rule;
    }
    qp_status status = check_faces(mesh, name, err);
    if (status == QP_OK) status = check_values(mesh, name, err);
    if (status != QP_OK) return status;
    uint32_t *crease_edge = qp_alloc(mesh->n_creases, sizeof *crease_edge, false);
    if (crease_edge == NULL || !build_corners(mesh) || !build_edges(mesh, crease_edge)) {
        free(crease_edge);
        return qp_fail_memory(err, mesh->n_corners * (size_t)32, "the adjacency of the mesh");
    }
    apply_creases(mesh, crease_edge, name, options);
    free(crease_edge);
    status = build_vertices(mesh, err);
    if (status == QP_OK) measure_box(mesh);
    return status;
}
