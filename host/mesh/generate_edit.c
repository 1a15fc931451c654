/* Random topological edits of a manifold mesh. Each edit writes the faces that change into a builder; the
 * result is then analysed like any other mesh and thrown away unless it is manifold, so that no edit needs
 * conditions of its own beyond those that keep it meaningful. */
#include "host/mesh/generate.h"

#include <stdlib.h>

/* Largest face and largest valence that edits work on. */
enum { POLYGON = 24 };

void generate_copy(mesh_builder *b, const qp_mesh *mesh, const uint8_t *drop) {
    for (uint32_t v = 0; v < mesh->n_vertices; ++v) {
        const double *p = mesh->positions + 3 * (size_t)v;
        builder_vertex(b, p[0], p[1], p[2]);
    }
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        if (drop != NULL && drop[f]) continue;
        builder_face(b, qp_face_size(mesh, f), mesh->face_vertices + mesh->face_offsets[f]);
    }
}

void generate_face_center(const qp_mesh *mesh, uint32_t face, double center[3]) {
    const uint32_t size = qp_face_size(mesh, face);
    center[0] = center[1] = center[2] = 0;
    for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; ++c) {
        for (int k = 0; k < 3; ++k)
            center[k] += mesh->positions[3 * (size_t)mesh->face_vertices[c] + (size_t)k];
    }
    for (int k = 0; k < 3; ++k) center[k] /= size;
}

/* One edit under way. */
typedef struct edit {
    const qp_mesh *mesh;
    qp_random *random;
    mesh_builder out;
    uint8_t *drop; /* [n_faces] faces that the edit replaces */
} edit;

/* Copies what stays. Called once the dropped faces are known and before anything is added. */
static void copy_rest(edit *e) {
    generate_copy(&e->out, e->mesh, e->drop);
}

static const double *position(const edit *e, uint32_t vertex) {
    return e->mesh->positions + 3 * (size_t)vertex;
}

/* A new vertex at a + t (b - a). */
static uint32_t add_between(edit *e, const double *a, const double *b, double t) {
    return builder_vertex(&e->out, a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]),
                          a[2] + t * (b[2] - a[2]));
}

/* Cuts a polygon along the diagonal between its places i < j. */
static void add_split(edit *e, const uint32_t *polygon, uint32_t size, uint32_t i, uint32_t j) {
    uint32_t rest[POLYGON + 2], count = 0;
    builder_face(&e->out, j - i + 1, polygon + i);
    for (uint32_t k = j; k <= size + i; ++k) rest[count++] = polygon[k % size];
    builder_face(&e->out, count, rest);
}

/* Joins a polygon to a new vertex: by triangles, or by quads to every second vertex of an even one. */
static void add_poked(edit *e, const uint32_t *polygon, uint32_t size, const double *center) {
    const uint32_t c = builder_vertex(&e->out, center[0], center[1], center[2]);
    const uint32_t step = size % 2 == 0 && size >= 6 && qp_random_chance(e->random, 0.6) ? 2 : 1;
    for (uint32_t i = 0; i < size; i += step) {
        uint32_t piece[4] = {c, polygon[i], polygon[(i + 1) % size], polygon[(i + 2) % size]};
        builder_face(&e->out, step + 2, piece);
    }
}

static uint32_t random_face(const edit *e) {
    return qp_random_below(e->random, e->mesh->n_faces);
}

static bool edit_split_face(edit *e) {
    const uint32_t f = random_face(e), n = qp_face_size(e->mesh, f);
    if (n < 4 || n > POLYGON) return false;
    uint32_t i = qp_random_below(e->random, n), j = (i + 2 + qp_random_below(e->random, n - 3)) % n;
    e->drop[f] = 1;
    copy_rest(e);
    add_split(e, e->mesh->face_vertices + e->mesh->face_offsets[f], n, i < j ? i : j, i < j ? j : i);
    return true;
}

static bool edit_poke(edit *e) {
    const uint32_t f = random_face(e), n = qp_face_size(e->mesh, f);
    double center[3];
    if (n > POLYGON) return false;
    e->drop[f] = 1;
    copy_rest(e);
    generate_face_center(e->mesh, f, center);
    add_poked(e, e->mesh->face_vertices + e->mesh->face_offsets[f], n, center);
    return true;
}

