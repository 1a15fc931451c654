/* Streams in pieces: the same bits as whole ones, whatever the pieces, factors, plans and supports are; memory within bounds; ends
 * that the consumer asks for; refusals. */
#include "host/device/device.h"
#include "host/frame/frame.h"
#include "host/frame/grids.h"
#include "tests/check.h"

#include <string.h>

/* ---- Comparing pieces with the whole ---- */

typedef struct whole {
    qp_stream stream; /* of another frame, which lives on */
    uint64_t most;    /* samples of a patch */
} whole;

typedef struct comparison {
    const qp_stream *whole;
    size_t sample_bytes;
    uint64_t next_sample, next_triangle, room, calls, stop_after;
    uint32_t next_patch;
    int same;
} comparison;

static int same_bytes(const void *all, const void *piece, uint64_t first, uint64_t count, size_t size) {
    if ((all == NULL) != (piece == NULL)) return 0;
    return all == NULL || count == 0 ||
           memcmp((const char *)all + first * size, piece, (size_t)count * size) == 0;
}

static qp_status compare(void *context, const qp_chunk *chunk, qp_error *err) {
    comparison *c = context;
    const qp_stream *s = &chunk->stream, *w = c->whole;
    const uint64_t first = chunk->first_sample, n = s->n_samples;
    (void)err;
    c->same = c->same && first == c->next_sample && chunk->first_triangle == c->next_triangle &&
              chunk->first_patch >= c->next_patch && n > 0 && n <= c->room && first + n <= w->n_samples &&
              same_bytes(w->vertices, s->vertices, first, n, c->sample_bytes) &&
              same_bytes(w->derivatives, s->derivatives, first, n, c->sample_bytes) &&
              same_bytes(w->flags, s->flags, first, n, 1) &&
              same_bytes(w->uv, s->uv, first, n, 2 * sizeof(float)) &&
              same_bytes(w->sample_patch, s->sample_patch, first, n, sizeof(uint32_t)) &&
              (w->triangles == NULL) == (s->triangles == NULL);
    if (c->same && s->triangles != NULL) {
        const uint32_t *all = w->triangles + 3 * chunk->first_triangle;
        for (uint64_t i = 0; i < 3 * s->n_triangles; ++i)
            c->same = c->same && s->triangles[i] < n && s->triangles[i] + first == all[i];
    }
    c->next_sample += n;
    c->next_triangle += s->n_triangles;
    c->next_patch = chunk->first_patch + chunk->n_patches;
    return ++c->calls == c->stop_after ? QP_CHECK_FAILED : QP_OK;
}

static uint64_t largest_patch(const qp_stream *s) {
    uint64_t most = 0;
    for (uint64_t i = 0, j; i < s->n_samples; i = j) {
        for (j = i; j < s->n_samples && s->sample_patch[j] == s->sample_patch[i];) ++j;
        if (j - i > most) most = j - i;
    }
    return most;
}

/* Pieces of `room` samples, by a frame that may have evaluated other things before. */
static void check_pieces(qp_frame *frame, const qp_tessellation *tess, const whole *all, uint64_t room,
                         const char *what) {
    qp_error err = {0};
    const size_t sample_bytes = 6 * (all->stream.precision == QP_DOUBLE ? sizeof(double) : sizeof(float));
    comparison c = {.whole = &all->stream, .sample_bytes = sample_bytes, .room = room, .same = 1};
    qp_chunks sum;
    /* A few bytes too many change nothing. */
    if (!CHECK_OK(qp_frame_eval_chunks(frame, tess, room * sample_bytes + 5, compare, &c, &sum, &err), err)) {
        fprintf(stderr, "    %s, %llu samples a piece\n", what, (unsigned long long)room);
        return;
    }
    const int good = CHECK(c.same) && CHECK(c.next_sample == all->stream.n_samples) &&
                     CHECK(c.next_triangle == all->stream.n_triangles) && CHECK(sum.n_chunks == c.calls) &&
                     CHECK(sum.stream.n_samples == all->stream.n_samples) &&
                     CHECK(sum.stream.hash == all->stream.hash) &&
                     CHECK(sum.peak_vertex_bytes <= room * sample_bytes + sum.n_ghosts * sample_bytes) &&
                     CHECK(sum.stream.support_bytes <= all->stream.support_bytes || sum.n_ghosts > 0);
    if (!good)
        fprintf(stderr, "    %s, %llu samples a piece, %llu pieces\n", what, (unsigned long long)room,
                (unsigned long long)sum.n_chunks);
}

