/* Procedural meshes of fixed shape. */
#include "host/mesh/generate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

qp_status generate_size(const qp_generate_options *options, int i, uint32_t fallback, uint32_t low,
                        uint32_t high, const char *what, uint32_t *size, qp_error *err) {
    *size = options->n[i] != 0 ? options->n[i] : fallback;
    if (*size >= low && *size <= high) return QP_OK;
    return qp_fail(err, QP_BAD_INPUT, "%s must be from %u to %u, not %u", what, low, high, *size);
}

static double round_to(double x, double step) {
    return floor(x / step + 0.5) * step;
}

void generate_circle(double turn, double *x, double *y) {
    const double angle = 6.283185307179586 * turn;
    *x = round_to(cos(angle), 0x1p-40);
    *y = round_to(sin(angle), 0x1p-40);
}

/* ---- Cubes ---- */

/* One closed cube of n x n quads a side about a center. `numbers` is working memory for (n + 1)^3 lattice
 * points: the vertex of each point on the surface. */
static void add_cube(mesh_builder *b, uint32_t n, const double center[3], double half, uint32_t *numbers) {
    const size_t row = (size_t)n + 1;
    for (size_t i = 0; i < row * row * row; ++i) {
        size_t at[3] = {i % row, i / row % row, i / (row * row)};
        bool surface = false;
        double p[3];
        for (int k = 0; k < 3; ++k) {
            surface = surface || at[k] == 0 || at[k] == n;
            p[k] = center[k] + half * (2 * (double)at[k] / n - 1);
        }
        if (surface) numbers[i] = builder_vertex(b, p[0], p[1], p[2]);
    }
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const bool high = side % 2;
        for (uint32_t i = 0; i < n * n; ++i) {
            uint32_t quad[4];
            for (int k = 0; k < 4; ++k) {
                /* Counter-clockwise in (u,v) seen from the high end of the axis; turned for the low end. */
                const int corner = high ? k : 3 - k;
                size_t at[3];
                at[axis] = high ? n : 0;
                at[u] = i % n + (size_t)(corner == 1 || corner == 2);
                at[v] = i / n + (size_t)(corner >= 2);
                quad[k] = numbers[at[0] + row * (at[1] + row * at[2])];
            }
            builder_face(b, 4, quad);
        }
    }
}

/* A grid of separate cubes, each of n x n quads a side. */
static qp_status add_cubes(mesh_builder *b, const uint32_t count[3], uint32_t n, qp_error *err) {
    const size_t points = ((size_t)n + 1) * (n + 1) * (n + 1);
    uint32_t *numbers = qp_alloc(points, sizeof *numbers, false);
    if (numbers == NULL) return qp_fail_memory(err, points * sizeof *numbers, "a cube");
    for (uint32_t z = 0; z < count[2]; ++z) {
        for (uint32_t y = 0; y < count[1]; ++y) {
            for (uint32_t x = 0; x < count[0]; ++x) {
                const double center[3] = {3.0 * x, 3.0 * y, 3.0 * z};
                add_cube(b, n, center, 1, numbers);
            }
        }
    }
    free(numbers);
    return QP_OK;
}

static qp_status generate_cube(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    const uint32_t one[3] = {1, 1, 1};
    uint32_t n;
    qp_status status = generate_size(options, 0, 1, 1, 300, "cube: quads along an edge", &n, err);
    return status == QP_OK ? add_cubes(b, one, n, err) : status;
}

static qp_status generate_cubes(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    static const uint32_t paper[3] = {12, 12, 10};
    uint32_t count[3];
    for (int k = 0; k < 3; ++k) {
        qp_status status =
            generate_size(options, k, paper[k], 1, 100, "cubes: cubes along an axis", &count[k], err);
        if (status != QP_OK) return status;
    }
    return add_cubes(b, count, 1, err);
}

/* ---- Tori ---- */