/* A smaller copy inside the face, joined to it by quads. */
static bool edit_inset(edit *e) {
    const uint32_t f = random_face(e), n = qp_face_size(e->mesh, f);
    uint32_t inner[POLYGON];
    double center[3];
    if (n > POLYGON) return false;
    e->drop[f] = 1;
    copy_rest(e);
    generate_face_center(e->mesh, f, center);
    const uint32_t *outer = e->mesh->face_vertices + e->mesh->face_offsets[f];
    for (uint32_t i = 0; i < n; ++i) inner[i] = add_between(e, position(e, outer[i]), center, 0.45);
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t next = (i + 1) % n;
        builder_quad(&e->out, outer[i], outer[next], inner[next], inner[i]);
    }
    builder_face(&e->out, n, inner);
    return true;
}

/* The loop about both faces of corner h's edge: first the vertices of h's face from its head round to its
 * tail, then those of the other face. 0 when there is no other face or the loop is too long. */
static uint32_t merged_loop(const edit *e, uint32_t h, uint32_t loop[POLYGON]) {
    const qp_mesh *m = e->mesh;
    const uint32_t twin = m->corner_twin[h];
    if (twin == QP_NONE) return 0;
    const uint32_t n1 = qp_face_size(m, m->corner_face[h]), n2 = qp_face_size(m, m->corner_face[twin]);
    if (n1 + n2 - 2 > POLYGON) return 0;
    uint32_t count = 0, c = h;
    for (uint32_t i = 0; i < n1; ++i) {
        c = qp_corner_next(m, c);
        loop[count++] = m->face_vertices[c];
    }
    c = qp_corner_next(m, twin);
    for (uint32_t i = 0; i + 2 < n2; ++i) {
        c = qp_corner_next(m, c);
        loop[count++] = m->face_vertices[c];
    }
    return count;
}

static bool edit_merge(edit *e) {
    uint32_t loop[POLYGON];
    const uint32_t h = qp_random_below(e->random, e->mesh->n_corners), n = merged_loop(e, h, loop);
    /* Large faces are welcome but rare. */
    if (n == 0 || (n > 8 && !qp_random_chance(e->random, 0.1))) return false;
    e->drop[e->mesh->corner_face[h]] = e->drop[e->mesh->corner_face[e->mesh->corner_twin[h]]] = 1;
    copy_rest(e);
    builder_face(&e->out, n, loop);
    return true;
}

/* Turns an edge within its two faces by one vertex: two valences fall by one, two rise. */
static bool edit_rotate(edit *e) {
    uint32_t loop[POLYGON];
    const uint32_t h = qp_random_below(e->random, e->mesh->n_corners), n = merged_loop(e, h, loop);
    if (n == 0) return false;
    const uint32_t n1 = qp_face_size(e->mesh, e->mesh->corner_face[h]);
    e->drop[e->mesh->corner_face[h]] = e->drop[e->mesh->corner_face[e->mesh->corner_twin[h]]] = 1;
    copy_rest(e);
    add_split(e, loop, n, 1, n1); /* the edge joined places 0 and n1 - 1 */
    return true;
}

/* A new vertex on an edge, joined (mostly) to a vertex across each face. */
static bool edit_split_edge(edit *e) {
    const qp_mesh *m = e->mesh;
    const uint32_t h = qp_random_below(e->random, m->n_corners);
    const uint32_t sides[2] = {h, m->corner_twin[h]};
    const uint32_t tail = m->face_vertices[h], head = m->face_vertices[qp_corner_next(m, h)];
    for (int s = 0; s < 2; ++s) {
        if (sides[s] == QP_NONE) continue;
        if (qp_face_size(m, m->corner_face[sides[s]]) + 1 > POLYGON) return false;
        e->drop[m->corner_face[sides[s]]] = 1;
    }
    copy_rest(e);
    const uint32_t middle = add_between(e, position(e, tail), position(e, head), 0.5);
    for (int s = 0; s < 2; ++s) {
        if (sides[s] == QP_NONE) continue;
        uint32_t loop[POLYGON], c = sides[s];
        const uint32_t n = qp_face_size(m, m->corner_face[c]);
        for (uint32_t i = 0; i < n; ++i) {
            c = qp_corner_next(m, c);
            loop[i] = m->face_vertices[c];
        }
        loop[n] = middle;
        if (qp_random_chance(e->random, 0.85)) {
            add_split(e, loop, n + 1, 1 + qp_random_below(e->random, n - 2), n);
        } else {
            builder_face(&e->out, n + 1, loop);
        }
    }
    return true;
}