/* ---- Cases ---- */

static uint64_t next_random(uint64_t *seed) {
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return *seed >> 33;
}

static void check_case(qp_device *device, const qp_surface *surface, const qp_frame_options *options,
                       const qp_tessellation *tess, const char *what) {
    qp_error err = {0};
    qp_frame *frame = NULL, *pieces = NULL;
    whole all = {0};
    if (!CHECK_OK(qp_frame_create(device, surface, options, &frame, &err), err)) return;
    if (CHECK_OK(qp_frame_create(device, surface, options, &pieces, &err), err) &&
        CHECK_OK(qp_frame_eval(frame, tess, &all.stream, &err), err)) {
        all.most = largest_patch(&all.stream);
        const uint64_t total = all.stream.n_samples;
        const uint64_t rooms[] = {all.most, 3 * all.most + 1, total / 2 + all.most, total + 1};
        for (size_t i = 0; i < sizeof rooms / sizeof rooms[0]; ++i)
            check_pieces(pieces, tess, &all, rooms[i], what);
        /* Whole again, after pieces. */
        qp_stream again;
        if (CHECK_OK(qp_frame_eval(pieces, tess, &again, &err), err)) CHECK(again.hash == all.stream.hash);
    }
    qp_frame_free(pieces);
    qp_frame_free(frame);
}

static void random_factors(float *factors, size_t n, float low, float high, uint64_t seed) {
    for (size_t i = 0; i < n; ++i)
        factors[i] = low + (high - low) * (float)(next_random(&seed) & 0xffff) / 65535.0f;
}

static const struct {
    const char *kind;
    uint32_t n0, depth;
    uint64_t seed;
} meshes[] = {{"cube", 3, 0, 0},          {"torus", 8, 0, 0},       {"creased-torus", 7, 3, 0},
              {"fan", 9, 2, 0},           {"prism", 5, 0, 0},       {"terrain", 9, 4, 1},
              {"random-closed", 0, 0, 1}, {"random-open", 0, 3, 2}, {"random-open", 0, 0, 5},
              {"random-closed", 0, 2, 9}, {"irregular", 6, 0, 0},   {"irregular", 3, 3, 0}};