/* Vertices of n[0] quads around the axis, n[1] around the tube (24 x 12). */
static qp_status torus_vertices(mesh_builder *b, const qp_generate_options *options, uint32_t *around,
                                uint32_t *tube, qp_error *err) {
    qp_status status = generate_size(options, 0, 24, 3, 20000, "torus: quads around the axis", around, err);
    if (status == QP_OK)
        status = generate_size(options, 1, 12, 3, 20000, "torus: quads around the tube", tube, err);
    if (status != QP_OK) return status;
    for (uint32_t i = 0; i < *around; ++i) {
        double x, y;
        generate_circle((double)i / *around, &x, &y);
        for (uint32_t j = 0; j < *tube; ++j) {
            double r, z;
            generate_circle((double)j / *tube, &r, &z);
            builder_vertex(b, (1 + 0.4 * r) * x, (1 + 0.4 * r) * y, 0.4 * z);
        }
    }
    return QP_OK;
}

/* A sharpness above 0 creases the top ring. */
static qp_status add_torus(mesh_builder *b, const qp_generate_options *options, double sharpness,
                           qp_error *err) {
    uint32_t around, tube;
    qp_status status = torus_vertices(b, options, &around, &tube, err);
    if (status != QP_OK) return status;
    const uint32_t top = tube / 4;
    for (uint32_t i = 0; i < around; ++i) {
        const uint32_t here = i * tube, next = (i + 1) % around * tube;
        for (uint32_t j = 0; j < tube; ++j) {
            const uint32_t up = (j + 1) % tube;
            builder_quad(b, here + j, next + j, next + up, here + up);
        }
        if (sharpness > 0) builder_crease(b, here + top, next + top, (float)sharpness);
    }
    return QP_OK;
}

/* One torus of n[0] x n[1] cells (24 x 12), each cut into two triangles along either diagonal, as the seed has it, and each of those
 * into three quads about its middle: no patch is regular, as all have a vertex of valence 3, and opposite it one of valence 4 to 8.
 * Cells come in tiles of TILE x TILE, so that patches near each other have numbers near each other. */
enum { TILE = 8 };

