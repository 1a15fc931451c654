/* The check of watertight.h: every sample on a perimeter is named by what it lies on, in terms of the base mesh (a vertex; the edge
 * between two vertices and a place along it, from the lower vertex, in units of 2^-25; the spoke of an n-gon, likewise; an n-gon's
 * centre). Sorted by name, equal places stand side by side.
 *
 * A quad's edge carries places t; a half edge of an n-gon's child t / 2 or 1/2 + t / 2. As (u,v) are multiples of 2^-17 these are whole
 * numbers of units. */
#include "host/reference/watertight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define UNITS (1u << 25) /* along an edge or a spoke */

typedef struct place {
    uint64_t
        entity; /* of an edge its two vertices, high word the lower; of a vertex, it twice; spoke, centre: face and edge */
    uint32_t at;   /* along it */
    uint32_t kind; /* VERTEX .. CENTRE */
    uint32_t side; /* samples that must have a normal in common have equal sides; NO_NORMAL: none has */
    uint32_t face; /* whose sample it is; of a spoke, the patch */
    uint64_t sample;
} place;

enum { EDGE, SPOKE, VERTEX, CENTRE };
#define NO_NORMAL QP_NONE

typedef struct checker {
    const qp_mesh *mesh;
    const qp_stream *stream;
    uint32_t *patch_face; /* [n_patches] */
    uint32_t *sector;     /* [n_corners] a forest; its roots name sectors */
    uint32_t *sharp;      /* [n_vertices] infinitely sharp edges */
    uint8_t *seen;        /* [n_faces] has samples */
    place *places;
    size_t count, capacity;
} checker;

static bool is_sharp(const qp_mesh *mesh, uint32_t edge) {
    return mesh->edge_sharpness[edge] >= QP_SHARPNESS_INFINITE;
}

