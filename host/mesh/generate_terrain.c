/* Terrain: a height field of quads in which some places are edited, one in each block of 4 x 4 cells at the
 * most, so that edits never meet. */
#include "host/mesh/generate.h"

#include <stdlib.h>

enum { BLOCK = 4 };

/* A number in [-1, 1] for a lattice point of an octave. */
static double lattice(uint64_t seed, uint32_t octave, uint32_t x, uint32_t y) {
    qp_random random = {seed ^ ((uint64_t)octave << 58) ^ ((uint64_t)x << 29) ^ y};
    qp_random_bits(&random);
    return 2 * qp_random_unit(&random) - 1;
}

static double fade(double t) {
    return t * t * (3 - 2 * t);
}

/* Value noise: lattice numbers blended smoothly, each octave twice as fine and half as high. */
static double height(uint64_t seed, double x, double y) {
    double sum = 0, amplitude = 0.35, scale = 3;
    for (uint32_t octave = 0; octave < 4; ++octave) {
        const uint32_t i = (uint32_t)(x * scale), j = (uint32_t)(y * scale);
        const double s = fade(x * scale - i), t = fade(y * scale - j);
        const double low = (1 - s) * lattice(seed, octave, i, j) + s * lattice(seed, octave, i + 1, j);
        const double high =
            (1 - s) * lattice(seed, octave, i, j + 1) + s * lattice(seed, octave, i + 1, j + 1);
        sum += amplitude * ((1 - t) * low + t * high);
        amplitude *= 0.5;
        scale *= 2;
    }
    return sum;
}

typedef struct terrain {
    mesh_builder b;
    uint32_t nx, ny;
    uint8_t *edited; /* [nx * ny] cells whose quad an edit replaced */
} terrain;

static uint32_t at(const terrain *t, uint32_t i, uint32_t j) {
    return j * (t->nx + 1) + i;
}

/* Edits the cells about (i,j), inside a block. */
static void edit_place(terrain *t, uint32_t i, uint32_t j, uint32_t kind) {
    const uint32_t v00 = at(t, i, j), v10 = at(t, i + 1, j), v20 = at(t, i + 2, j), v01 = at(t, i, j + 1),
                   v11 = at(t, i + 1, j + 1), v21 = at(t, i + 2, j + 1);
    uint8_t *cells = t->edited + (size_t)j * t->nx + i;
    cells[0] = 1;
    if (kind == 0) { /* two triangles */
        builder_face(&t->b, 3, (const uint32_t[]){v00, v10, v11});
        builder_face(&t->b, 3, (const uint32_t[]){v00, v11, v01});
        return;
    }
    cells[1] = 1;
    if (kind == 1) { /* the edge between two quads taken out */
        builder_face(&t->b, 6, (const uint32_t[]){v00, v10, v20, v21, v11, v01});
    } else if (kind == 2) { /* or rotated, either way */
        builder_quad(&t->b, v00, v10, v20, v01);
        builder_quad(&t->b, v20, v21, v11, v01);
    } else if (kind == 3) {
        builder_quad(&t->b, v00, v10, v21, v11);
        builder_face(&t->b, 3, (const uint32_t[]){v00, v11, v01});
        builder_face(&t->b, 3, (const uint32_t[]){v10, v20, v21});
    } else { /* the vertex between four quads taken out */
        const uint32_t v02 = at(t, i, j + 2), v12 = at(t, i + 1, j + 2), v22 = at(t, i + 2, j + 2);
        cells[t->nx] = cells[t->nx + 1] = 1;
        builder_face(&t->b, 8, (const uint32_t[]){v00, v10, v20, v21, v22, v12, v02, v01});
    }
}

static void add_faces(terrain *t, uint64_t seed) {
    qp_random random = {seed};
    for (uint32_t j = 0; j + BLOCK <= t->ny; j += BLOCK) {
        for (uint32_t i = 0; i + BLOCK <= t->nx; i += BLOCK) {
            const uint32_t di = qp_random_below(&random, BLOCK - 1), dj = qp_random_below(&random, BLOCK - 1);
            const uint32_t kind = qp_random_below(&random, 8); /* 5 to 7: untouched */
            if (kind < 5) edit_place(t, i + di, j + dj, kind);
        }
    }
    for (uint32_t j = 0; j < t->ny; ++j) {
        for (uint32_t i = 0; i < t->nx; ++i) {
            if (t->edited[(size_t)j * t->nx + i]) continue;
            builder_quad(&t->b, at(t, i, j), at(t, i + 1, j), at(t, i + 1, j + 1), at(t, i, j + 1));
        }
    }
}

qp_status generate_terrain(const qp_generate_options *options, qp_mesh **mesh, qp_error *err) {
    terrain t = {.b = {.boundary = QP_BOUNDARY_EDGE_ONLY}};
    qp_status status = generate_size(options, 0, 32, 1, 4000, "terrain: cells along x", &t.nx, err);
    if (status == QP_OK)
        status = generate_size(options, 1, 32, 1, 4000, "terrain: cells along y", &t.ny, err);
    if (status != QP_OK) return status;
    t.edited = qp_alloc((size_t)t.nx * t.ny, 1, true);
    if (t.edited == NULL) return qp_fail_memory(err, (size_t)t.nx * t.ny, "a terrain");
    const uint32_t longest = t.nx > t.ny ? t.nx : t.ny;
    for (uint32_t j = 0; j <= t.ny; ++j) {
        for (uint32_t i = 0; i <= t.nx; ++i) {
            const double x = (double)i / longest, y = (double)j / longest;
            builder_vertex(&t.b, 2 * x - (double)t.nx / longest, 2 * y - (double)t.ny / longest,
                           height(options->seed, x, y));
        }
    }
    add_faces(&t, options->seed);
    free(t.edited);
    return builder_finish(&t.b, mesh, err);
}