/* Draws an edge together into its tail. */
static bool edit_collapse(edit *e) {
    const qp_mesh *m = e->mesh;
    const uint32_t h = qp_random_below(e->random, m->n_corners);
    const uint32_t tail = m->face_vertices[h], head = m->face_vertices[qp_corner_next(m, h)];
    for (uint32_t i = m->vertex_offsets[head]; i < m->vertex_offsets[head + 1]; ++i) {
        const uint32_t f = m->corner_face[m->vertex_corners[i]];
        if (qp_face_size(m, f) > POLYGON) return false;
        e->drop[f] = 1;
    }
    copy_rest(e);
    for (uint32_t i = m->vertex_offsets[head]; i < m->vertex_offsets[head + 1]; ++i) {
        const uint32_t f = m->corner_face[m->vertex_corners[i]];
        uint32_t loop[POLYGON], count = 0;
        bool both = false;
        for (uint32_t c = m->face_offsets[f]; c < m->face_offsets[f + 1]; ++c) {
            both = both || m->face_vertices[c] == tail;
        }
        for (uint32_t c = m->face_offsets[f]; c < m->face_offsets[f + 1]; ++c) {
            const uint32_t v = m->face_vertices[c];
            if (v != head) {
                loop[count++] = v;
            } else if (!both) {
                loop[count++] = tail;
            }
        }
        if (count >= 3) builder_face(&e->out, count, loop); /* a triangle on the edge disappears */
    }
    double *p = builder_position(&e->out, tail);
    for (int k = 0; k < 3 && p != NULL; ++k) p[k] = 0.5 * (position(e, tail)[k] + position(e, head)[k]);
    return true;
}

/* An interior vertex of valence at most POLYGON: its corners in counter-clockwise order; 0 if there is no
 * fan. */
static uint32_t random_fan(const edit *e, uint32_t corners[POLYGON]) {
    const qp_mesh *m = e->mesh;
    const uint32_t v = qp_random_below(e->random, m->n_vertices);
    const uint32_t valence = m->vertex_offsets[v + 1] - m->vertex_offsets[v];
    if (m->vertex_flags[v] != 0 || valence < 3 || valence > POLYGON) return 0;
    uint32_t c = m->vertex_corners[m->vertex_offsets[v]];
    for (uint32_t i = 0; i < valence; ++i) {
        corners[i] = c;
        c = m->corner_twin[qp_corner_prev(m, c)];
    }
    return valence;
}

/* Cuts an interior vertex off: a face of as many corners as it had edges. */
static bool edit_truncate(edit *e) {
    const qp_mesh *m = e->mesh;
    uint32_t fan[POLYGON], cut[POLYGON];
    const uint32_t n = random_fan(e, fan);
    if (n == 0 || n > 12) return false;
    const uint32_t v = m->face_vertices[fan[0]];
    for (uint32_t i = 0; i < n; ++i) {
        if (qp_face_size(m, m->corner_face[fan[i]]) + 1 > POLYGON) return false;
        e->drop[m->corner_face[fan[i]]] = 1;
    }
    copy_rest(e);
    for (uint32_t i = 0; i < n; ++i) {
        cut[i] =
            add_between(e, position(e, v), position(e, m->face_vertices[qp_corner_next(m, fan[i])]), 0.35);
    }
    for (uint32_t i = 0; i < n; ++i) {
        uint32_t loop[POLYGON], count = 0;
        for (uint32_t c = qp_corner_next(m, fan[i]); c != fan[i]; c = qp_corner_next(m, c)) {
            loop[count++] = m->face_vertices[c];
        }
        loop[count++] = cut[(i + 1) % n];
        loop[count++] = cut[i];
        builder_face(&e->out, count, loop);
    }
    builder_face(&e->out, n, cut);
    return true;
}

/* Takes an interior vertex out; the hole becomes one face, or a fan about a new vertex of high valence. */
static bool edit_remove_vertex(edit *e) {
    const qp_mesh *m = e->mesh;
    uint32_t fan[POLYGON], loop[POLYGON], count = 0;
    const uint32_t n = random_fan(e, fan);
    if (n == 0) return false;
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t last = qp_corner_prev(m, fan[i]);
        for (uint32_t c = qp_corner_next(m, fan[i]); c != last; c = qp_corner_next(m, c)) {
            if (count == POLYGON) return false;
            loop[count++] = m->face_vertices[c];
        }
        e->drop[m->corner_face[fan[i]]] = 1;
    }
    copy_rest(e);
    if (count <= 10 && qp_random_chance(e->random, 0.4)) {
        builder_face(&e->out, count, loop);
    } else {
        add_poked(e, loop, count, position(e, m->face_vertices[fan[0]]));
    }
    return true;
}

