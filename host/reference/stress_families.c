/* The families of hard cases. Each steps with its first numbers through a table of what it is to cover. */
#include "host/reference/stress.h"

#include <float.h>
#include <math.h>

#define COUNT(table) ((uint32_t)(sizeof(table) / sizeof(table)[0]))

/* ---- Tags ---- */

/* Fractions about every integer, and both ends. */
static const float sharpnesses[] = {
    1e-3f,  9.999f, 0.999f, 1.0f,   1.001f, 1.999f, 2.0f,
    2.001f, 0.5f,   4.7f,   3.999f, 4.0f,   4.001f, 6.5f,
    7.999f, 8.0f,   8.001f, 8.999f, 9.0f,   9.001f, 0.01f,
    2.999f, 3.0f,   3.001f, 5.999f, 6.001f, 1e-30f, 9.9999990463256836f /* the float below 10 */};

/* A table entry for the first numbers; later an integer give or take up to 2e-3, or anything. */
static float pick_sharpness(uint32_t number, qp_random *random) {
    if (number < COUNT(sharpnesses)) return sharpnesses[number];
    if (qp_random_chance(random, 0.5)) return (float)(9.999 * qp_random_unit(random));
    return fabsf((float)qp_random_below(random, 10) + 4e-3f * ((float)qp_random_unit(random) - 0.5f));
}
static float given_sharpness(qp_random *random, void *context) {
    (void)random;
    return *(const float *)context;
}
static float any_sharpness(qp_random *random, void *context) {
    (void)context;
    if (qp_random_chance(random, 0.15)) return QP_SHARPNESS_INFINITE;
    return pick_sharpness(qp_random_below(random, 2 * COUNT(sharpnesses)), random);
}
static float finite_sharpness(qp_random *random, void *context) {
    (void)context;
    return pick_sharpness(qp_random_below(random, 2 * COUNT(sharpnesses)), random);
}

static const qp_stress_tags no_tags = {
    .sharpness = any_sharpness, .first_hole = QP_NONE, .length = 1, .rules = -1};

/* ---- Topology ---- */

static const uint32_t valences[] = {2,  2000, 3,   5,   100, 6,  7,  500, 8,  1000, 12,
                                    16, 9,    200, 333, 24,  32, 10, 50,  64, 1999, 128};

static uint32_t pick_valence(uint32_t number, qp_random *random) {
    if (number < COUNT(valences)) return valences[number];
    /* All powers of two as likely. */
    const uint32_t power = 1u << (1 + qp_random_below(random, 10)),
                   valence = power + qp_random_below(random, power);
    return valence > 2000 ? 2000 : valence;
}

static qp_status make_valence(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    const uint32_t n = pick_valence(number, random);
    return qp_stress_fan(n, n < 40 ? 2 : 1, false, number % 2 == 0 ? 0.2 : 2.0 / n, random, &made->mesh, err);
}