/* The vertex between the ends of an edge of the cells, which `number` tells from others; made where it is used first. */
static uint32_t middle_vertex(mesh_builder *b, uint32_t *middles, size_t number, uint32_t v0, uint32_t v1) {
    const double *p = builder_position(b, v0), *q = builder_position(b, v1);
    if (p == NULL || q == NULL) return 0;
    if (middles[number] == QP_NONE)
        middles[number] = builder_vertex(b, (p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2);
    return middles[number];
}

/* Three quads of a triangle of vertices v, with m[k] between v[k] and the next one. */
static void add_thirds(mesh_builder *b, const uint32_t v[3], const uint32_t m[3]) {
    double middle[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
        const double *p = builder_position(b, v[k]);
        for (int x = 0; x < 3 && p != NULL; ++x) middle[x] += p[x] / 3;
    }
    const uint32_t centre = builder_vertex(b, middle[0], middle[1], middle[2]);
    for (int k = 0; k < 3; ++k) builder_quad(b, centre, m[(k + 2) % 3], v[k], m[k]);
}

/* middles: 3 a cell: along i, along j, and across. */
static void add_cell(mesh_builder *b, uint32_t around, uint32_t tube, uint32_t i, uint32_t j, bool falling,
                     uint32_t *middles) {
    const uint32_t next = (i + 1) % around, up = (j + 1) % tube;
    const uint32_t v00 = i * tube + j, v10 = next * tube + j, v11 = next * tube + up, v01 = i * tube + up;
    const size_t cell = 3 * (size_t)v00;
    const uint32_t low = middle_vertex(b, middles, cell, v00, v10);
    const uint32_t left = middle_vertex(b, middles, cell + 1, v00, v01);
    const uint32_t high = middle_vertex(b, middles, 3 * (size_t)v01, v01, v11);
    const uint32_t right = middle_vertex(b, middles, 3 * (size_t)v10 + 1, v10, v11);
    const uint32_t across = falling ? middle_vertex(b, middles, cell + 2, v10, v01)
                                    : middle_vertex(b, middles, cell + 2, v00, v11);
    if (falling) {
        add_thirds(b, (const uint32_t[]){v00, v10, v01}, (const uint32_t[]){low, across, left});
        add_thirds(b, (const uint32_t[]){v10, v11, v01}, (const uint32_t[]){right, high, across});
    } else {
        add_thirds(b, (const uint32_t[]){v00, v10, v11}, (const uint32_t[]){low, right, across});
        add_thirds(b, (const uint32_t[]){v00, v11, v01}, (const uint32_t[]){across, high, left});
    }
}

static qp_status generate_irregular(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    uint32_t around, tube;
    qp_status status = torus_vertices(b, options, &around, &tube, err);
    qp_random random = {options->seed};
    if (status != QP_OK) return status;
    if ((uint64_t)around * tube > 100000000)
        return qp_fail(err, QP_BAD_INPUT, "irregular: more than 10^8 cells");
    const size_t edges = 3 * (size_t)around * tube;
    uint32_t *middles = qp_alloc(edges, sizeof *middles, false);
    if (middles == NULL) return qp_fail_memory(err, edges * sizeof *middles, "a torus");
    memset(middles, 0xff, edges * sizeof *middles);
    for (uint32_t i = 0; i < around; i += TILE) {
        for (uint32_t j = 0; j < tube; j += TILE) {
            const uint32_t end_i = around - i < TILE ? around : i + TILE,
                           end_j = tube - j < TILE ? tube : j + TILE;
            for (uint32_t x = i; x < end_i; ++x)
                for (uint32_t y = j; y < end_j; ++y)
                    add_cell(b, around, tube, x, y, qp_random_below(&random, 2) != 0, middles);
        }
    }
    free(middles);
    return QP_OK;
}

static qp_status generate_torus(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    return add_torus(b, options, 0, err);
}

static qp_status generate_creased_torus(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    return add_torus(b, options, options->sharpness < 0 ? 4.7 : options->sharpness, err);
}

/* ---- Fans and prisms ---- */

/* n[0] sectors of n[1] x n[1] quads (5, 2) about one vertex of valence n[0]. Point (i,j) of a sector lies at
 * radius max(i,j) and at the fraction j / (i + j) of the sector's angle, which also holds for two sectors. */
static qp_status generate_fan(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    uint32_t valence, n;
    qp_status status = generate_size(options, 0, 5, 2, 1000000, "fan: valence", &valence, err);
    if (status == QP_OK) status = generate_size(options, 1, 2, 1, 100, "fan: quads along a spoke", &n, err);
    if (status != QP_OK) return status;
    if ((uint64_t)valence * n * n > 100000000) return qp_fail(err, QP_BAD_INPUT, "fan: more than 10^8 faces");
    builder_vertex(b, 0, 0, 0.5);
    /* A sector owns i = 1..n, j = 0..n; its j axis is the i axis of the next sector. */
    for (uint32_t s = 0; s < valence; ++s) {
        for (uint32_t i = 1; i <= n; ++i) {
            for (uint32_t j = 0; j <= n; ++j) {
                double x, y, r = (double)(i > j ? i : j) / n;
                generate_circle((s + (double)j / (i + j)) / valence, &x, &y);
                builder_vertex(b, r * x, r * y, 0.5 - 0.4 * r * r + 0.2 * r * r * x * y);
            }
        }
    }
    const uint32_t sector = n * (n + 1);
    for (uint32_t s = 0; s < valence; ++s) {
        const uint32_t first = 1 + s * sector, next = 1 + (s + 1) % valence * sector;
        for (uint32_t i = 0; i < n; ++i) {
            for (uint32_t j = 0; j < n; ++j) {
                uint32_t quad[4];
                for (uint32_t k = 0; k < 4; ++k) {
                    const uint32_t a = i + (k == 1 || k == 2), c = j + (k >= 2);
                    quad[k] = a > 0 ? first + (a - 1) * (n + 1) + c : c > 0 ? next + (c - 1) * (n + 1) : 0;
                }
                builder_face(b, 4, quad);
            }
        }
    }
    return QP_OK;
}

/* Two n[0]-gons (5) joined by n[1] rings of quads (1). */
static qp_status generate_prism(mesh_builder *b, const qp_generate_options *options, qp_error *err) {
    uint32_t n, rings;
    qp_status status = generate_size(options, 0, 5, 3, 1000000, "prism: sides", &n, err);
    if (status == QP_OK) status = generate_size(options, 1, 1, 1, 1000, "prism: rings of quads", &rings, err);
    if (status != QP_OK) return status;
    if ((uint64_t)n * rings > 100000000) return qp_fail(err, QP_BAD_INPUT, "prism: more than 10^8 faces");
    uint32_t *cap = qp_alloc(n, sizeof *cap, false);
    if (cap == NULL) return qp_fail_memory(err, n * sizeof *cap, "a prism");
    for (uint32_t j = 0; j <= rings; ++j) {
        for (uint32_t i = 0; i < n; ++i) {
            double x, y;
            generate_circle((double)i / n, &x, &y);
            builder_vertex(b, x, y, 2.0 * j / rings - 1);
        }
    }
    for (uint32_t i = 0; i < n; ++i) cap[i] = n - 1 - i;
    builder_face(b, n, cap);
    for (uint32_t j = 0; j < rings; ++j) {
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t next = (i + 1) % n;
            builder_quad(b, j * n + i, j * n + next, (j + 1) * n + next, (j + 1) * n + i);
        }
    }
    for (uint32_t i = 0; i < n; ++i) cap[i] = rings * n + i;
    builder_face(b, n, cap);
    free(cap);
    return QP_OK;
}