static bool edit_remove_face(edit *e) {
    if (e->mesh->n_faces < 4) return false;
    e->drop[random_face(e)] = 1;
    copy_rest(e);
    return true;
}

/* Manifold, within the limit, without two faces that only cover each other; interior vertices of valence 2
 * are legal but rare. */
static bool acceptable(const qp_mesh *m, qp_random *random, bool open, uint32_t limit) {
    if (m->n_faces > limit || m->n_faces < 1) return false;
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        if (m->vertex_flags[v] & QP_VERTEX_NONMANIFOLD) return false;
        if (!open && (m->vertex_flags[v] & QP_VERTEX_BOUNDARY)) return false;
        const uint32_t begin = m->vertex_offsets[v];
        if (m->vertex_offsets[v + 1] - begin != 2 || (m->vertex_flags[v] & QP_VERTEX_BOUNDARY)) continue;
        const uint32_t c1 = m->vertex_corners[begin], c2 = m->vertex_corners[begin + 1];
        const uint32_t n1 = qp_face_size(m, m->corner_face[c1]), n2 = qp_face_size(m, m->corner_face[c2]);
        if (n1 < 4 || n2 < 4) return false;
        const uint32_t far1 = m->face_vertices[qp_corner_next(m, qp_corner_next(m, c1))];
        const uint32_t far2 = m->face_vertices[qp_corner_next(m, qp_corner_next(m, c2))];
        if (far1 == far2 || !qp_random_chance(random, 0.2)) return false;
    }
    return true;
}

/* Makes the mesh of a builder and takes it in place of *mesh if it is acceptable. */
static bool replace(qp_mesh **mesh, mesh_builder *out, qp_random *random, bool open, uint32_t limit) {
    qp_mesh *candidate;
    out->boundary = QP_BOUNDARY_EDGE_ONLY;
    if (builder_finish(out, &candidate, NULL) != QP_OK) return false;
    const bool good = acceptable(candidate, random, open, limit);
    qp_mesh_free(good ? *mesh : candidate);
    if (good) *mesh = candidate;
    return good;
}

bool generate_edit(qp_mesh **mesh, qp_random *random, bool open, uint32_t limit) {
    static bool (*const edits[])(edit *) = {
        edit_split_face, edit_split_face,    edit_poke,          edit_inset,      edit_inset,
        edit_merge,      edit_merge,         edit_merge,         edit_rotate,     edit_rotate,
        edit_rotate,     edit_split_edge,    edit_split_edge,    edit_collapse,   edit_collapse,
        edit_truncate,   edit_remove_vertex, edit_remove_vertex, edit_remove_face};
    const uint32_t count = sizeof edits / sizeof edits[0];
    edit e = {.mesh = *mesh, .random = random, .drop = qp_alloc((*mesh)->n_faces, 1, true)};
    if (e.drop == NULL) return false;
    /* Only open meshes lose faces; the last entry stands for that. */
    const bool made = edits[qp_random_below(random, open ? count : count - 1)](&e);
    free(e.drop);
    if (!made) {
        builder_free(&e.out);
        return false;
    }
    return replace(mesh, &e.out, random, open, limit);
}

bool generate_split_all(qp_mesh **mesh, uint32_t limit) {
    const qp_mesh *m = *mesh;
    if (m->n_corners > limit) return false;
    mesh_builder out = {0};
    for (uint32_t v = 0; v < m->n_vertices; ++v) {
        const double *p = m->positions + 3 * (size_t)v;
        builder_vertex(&out, p[0], p[1], p[2]);
    }
    for (uint32_t i = 0; i < m->n_edges; ++i) {
        const double *a = m->positions + 3 * (size_t)m->edge_vertices[2 * (size_t)i];
        const double *b = m->positions + 3 * (size_t)m->edge_vertices[2 * (size_t)i + 1];
        builder_vertex(&out, 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]));
    }
    for (uint32_t f = 0; f < m->n_faces; ++f) {
        double center[3];
        generate_face_center(m, f, center);
        const uint32_t middle = builder_vertex(&out, center[0], center[1], center[2]);
        for (uint32_t c = m->face_offsets[f]; c < m->face_offsets[f + 1]; ++c) {
            builder_quad(&out, m->face_vertices[c], m->n_vertices + m->corner_edge[c], middle,
                         m->n_vertices + m->corner_edge[qp_corner_prev(m, c)]);
        }
    }
    out.boundary = QP_BOUNDARY_EDGE_ONLY;
    qp_mesh *split;
    if (builder_finish(&out, &split, NULL) != QP_OK) return false;
    qp_mesh_free(*mesh);
    *mesh = split;
    return true;
}