/* Two faces at either end of a wide fan have a surface, or four anywhere: every sector is a configuration of its own. */
static qp_status make_boundary_valence(uint32_t number, qp_random *random, qp_stress_case *made,
                                       qp_error *err) {
    const uint32_t n = pick_valence(number, random) - 1, rings = n < 40 ? 2 : 1;
    qp_stress_tags tags = no_tags;
    if (n > 40) {
        tags.holes = n - 4;
        tags.first_hole = number % 3 == 0 ? QP_NONE : 2;
    }
    tags.rules = 1 + (int)qp_random_below(random, 2); /* "none" would leave no face */
    if (number % 4 == 3) tags.chains = 1;
    qp_status status = qp_stress_fan(n, rings, true, 0.2, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}

static qp_status make_sharp_edges(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    float sharpness = pick_sharpness(number, random);
    qp_stress_tags tags = no_tags;
    tags.chains = 1 + qp_random_below(random, 3);
    tags.length = 1 + qp_random_below(random, 6);
    tags.sharpness = given_sharpness;
    tags.context = &sharpness;
    qp_status status = qp_stress_shape(number % 4, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}

static qp_status make_sharp_vertices(uint32_t number, qp_random *random, qp_stress_case *made,
                                     qp_error *err) {
    float sharpness = pick_sharpness(number, random);
    qp_stress_tags tags = no_tags;
    tags.corners = 1 + qp_random_below(random, 5);
    tags.sharpness = given_sharpness;
    tags.context = &sharpness;
    qp_status status = qp_stress_shape(number % 4, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}

static qp_status make_chains(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_stress_tags tags = no_tags;
    tags.chains = 1 + qp_random_below(random, 4);
    tags.length = 2 + qp_random_below(random, 7);
    tags.corners = qp_random_below(random, 3);
    tags.sharpness = number % 4 == 3 ? any_sharpness : finite_sharpness;
    tags.rules = 1 + (int)(3 * (number % 2)); /* both crease methods */
    qp_status status = qp_stress_shape(number / 2, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}

static qp_status make_beyond_depth(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    static const float sharp[] = {9.9f, 9.999f, 5.5f, 3.001f, 7.0f};
    float sharpness = sharp[number % COUNT(sharp)];
    qp_stress_tags tags = no_tags;
    tags.chains = 2;
    tags.length = 4;
    tags.corners = 2;
    if (number % 2 == 0) {
        tags.sharpness = given_sharpness;
        tags.context = &sharpness;
    } else {
        tags.sharpness = finite_sharpness;
    }
    made->depth = 1 + (number + 1) % 4;
    qp_status status = qp_stress_shape(number, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}

/* ---- Positions ---- */

static void transform(qp_mesh *m, const double scale[3], const double shift[3]) {
    for (size_t i = 0; i < 3 * (size_t)m->n_vertices; ++i)
        m->positions[i] = m->positions[i] * scale[i % 3] + shift[i % 3];
}

static double random_sign(qp_random *random) {
    return qp_random_chance(random, 0.5) ? 1 : -1;
}

/* Moves by `distance` along one axis or all of them. */
static void translate(qp_mesh *m, double distance, qp_random *random) {
    const double one[3] = {1, 1, 1};
    double shift[3] = {0, 0, 0};
    const uint32_t only = qp_random_below(random, 4);
    for (uint32_t k = 0; k < 3; ++k)
        if (only == 3 || only == k)
            shift[k] = distance * random_sign(random) * (0.5 + 0.5 * qp_random_unit(random));
    transform(m, one, shift);
}

static void scale_by(qp_mesh *m, double s) {
    const double all[3] = {s, s, s}, none[3] = {0, 0, 0};
    transform(m, all, none);
}

static const double distances[] = {1e3, 1e6, 1e9}, scales[] = {1e-20, 1e20, 1e-3, 1e4, 1e-30, 1e29};

static qp_status make_far(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_status status = qp_stress_shape(number / COUNT(distances), random, &made->mesh, err);
    if (status != QP_OK) return status;
    translate(made->mesh, distances[number % COUNT(distances)], random);
    return qp_stress_moved(&made->mesh, err);
}

static qp_status make_scaled(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_status status = qp_stress_shape(number / COUNT(scales), random, &made->mesh, err);
    if (status != QP_OK) return status;
    scale_by(made->mesh, scales[number % COUNT(scales)]);
    return qp_stress_moved(&made->mesh, err);
}

/* A small mesh far away, and whole scenes in other units. */
static qp_status make_far_scaled(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    static const double pairs[][2] = {{1e-3, 1e3},    {1e-20, 1e-11}, {1e20, 1e29}, {1e-2, 1e6},
                                      {1e-20, 1e-17}, {1e20, 1e23},   {1e-5, 1e9},  {1e-20, 1}};
    qp_status status = qp_stress_shape(number / COUNT(pairs), random, &made->mesh, err);
    if (status != QP_OK) return status;
    scale_by(made->mesh, pairs[number % COUNT(pairs)][0]);
    translate(made->mesh, pairs[number % COUNT(pairs)][1], random);
    return qp_stress_moved(&made->mesh, err);
}

static double *position(qp_mesh *m, uint32_t v) {
    return m->positions + 3 * (size_t)v;
}

/* Draws vertex v to within `share` of its distance from vertex `to`. */
static void draw_near(qp_mesh *m, uint32_t v, uint32_t to, double share) {
    for (int k = 0; k < 3; ++k)
        position(m, v)[k] = position(m, to)[k] + share * (position(m, v)[k] - position(m, to)[k]);
}

static void random_edge(const qp_mesh *m, qp_random *random, uint32_t v[2]) {
    const uint32_t e = qp_random_below(random, m->n_edges), turn = qp_random_below(random, 2);
    v[0] = m->edge_vertices[2 * (size_t)e + turn];
    v[1] = m->edge_vertices[2 * (size_t)e + 1 - turn];
}

/* Long thin faces: one axis stretched or pressed, or single edges almost of no length. */
static void make_thin(qp_mesh *m, uint32_t number, qp_random *random) {
    static const double factors[] = {1e3, 1e-4, 1e6, 1e-7, 1e9, 1e-12};
    const double factor = factors[number / 2 % COUNT(factors)], none[3] = {0, 0, 0};
    double scale[3] = {1, 1, 1};
    if (number % 2 == 0) {
        scale[qp_random_below(random, 3)] = factor;
        transform(m, scale, none);
        return;
    }
    for (uint32_t i = 1 + m->n_edges / 8; i > 0; --i) {
        uint32_t v[2];
        random_edge(m, random, v);
        draw_near(m, v[0], v[1], factor < 1 ? factor : 1 / factor);
    }
}

static qp_status make_needles(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_status status = qp_stress_shape(number / 2, random, &made->mesh, err);
    if (status != QP_OK) return status;
    make_thin(made->mesh, number, random);
    return qp_stress_moved(&made->mesh, err);
}

/* Vertices change places with others of their face or of anywhere: faces cross themselves and turn over. */
static void fold(qp_mesh *m, bool near, qp_random *random) {
    for (uint32_t i = 1 + qp_random_below(random, 1 + m->n_vertices / 4); i > 0; --i) {
        const uint32_t c = qp_random_below(random, m->n_corners);
        const uint32_t v = m->face_vertices[c], to = near ? m->face_vertices[qp_corner_next(m, c)]
                                                          : qp_random_below(random, m->n_vertices);
        for (int k = 0; k < 3; ++k) {
            const double swap = position(m, v)[k];
            position(m, v)[k] = position(m, to)[k];
            position(m, to)[k] = swap;
        }
    }
}

static qp_status make_folded(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_status status = qp_stress_shape(number / 2, random, &made->mesh, err);
    if (status != QP_OK) return status;
    fold(made->mesh, number % 2 == 0, random);
    return qp_stress_moved(&made->mesh, err);
}

/* Points that coincide: ends of edges, whole faces, all of a line, all of them. */
static void coincide(qp_mesh *m, uint32_t kind, qp_random *random) {
    uint32_t v[2];
    const uint32_t face = qp_random_below(random, m->n_faces), axis = qp_random_below(random, 3);
    switch (kind) {
    case 0: /* edges of no length */
        for (uint32_t i = 1 + m->n_edges / 10; i > 0; --i) {
            random_edge(m, random, v);
            draw_near(m, v[0], v[1], 0);
        }
        break;
    case 1: /* a face, and so those around it have edges of no length */
        for (uint32_t c = m->face_offsets[face]; c < m->face_offsets[face + 1]; ++c)
            draw_near(m, m->face_vertices[c], m->face_vertices[m->face_offsets[face]], 0);
        break;
    case 2: /* vertices that are far apart in the mesh */
        for (uint32_t i = 1 + m->n_vertices / 8; i > 0; --i)
            draw_near(m, qp_random_below(random, m->n_vertices), qp_random_below(random, m->n_vertices), 0);
        break;
    case 3: /* all on a line, not along an axis */
        for (uint32_t i = 0; i < m->n_vertices; ++i) {
            double *p = position(m, i);
            p[1] = 2 * p[0];
            p[2] = -0.75 * p[0];
        }
        break;
    case 4: /* all in a plane along two axes */
        for (uint32_t i = 0; i < m->n_vertices; ++i) position(m, i)[axis] = 0.1;
        break;
    case 5: /* all equal */
        for (uint32_t i = 1; i < m->n_vertices; ++i) draw_near(m, i, 0, 0);
        break;
    default: /* collinear faces */
        for (uint32_t i = 0; i < m->n_vertices; ++i) {
            double *p = position(m, i);
            p[axis] = p[(axis + 1) % 3] * 0.5;
        }
        for (uint32_t c = m->face_offsets[face]; c < m->face_offsets[face + 1]; ++c) {
            double *p = position(m, m->face_vertices[c]);
            p[(axis + 2) % 3] = p[axis];
        }
        break;
    }
}
enum { COINCIDENCES = 7 };

static qp_status make_coincident(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_status status = qp_stress_shape(number / COINCIDENCES, random, &made->mesh, err);
    if (status != QP_OK) return status;
    coincide(made->mesh, number % COINCIDENCES, random);
    return qp_stress_moved(&made->mesh, err);
}

/* ---- (u,v) ---- */

/* Some crease on every shape, so that all kinds of node are passed. */
static qp_status make_plain(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_stress_tags tags = no_tags;
    tags.chains = 1;
    tags.length = 3;
    qp_status status = qp_stress_shape(number, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}
static qp_status make_dyadic(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    made->points = QP_STRESS_DYADIC;
    return make_plain(number, random, made, err);
}
static qp_status make_adjacent(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    made->points = QP_STRESS_ADJACENT;
    return make_plain(number, random, made, err);
}
static qp_status make_tiny(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    made->points = QP_STRESS_TINY;
    return make_plain(number, random, made, err);
}

/* ---- Soups ---- */

static qp_stress_tags random_tags(qp_random *random) {
    qp_stress_tags tags = no_tags;
    tags.chains = qp_random_below(random, 5);
    tags.length = 1 + qp_random_below(random, 8);
    tags.corners = qp_random_below(random, 4);
    tags.holes = qp_random_chance(random, 0.2) ? qp_random_below(random, 4) : 0;
    tags.constant = qp_random_chance(random, 0.4);
    tags.rules = (int)qp_random_below(random, 12);
    return tags;
}

static qp_status make_soup(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_stress_tags tags = random_tags(random);
    tags.rules = (int)(number % 12);
    qp_status status = qp_stress_shape(4 + number % 2, random, &made->mesh, err);
    return status == QP_OK ? qp_stress_tag(&made->mesh, &tags, random, err) : status;
}

static qp_status make_nonmanifold(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    qp_stress_tags tags = random_tags(random);
    tags.rules = (int)(number % 12);
    qp_status status = qp_stress_nonmanifold(random, &made->mesh, err);
    if (status != QP_OK || number % 3 == 0) return status;
    return qp_stress_tag(&made->mesh, &tags, random, err);
}

static qp_status make_everything(uint32_t number, qp_random *random, qp_stress_case *made, qp_error *err) {
    const qp_stress_tags tags = random_tags(random);
    made->points = (qp_stress_points)qp_random_below(random, 4);
    made->depth = qp_random_chance(random, 0.5) ? 1 + qp_random_below(random, 10) : 0;
    qp_status status = qp_random_chance(random, 0.3)
                           ? qp_stress_nonmanifold(random, &made->mesh, err)
                           : qp_stress_shape(qp_random_below(random, 6), random, &made->mesh, err);
    if (status == QP_OK) status = qp_stress_tag(&made->mesh, &tags, random, err);
    if (status != QP_OK) return status;
    if (qp_random_chance(random, 0.4)) make_thin(made->mesh, qp_random_below(random, 8), random);
    if (qp_random_chance(random, 0.4)) fold(made->mesh, qp_random_chance(random, 0.5), random);
    if (qp_random_chance(random, 0.3)) coincide(made->mesh, qp_random_below(random, COINCIDENCES), random);
    const double scale = number % 3 == 0 ? 1 : scales[qp_random_below(random, 4)];
    scale_by(made->mesh, scale);
    if (qp_random_chance(random, 0.6))
        translate(made->mesh, scale * distances[qp_random_below(random, COUNT(distances))], random);
    return qp_stress_moved(&made->mesh, err);
}

static const qp_stress_family families[] = {
    {"valence", "interior vertices of valence 2 to 2000", 12, make_valence},
    {"boundary-valence", "boundary vertices of 1 to 1999 faces", 12, make_boundary_valence},
    {"sharp-edges", "creases of sharpness 1e-3 to 9.999, on either side of integers", 28, make_sharp_edges},
    {"sharp-vertices", "the same for corners", 28, make_sharp_vertices},
    {"chains", "chains of creases, every edge of another sharpness, by both crease methods", 24, make_chains},
    {"beyond-depth", "plans of depth 1 to 4 under sharpness to 9.999", 24, make_beyond_depth},
    {"far", "meshes 1e3, 1e6 and 1e9 away", 18, make_far},
    {"scaled", "meshes scaled by 1e-30 to 1e29", 18, make_scaled},
    {"far-scaled", "small meshes far away, and other units", 24, make_far_scaled},
    {"needles", "faces stretched, pressed, and with edges almost of no length", 24, make_needles},
    {"folded", "vertices that changed places", 24, make_folded},
    {"coincident", "duplicate points: edges, faces, lines, planes, all of them", 42, make_coincident},
    {"uv-dyadic", "(u,v) at 2^-k and 1 - 2^-k, k to 24", 12, make_dyadic},
    {"uv-adjacent", "(u,v) at the floats next to split planes", 12, make_adjacent},
    {"uv-tiny", "(u,v) far below 2^-24, to the smallest float", 12, make_tiny},
    {"soup", "random meshes and tags under all rules", 48, make_soup},
    {"non-manifold", "random faces over few vertices", 48, make_nonmanifold},
    {"everything", "all of the above at once", 96, make_everything},
};

const qp_stress_family *qp_stress_families(size_t *count) {
    *count = COUNT(families);
    return families;
}