qp_status qp_mesh_generate(const char *kind, const qp_generate_options *options, qp_mesh **mesh,
                           qp_error *err) {
    static const struct {
        const char *kind;
        qp_status (*fill)(mesh_builder *, const qp_generate_options *, qp_error *);
    } fixed[] = {{"cube", generate_cube},
                 {"torus", generate_torus},
                 {"creased-torus", generate_creased_torus},
                 {"cubes", generate_cubes},
                 {"fan", generate_fan},
                 {"prism", generate_prism},
                 {"irregular", generate_irregular}};
    static const qp_generate_options defaults = {.sharpness = -1};
    *mesh = NULL;
    if (options == NULL) options = &defaults;
    if (!(options->sharpness <= 1e6)) return qp_fail(err, QP_BAD_INPUT, "sharpness %g", options->sharpness);
    if (strcmp(kind, "terrain") == 0) return generate_terrain(options, mesh, err);
    if (strcmp(kind, "random-closed") == 0) return generate_random(options, false, mesh, err);
    if (strcmp(kind, "random-open") == 0) return generate_random(options, true, mesh, err);
    for (size_t i = 0; i < sizeof fixed / sizeof fixed[0]; ++i) {
        if (strcmp(kind, fixed[i].kind) != 0) continue;
        mesh_builder b = {.boundary = QP_BOUNDARY_EDGE_ONLY};
        qp_status status = fixed[i].fill(&b, options, err);
        if (status == QP_OK) return builder_finish(&b, mesh, err);
        builder_free(&b);
        return status;
    }
    return qp_fail(err, QP_BAD_INPUT,
                   "unknown kind of mesh \"%.40s\" (cube, torus, creased-torus, cubes, fan, prism, terrain, "
                   "irregular, random-closed, random-open)",
                   kind);
}