static void check_mesh(qp_device *device, size_t m) {
    const qp_generate_options generate = {
        .n = {meshes[m].n0, meshes[m].n0}, .sharpness = -1, .seed = meshes[m].seed, .faces = 60};
    const qp_surface_options with_depth = {.depth = meshes[m].depth};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_error err = {0};
    if (CHECK_OK(qp_mesh_generate(meshes[m].kind, &generate, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, &with_depth, &surface, &err), err)) {
        float *edges = malloc(sizeof(float) * mesh->n_edges),
              *patches = malloc(6 * sizeof(float) * mesh->n_patches);
        if (CHECK(edges != NULL && patches != NULL)) {
            random_factors(edges, mesh->n_edges, 1, 12, m + 1);
            random_factors(patches, 6 * (size_t)mesh->n_patches, -0.2f, 9, m + 1);
            const qp_tessellation cases[] = {{.factor = 1},
                                             {.factor = 6},
                                             {.factor = 7.3f, .spacing = QP_FRACTIONAL_ODD},
                                             {.factor = 5.5f, .spacing = QP_FRACTIONAL_EVEN},
                                             {.edge_factors = edges, .spacing = QP_EQUAL},
                                             {.edge_factors = edges, .spacing = QP_FRACTIONAL_EVEN},
                                             {.edge_factors = edges, .spacing = QP_FRACTIONAL_ODD},
                                             {.patch_factors = patches, .spacing = QP_FRACTIONAL_ODD},
                                             {.patch_factors = patches, .spacing = QP_EQUAL},
                                             {.tolerance = 3e-3, .factor = 12}};
            for (size_t c = m % 2; c < sizeof cases / sizeof cases[0]; c += CHECK_SANITIZED ? 3 : 1) {
                char what[80];
                const qp_frame_options options = {.precision = (m + c) % 2 ? QP_DOUBLE : QP_FLOAT,
                                                  .want_hash = 1,
                                                  .want_triangles = c % 3 != 0,
                                                  .want_derivatives = c % 3 != 1,
                                                  .no_sharing = (m + c) % 7 == 6,
                                                  .no_regular_pass = (m + c) % 5 == 4,
                                                  .no_exact_tail = (m + c) % 11 == 10};
                snprintf(what, sizeof what, "%s %zu, case %zu", meshes[m].kind, m, c);
                check_case(device, surface, &options, &cases[c], what);
            }
        }
        free(edges);
        free(patches);
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* ---- Supports ---- */

static void test_supports(qp_device *device) {
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_error err = {0};
    const qp_generate_options generate = {.n = {10, 10}, .sharpness = -1};
    const qp_tessellation tess = {.factor = 9};
    if (CHECK_OK(qp_mesh_generate("irregular", &generate, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        static const qp_supports_options kinds[] = {
            {.kind = QP_SUPPORTS_SCRATCH},
            {.kind = QP_SUPPORTS_RING, .ring_bytes = 1 << 16, .canaries = 1},
            {.kind = QP_SUPPORTS_RING, .ring_bytes = 1 << 16, .schedule = QP_SCHEDULE_STREAMED},
            {.kind = QP_SUPPORTS_CACHE},
            {.kind = QP_SUPPORTS_CACHE, .cache_policy = QP_CACHE_CLOCK, .cache_bytes = 1 << 16}};
        for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; ++i) {
            char what[40];
            const qp_frame_options options = {.want_hash = 1, .supports = kinds[i]};
            snprintf(what, sizeof what, "supports %zu", i);
            check_case(device, surface, &options, &tess, what);
        }
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* ---- Rims ---- */

/* How far round the patch a point of its perimeter is, counter-clockwise from (0,0). */
static double around(const float *uv) {
    if (uv[1] == 0 && uv[0] < 1) return (double)uv[0];
    if (uv[0] == 1 && uv[1] < 1) return 1 + (double)uv[1];
    if (uv[1] == 1 && uv[0] > 0) return 3 - (double)uv[0];
    return uv[0] == 0 ? 4 - (double)uv[1] : -1;
}

/* A rim runs once around, whatever the factors are: inner factors of 1 put points behind the rim on the perimeter too. */
static void test_rims(void) {
    uint64_t seed = 3;
    size_t bad = 0;
    for (uint32_t i = 0; i < (CHECK_SANITIZED ? 300 : 3000); ++i) {
        qp_grids grids = {.spacing = (qp_spacing)(i % 3)};
        float f[QP_GRID_FACTORS] = {[6] = QP_GRID_WHOLE};
        qp_error err = {0};
        for (int k = 0; k < 6; ++k)
            f[k] = next_random(&seed) % 3 == 0 ? 1 + 0.5f * (float)(next_random(&seed) % 4)
                                               : 1 + (float)(next_random(&seed) % 1000) / 100;
        qp_grids_find(&grids, f);
        if (CHECK_OK(qp_grids_make(&grids, &err), err)) {
            const qp_grid *grid = &grids.list[0];
            double before = -1;
            unsigned wraps = 0;
            for (uint32_t k = 0; k < grid->rim.count; ++k) {
                const double here = around(grid->tess.uv + 2 * (size_t)k);
                wraps += here <= before;
                bad += here < 0;
                before = here;
            }
            bad += wraps > 1;
            for (uint32_t k = 0; k < 4; ++k) {
                const float *corner = grid->tess.uv + 2 * (size_t)grid->rim.corner[k];
                bad += corner[0] != (k == 1 || k == 2) || corner[1] != (k >= 2);
            }
        }
        qp_grids_clear(&grids);
    }
    CHECK(bad == 0);
}

/* ---- Hashes, ends, refusals ---- */

static void test_hasher(void) {
    const size_t lengths[] = {0, 1, 7, 1 << 20, (1 << 20) + 1, 3u << 20, (5u << 20) + 12345};
    const size_t most = lengths[sizeof lengths / sizeof lengths[0] - 1];
    char *bytes = malloc(most);
    uint64_t seed = 1, *hashes = malloc(8 * sizeof *hashes);
    qp_error err = {0};
    if (!CHECK(bytes != NULL && hashes != NULL)) return;
    for (size_t i = 0; i < most; ++i) bytes[i] = (char)next_random(&seed);
    for (size_t l = 0; l < sizeof lengths / sizeof lengths[0]; ++l) {
        /* As it is defined: a hash of the hashes of the blocks. */
        size_t n = 0;
        for (size_t at = 0; at < lengths[l]; at += 1 << 20, ++n)
            hashes[n] = qp_hash(bytes + at, lengths[l] - at < 1 << 20 ? lengths[l] - at : 1 << 20, n);
        const uint64_t expected = qp_hash(hashes, n * sizeof *hashes, lengths[l]);
        for (int way = 0; way < 4; ++way) {
            qp_stream_hasher *hasher = NULL;
            if (!CHECK_OK(qp_stream_hasher_create(&hasher, &err), err)) break;
            for (size_t at = 0, count; at < lengths[l]; at += count) {
                count = way == 0   ? lengths[l]
                        : way == 1 ? (size_t)(next_random(&seed) % 70000) + 1
                        : way == 2 ? (size_t)(next_random(&seed) % 3000000)
                                   : (size_t)1 << 20;
                if (count > lengths[l] - at) count = lengths[l] - at;
                CHECK_OK(qp_stream_hasher_add(hasher, bytes + at, count, &err), err);
                if (way == 2) qp_stream_hasher_value(hasher); /* asking on the way changes nothing */
            }
            CHECK(qp_stream_hasher_value(hasher) == expected);
            qp_stream_hasher_free(hasher);
        }
    }
    free(bytes);
    free(hashes);
}

static qp_status refuse(void *context, const qp_chunk *chunk, qp_error *err) {
    int *calls = context;
    (void)chunk;
    ++*calls;
    return qp_fail(err, QP_SYSTEM, "the disk is full");
}

static void test_ends(qp_device *device) {
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_error err = {0};
    qp_chunks sum;
    const qp_frame_options options = {.want_hash = 1};
    const qp_tessellation tess = {.factor = 4};
    if (CHECK_OK(qp_mesh_generate("cube", NULL, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) {
        qp_stream whole_stream;
        const uint64_t patch_bytes = 25 * 6 * sizeof(float); /* 5 x 5 samples */
        qp_frame *other = NULL;
        if (CHECK_OK(qp_frame_create(device, surface, &options, &other, &err), err) &&
            CHECK_OK(qp_frame_eval(other, &tess, &whole_stream, &err), err)) {
            comparison c = {
                .whole = &whole_stream, .sample_bytes = 24, .room = 25, .same = 1, .stop_after = 4};
            CHECK(qp_frame_eval_chunks(frame, &tess, patch_bytes, compare, &c, &sum, &err) ==
                  QP_CHECK_FAILED);
            CHECK(c.calls == 4 && c.same && sum.n_chunks == 4 && sum.stream.n_samples == 100 &&
                  sum.stream.hash == 0);
            CHECK(err.status == QP_CHECK_FAILED && strstr(err.message, "consumer") != NULL);
        }
        qp_frame_free(other);
        int calls = 0;
        CHECK(qp_frame_eval_chunks(frame, &tess, 2 * patch_bytes, refuse, &calls, &sum, &err) == QP_SYSTEM);
        CHECK(calls == 1 && strcmp(err.message, "the disk is full") == 0);
        /* One byte short of a patch; the consumer sees nothing. */
        calls = 0;
        CHECK(qp_frame_eval_chunks(frame, &tess, patch_bytes - 1, refuse, &calls, &sum, &err) ==
              QP_BAD_INPUT);
        CHECK(calls == 0 && strstr(err.message, "25 samples") != NULL);
        CHECK(qp_frame_eval_chunks(frame, &tess, 0, refuse, &calls, &sum, &err) == QP_BAD_INPUT &&
              calls == 0);
        const qp_tessellation bad = {.factor = 65};
        CHECK(qp_frame_eval_chunks(frame, &bad, 1 << 20, refuse, &calls, &sum, &err) == QP_BAD_INPUT &&
              calls == 0);
        /* Without a consumer and a report, and after all that. */
        CHECK_OK(qp_frame_eval_chunks(frame, &tess, patch_bytes, NULL, NULL, &sum, &err), err);
        CHECK(sum.stream.hash == whole_stream.hash && sum.n_chunks == 6);
        CHECK_OK(qp_frame_eval_chunks(frame, &tess, patch_bytes, NULL, NULL, NULL, &err), err);
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* ---- A large mesh ---- */

/* A line of /proc/self/status, in bytes. */
static uint64_t memory_of(const char *name) {
    char line[200];
    unsigned long long kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (strncmp(line, name, strlen(name)) == 0) kilobytes = strtoull(line + strlen(name), NULL, 10);
    }
    if (file != NULL) fclose(file);
    return kilobytes * 1024;
}

/* Makes VmHWM begin anew at what is in use now. */
static int forget_peak(void) {
    FILE *file = fopen("/proc/self/clear_refs", "w");
    return file != NULL && (fputs("5", file) >= 0) + (fclose(file) == 0) == 2;
}

static qp_status count_samples(void *context, const qp_chunk *chunk, qp_error *err) {
    uint64_t *n = context;
    (void)err;
    *n += chunk->stream.n_samples;
    return QP_OK;
}

/* n x n cells, n^2 * 6 patches. With QUADPLAN_FULL 2 million patches at factor 64, 8.4 * 10^9 samples, in a 4 MB ring: some
 * minutes. */
static void test_large(qp_device *device, uint32_t n, float factor) {
    const uint64_t chunk_bytes = 16u << 20, most = 64u << 20;
    const qp_generate_options generate = {.n = {n, n}, .sharpness = -1};
    const qp_frame_options options = {.want_hash = 1,
                                      .supports = {.kind = QP_SUPPORTS_RING, .ring_bytes = 4u << 20}};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_error err = {0};
    qp_chunks sum = {0};
    if (CHECK_OK(qp_mesh_generate("irregular", &generate, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) {
        const qp_tessellation tess = {.factor = factor}, least = {.factor = 1};
        uint64_t samples = 0;
        /* The first launch compiles kernels. */
        CHECK_OK(qp_frame_eval_chunks(frame, &least, 1 << 20, NULL, NULL, NULL, &err), err);
        const int counted = forget_peak();
        const uint64_t before = memory_of("VmRSS:");
        const double start = qp_now_ms();
        if (CHECK_OK(qp_frame_eval_chunks(frame, &tess, chunk_bytes, count_samples, &samples, &sum, &err),
                     err)) {
            const uint64_t peak = memory_of("VmHWM:"), grown = counted && peak > before ? peak - before : 0;
            CHECK(samples == sum.stream.n_samples &&
                  samples == ((uint64_t)factor + 1) * ((uint64_t)factor + 1) * mesh->n_patches);
            CHECK(surface->regular_plan == QP_NONE && surface->n_plans > 4);
            CHECK(sum.stream.supports.capacity_bytes <= 4u << 20);
            CHECK(sum.peak_vertex_bytes + sum.stream.supports.capacity_bytes <= most);
            /* Beside those: flags, (u,v) and patches of a piece; steps, factors and hashes of all. */
            CHECK(grown <= most);
            printf("%u patches, %llu samples in %llu pieces, %.3f%% ghosts: %.1f s (set-up %.1f, consumer "
                   "%.1f); vertices %.1f MB, "
                   "supports %.1f MB, memory grew by %.1f MB; hash %016llx\n",
                   mesh->n_patches, (unsigned long long)samples, (unsigned long long)sum.n_chunks,
                   100.0 * (double)sum.n_ghosts / (double)samples, (qp_now_ms() - start) * 1e-3,
                   sum.set_up_ms * 1e-3, sum.consumer_ms * 1e-3, (double)sum.peak_vertex_bytes * 1e-6,
                   (double)sum.stream.supports.capacity_bytes * 1e-6, (double)grown * 1e-6,
                   (unsigned long long)sum.stream.hash);
        }
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    qp_device *host = NULL, *standard = NULL;
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    const char *full = getenv("QUADPLAN_FULL");
    if (full != NULL && full[0] == '1' && qp_device_open(NULL, &standard, &err) == QP_OK)
        test_large(standard, 578, 64);
    else
        test_large(host, CHECK_SANITIZED ? 8 : 30, 16);
    qp_device_free(standard);
    test_hasher();
    test_rims();
    test_ends(host);
    for (size_t m = 0; m < sizeof meshes / sizeof meshes[0]; ++m) check_mesh(host, m);
    test_supports(host);
    qp_device_free(host);
    return check_report();
}