static uint32_t root_of(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Corners of faces that meet at a vertex across an edge that is not sharp see the same tangent plane there, if any. */
static void join_sectors(checker *c) {
    const qp_mesh *mesh = c->mesh;
    for (uint32_t h = 0; h < mesh->n_corners; ++h) c->sector[h] = h;
    for (uint32_t e = 0; e < mesh->n_edges; ++e) {
        c->sharp[mesh->edge_vertices[2 * (size_t)e]] += is_sharp(mesh, e);
        c->sharp[mesh->edge_vertices[2 * (size_t)e + 1]] += is_sharp(mesh, e);
    }
    for (uint32_t h = 0; h < mesh->n_corners; ++h) {
        const uint32_t twin = mesh->corner_twin[h];
        if (twin == QP_NONE || is_sharp(mesh, mesh->corner_edge[h])) continue;
        /* h runs from a to b, its twin from b to a. */
        c->sector[root_of(c->sector, h)] = root_of(c->sector, qp_corner_next(mesh, twin));
        c->sector[root_of(c->sector, qp_corner_next(mesh, h))] = root_of(c->sector, twin);
    }
}

static bool add_place(checker *c, place p) {
    if (!qp_grow((void **)&c->places, &c->capacity, c->count + 1, sizeof *c->places)) return false;
    c->places[c->count++] = p;
    return true;
}

/* A sample on the edge that starts at corner h, `along` units from there, or at one of its ends. */
static bool add_on_edge(checker *c, uint32_t h, uint32_t along, uint64_t sample) {
    const qp_mesh *mesh = c->mesh;
    const uint32_t next = qp_corner_next(mesh, h), face = mesh->corner_face[h];
    if (along == 0 || along == UNITS) {
        const uint32_t corner = along == 0 ? h : next, vertex = mesh->face_vertices[corner];
        const bool plane = mesh->vertex_sharpness[vertex] < QP_SHARPNESS_INFINITE && c->sharp[vertex] <= 2;
        return add_place(c, (place){(uint64_t)vertex << 32 | vertex, 0, VERTEX,
                                    plane ? root_of(c->sector, corner) : NO_NORMAL, face, sample});
    }
    const uint32_t a = mesh->face_vertices[h], b = mesh->face_vertices[next];
    /* Across a sharp edge, the children of one n-gon still have a normal in common in its middle, and so have the parts of a quad. */
    const uint32_t side = is_sharp(mesh, mesh->corner_edge[h]) ? face : 0;
    return add_place(c, a < b ? (place){(uint64_t)a << 32 | b, along, EDGE, side, face, sample}
                              : (place){(uint64_t)b << 32 | a, UNITS - along, EDGE, side, face, sample});
}

/* Sample at (u,v) of a child of an n-gon. */
static bool add_of_child(checker *c, uint32_t face, uint32_t child, uint32_t u, uint32_t v, uint64_t sample) {
    const qp_mesh *mesh = c->mesh;
    const uint32_t size = qp_face_size(mesh, face), first = mesh->face_offsets[face];
    const uint32_t before = first + (child + size - 1) % size;
    const uint32_t patch = mesh->patch_offsets[face] + child;
    if (u == UNITS && v == UNITS) return add_place(c, (place){face, 0, CENTRE, 0, patch, sample});
    if (v == 0) return add_on_edge(c, first + child, u / 2, sample);
    if (u == 0) return add_on_edge(c, before, UNITS - v / 2, sample);
    /* Spokes are named by the corner that their edge starts at; from there to the centre. */
    if (u == UNITS) return add_place(c, (place){first + child, v, SPOKE, 0, patch, sample});
    return add_place(c, (place){before, u, SPOKE, 0, patch, sample});
}

static bool add_of_quad(checker *c, uint32_t face, uint32_t u, uint32_t v, uint64_t sample) {
    const uint32_t first = c->mesh->face_offsets[face];
    if (v == 0) return add_on_edge(c, first, u, sample);
    if (u == UNITS) return add_on_edge(c, first + 1, v, sample);
    if (v == UNITS) return add_on_edge(c, first + 2, UNITS - u, sample);
    return add_on_edge(c, first + 3, UNITS - v, sample);
}

static qp_status collect(checker *c, qp_error *err) {
    const qp_stream *s = c->stream;
    for (uint64_t i = 0; i < s->n_samples; ++i) {
        const uint32_t patch = s->sample_patch[i];
        const float u = s->uv[2 * i], v = s->uv[2 * i + 1];
        if (patch >= c->mesh->n_patches || !(u >= 0 && u <= 1 && v >= 0 && v <= 1))
            return qp_fail(err, QP_BAD_INPUT, "sample %llu is none of this mesh", (unsigned long long)i);
        const uint32_t face = c->patch_face[patch], child = patch - c->mesh->patch_offsets[face];
        c->seen[face] = 1;
        if (u != 0 && u != 1 && v != 0 && v != 1) continue;
        const uint32_t x = (uint32_t)(u * (float)UNITS), y = (uint32_t)(v * (float)UNITS);
        if ((float)x != u * (float)UNITS || (float)y != v * (float)UNITS || x % 2 != 0 || y % 2 != 0)
            return qp_fail(err, QP_BAD_INPUT, "sample %llu is none of a tessellation", (unsigned long long)i);
        if (!(qp_face_size(c->mesh, face) == 4 ? add_of_quad(c, face, x, y, i)
                                               : add_of_child(c, face, child, x, y, i)))
            return qp_fail_memory(err, c->count * sizeof *c->places, "samples on edges");
    }
    return QP_OK;
}

static int compare(uint64_t a, uint64_t b) {
    return (a > b) - (a < b);
}
static int by_place(const void *a, const void *b) {
    const place *x = a, *y = b;
    int order = compare(x->kind, y->kind);
    if (order == 0) order = compare(x->entity, y->entity);
    if (order == 0) order = compare(x->at, y->at);
    if (order == 0) order = compare(x->side, y->side);
    if (order == 0) order = compare(x->face, y->face);
    return order != 0 ? order : compare(x->sample, y->sample);
}

/* ---- Comparison of sorted places ---- */

static double coordinate(const qp_stream *s, uint64_t sample, int k) {
    const size_t at = 6 * (size_t)sample + (size_t)k;
    return s->precision == QP_DOUBLE ? ((const double *)s->vertices)[at]
                                     : (double)((const float *)s->vertices)[at];
}

/* Largest difference of two positions, in units in the last place of their largest coordinate. Infinite where one is not finite. */
static double ulp_distance(const qp_stream *s, uint64_t a, uint64_t b) {
    double most = 0, apart = 0;
    for (int k = 0; k < 3; ++k) {
        const double x = coordinate(s, a, k), y = coordinate(s, b, k);
        if (!isfinite(x) || !isfinite(y)) return INFINITY;
        most = fmax(most, fmax(fabs(x), fabs(y)));
        apart = fmax(apart, fabs(x - y));
    }
    if (apart == 0) return 0;
    return ldexp(apart, (s->precision == QP_DOUBLE ? 52 : 23) - ilogb(most));
}

static bool same_bits(const qp_stream *s, uint64_t a, uint64_t b, size_t part) {
    const size_t bytes = 3 * (s->precision == QP_DOUBLE ? sizeof(double) : sizeof(float));
    const char *v = s->vertices;
    return memcmp(v + (2 * a + part) * bytes, v + (2 * b + part) * bytes, bytes) == 0;
}

static void note(const checker *c, uint64_t sample, qp_watertight_report *r) {
    if (r->worst_patch != QP_NONE) return;
    r->worst_patch = c->stream->sample_patch[sample];
    r->worst_u = c->stream->uv[2 * sample];
    r->worst_v = c->stream->uv[2 * sample + 1];
}

/* All samples at one place. Returns how many faces (or patches, on spokes) they are of. */
static uint32_t compare_group(const checker *c, const place *p, size_t count, qp_watertight_report *r) {
    const qp_stream *s = c->stream;
    uint32_t faces = 0;
    for (size_t i = 0, side = 0; i < count; ++i) {
        if (p[i].side != p[side].side) side = i;
        faces += i == side ||
                 p[i].face != p[i - 1].face; /* faces are sorted within a side, and no face is on two */
        if (!same_bits(s, p[0].sample, p[i].sample, 0)) {
            ++r->position_mismatches;
            r->worst_ulp = fmax(r->worst_ulp, ulp_distance(s, p[0].sample, p[i].sample));
            note(c, p[i].sample, r);
        }
        const uint8_t none = (s->flags[p[side].sample] ^ s->flags[p[i].sample]) & QP_SAMPLE_NO_NORMAL;
        if (p[i].side != NO_NORMAL && (none != 0 || !same_bits(s, p[side].sample, p[i].sample, 1))) {
            ++r->normal_mismatches;
            note(c, p[i].sample, r);
        }
    }
    return faces;
}

/* Faces at each edge that have samples, in the order of the edges' names. */
typedef struct edge_name {
    uint64_t name;
    uint32_t faces, sharp;
} edge_name;

static int by_name(const void *a, const void *b) {
    return compare(((const edge_name *)a)->name, ((const edge_name *)b)->name);
}

static edge_name *name_edges(const checker *c) {
    const qp_mesh *mesh = c->mesh;
    edge_name *names = qp_alloc(mesh->n_edges, sizeof *names, true);
    if (names == NULL) return NULL;
    for (uint32_t e = 0; e < mesh->n_edges; ++e) {
        const uint32_t *v = mesh->edge_vertices + 2 * (size_t)e;
        names[e] = (edge_name){(uint64_t)v[0] << 32 | v[1], 0, is_sharp(mesh, e)};
    }
    for (uint32_t h = 0; h < mesh->n_corners; ++h)
        names[mesh->corner_edge[h]].faces += c->seen[mesh->corner_face[h]];
    qsort(names, mesh->n_edges, sizeof *names, by_name);
    return names;
}

static qp_status compare_all(const checker *c, qp_watertight_report *r, qp_error *err) {
    const qp_mesh *mesh = c->mesh;
    edge_name *names = name_edges(c);
    if (names == NULL) return qp_fail_memory(err, mesh->n_edges * sizeof *names, "edges");
    for (uint32_t e = 0; e < mesh->n_edges; ++e) {
        r->edges += names[e].faces >= 2;
        r->sharp_edges_skipped += names[e].faces >= 2 && names[e].sharp;
    }
    for (uint32_t f = 0; f < mesh->n_faces; ++f)
        if (c->seen[f] && qp_face_size(mesh, f) != 4) r->edges += qp_face_size(mesh, f);
    const edge_name *name = names;
    for (size_t i = 0, end; i < c->count; i = end) {
        for (end = i + 1; end < c->count && c->places[end].kind == c->places[i].kind &&
                          c->places[end].entity == c->places[i].entity &&
                          c->places[end].at == c->places[i].at;)
            ++end;
        const uint32_t faces = compare_group(c, c->places + i, end - i, r);
        uint32_t expected = 0; /* at vertices and centres nobody can be missing */
        if (c->places[i].kind == SPOKE) expected = 2;
        if (c->places[i].kind == EDGE) {
            while (name->name < c->places[i].entity) ++name; /* both are sorted, and every edge is there */
            expected = name->faces;
        }
        if (faces < expected) {
            r->unmatched_samples += end - i;
            note(c, c->places[i].sample, r);
        }
    }
    free(names);
    return QP_OK;
}

qp_status qp_watertight_check(const qp_mesh *mesh, const qp_stream *stream, qp_watertight_report *report,
                              qp_error *err) {
    checker c = {.mesh = mesh, .stream = stream};
    *report = (qp_watertight_report){.worst_patch = QP_NONE};
    c.patch_face = qp_alloc(mesh->n_patches, sizeof *c.patch_face, false);
    c.sector = qp_alloc(mesh->n_corners, sizeof *c.sector, false);
    c.sharp = qp_alloc(mesh->n_vertices, sizeof *c.sharp, true);
    c.seen = qp_alloc(mesh->n_faces, 1, true);
    qp_status status = QP_OK;
    if (c.patch_face == NULL || c.sector == NULL || c.sharp == NULL || c.seen == NULL) {
        status = qp_fail_memory(err, mesh->n_corners * sizeof *c.sector, "samples on edges");
    } else {
        for (uint32_t f = 0; f < mesh->n_faces; ++f)
            for (uint32_t p = mesh->patch_offsets[f]; p < mesh->patch_offsets[f + 1]; ++p)
                c.patch_face[p] = f;
        join_sectors(&c);
        status = collect(&c, err);
    }
    if (status == QP_OK) {
        if (c.count > 1) qsort(c.places, c.count, sizeof *c.places, by_place);
        report->samples = c.count;
        status = compare_all(&c, report, err);
    }
    free(c.patch_face);
    free(c.sector);
    free(c.sharp);
    free(c.seen);
    free(c.places);
    return status;
}

bool qp_watertight_holds(const qp_watertight_report *report) {
    return report->position_mismatches == 0 && report->normal_mismatches == 0 &&
           report->unmatched_samples == 0;
}
