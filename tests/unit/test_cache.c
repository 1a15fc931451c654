/* The cache of control points (kernels/cached_hull.cl, section 8.2 of the paper): the same bits as scratch for all policies and sizes;
 * what is computed, what is kept, and exactly what moved vertices make invalid. QUADPLAN_FULL=1 runs all models, many times.
 *
 *   test_cache --threads   only what the device "host" runs, on many threads: also built with ThreadSanitizer */
#define _GNU_SOURCE
#include "host/base/random.h"
#include "host/frame/frame.h"
#include "host/plan/build.h"
#include "kernels/cache_layout.h"
#include "kernels/frame_layout.h"
#include "tests/check.h"

#include <string.h>

#if defined(__SANITIZE_THREAD__)
enum { SLOW = 1 };
#else
enum { SLOW = CHECK_SANITIZED };
#endif

static bool full;
static qp_error err;

static void set_threads(unsigned n) {
    char text[20];
    snprintf(text, sizeof text, "%u", n);
    setenv("QUADPLAN_THREADS", text, 1);
}

static qp_frame_options options_of(qp_precision precision, qp_supports_options supports) {
    return (qp_frame_options){.precision = precision, .want_hash = 1, .supports = supports};
}

static qp_tessellation uniform(float factor) {
    return (qp_tessellation){.factor = factor};
}

/* Hash of the stream of a frame of its own with scratch. */
static uint64_t scratch_hash(qp_device *device, const qp_surface *surface, qp_precision precision,
                             float factor, uint64_t *needed) {
    const qp_frame_options options = options_of(precision, (qp_supports_options){0});
    const qp_tessellation t = uniform(factor);
    qp_frame *frame;
    qp_stream stream;
    uint64_t hash = 0;
    if (!CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) return 0;
    if (CHECK_OK(qp_frame_eval(frame, &t, &stream, &err), err)) hash = stream.hash;
    if (needed != NULL) *needed = stream.supports.points_needed;
    qp_frame_free(frame);
    return hash;
}

static void check_counters(const qp_supports_report *r, uint64_t needed) {
    CHECK(r->kind == QP_SUPPORTS_CACHE && r->points_needed == needed);
    CHECK(r->hits + r->points_computed == r->points_needed);
    CHECK(r->misses_cold + r->misses_capacity + r->misses_conflict == r->points_computed);
    CHECK(r->duplicates <= r->points_computed);
}

/* Two evaluations with one frame, and one with another factor in between. */
static void check_policy(qp_device *device, const qp_surface *surface, qp_precision precision,
                         qp_supports_options supports, float factor, uint64_t want, uint64_t needed) {
    const qp_frame_options options = options_of(precision, supports);
    const qp_tessellation t = uniform(factor), other = uniform(factor / 2 + 1);
    qp_frame *frame;
    qp_stream s;
    if (!CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) return;
    const bool all = supports.cache_policy == QP_CACHE_ALL;
    for (int pass = 0; pass < 2; ++pass) {
        if (!CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err)) break;
        if (!CHECK(s.hash == want))
            fprintf(stderr, "    policy %d, %llu bytes\n", supports.cache_policy,
                    (unsigned long long)supports.cache_bytes);
        check_counters(&s.supports, needed);
        CHECK(s.supports.invalidated == 0 && s.supports.peak_bytes <= s.supports.capacity_bytes);
        CHECK(all || s.supports.capacity_bytes <= supports.cache_bytes);
        const uint64_t kept = s.supports.points_computed - s.supports.duplicates;
        if (all && pass == 0)
            CHECK(s.supports.peak_bytes == kept * 4 * frame->real_size &&
                  s.supports.misses_cold == s.supports.points_computed);
        if (all && pass == 1) CHECK(s.supports.points_computed == 0);
        if (pass == 1) CHECK(s.supports.misses_cold == 0);
        CHECK_OK(qp_frame_eval(frame, &other, &s, &err), err);
    }
    qp_frame_free(frame);
}

static qp_surface *surface_of(const qp_mesh *mesh, uint32_t depth) {
    const qp_surface_options options = {.depth = depth};
    qp_surface *surface = NULL;
    CHECK_OK(qp_surface_create(mesh, &options, &surface, &err), err);
    return surface;
}

/* All policies, from nothing to more room than there are points. */
static void check_policies(qp_device *device, const qp_mesh *mesh, qp_precision precision, float factor,
                           bool few) {
    static const uint64_t sizes[] = {0, 24, 200, 4000, 65536, 1 << 24};
    qp_surface *surface = surface_of(mesh, 6);
    if (surface == NULL) return;
    uint64_t needed;
    const uint64_t want = scratch_hash(device, surface, precision, factor, &needed);
    check_policy(device, surface, precision, (qp_supports_options){.kind = QP_SUPPORTS_CACHE}, factor, want,
                 needed);
    for (int policy = QP_CACHE_DIRECT; policy <= QP_CACHE_SHARED; ++policy) {
        for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; ++k) {
            if (few && k % 2 == 0) continue;
            const qp_supports_options supports = {.kind = QP_SUPPORTS_CACHE,
                                                  .cache_policy = (qp_cache_policy)policy,
                                                  .cache_bytes = sizes[k],
                                                  .issue_order = (qp_issue_order)(k % 2)};
            check_policy(device, surface, precision, supports, factor, want, needed);
        }
    }
    qp_surface_free(surface);
}

/* ---- vertices that move ---- */

/* A coordinate as the device has it. */
static float local_of(const qp_mesh *mesh, const qp_local_frame *f, size_t i) {
    return (float)ldexp(mesh->positions[i] - f->centre[i % 3], -f->exponent);
}

/* Numbers that depend on a moved vertex, by going through all patches' stencils as the device has them. */
static void brute_force(const qp_frame *frame, const uint8_t *moved, uint8_t *marks) {
    const qp_surface *surface = frame->surface;
    qp_plan_pack pack;
    if (!CHECK_OK(qp_surface_pack(&surface, 1, QP_FLOAT, &pack, &err), err)) return;
    for (uint32_t p = 0; p < surface->mesh->n_patches; ++p) {
        const uint32_t index = surface->patch_plan[p];
        if (index == QP_NONE || index == surface->regular_plan) continue;
        const qp_plan *plan = surface->plans[index];
        const uint32_t *ring = surface->rings + surface->patch_ring[p];
        const float *weights = (const float *)pack.reals + pack.heads[index * QP_HEAD_WORDS + QP_HEAD_REALS];
        const qp_unique *u = frame->cache.unique;
        const uint32_t *anchors = u->rings + u->ring_of[p] + 2 * plan->ring_size;
        for (uint32_t i = 0; i < plan->point_count; ++i) {
            const uint32_t corner =
                (plan->flags & QP_PLAN_ANCHORS) != 0 ? plan->point_anchors[i] & 3u : plan->base;
            bool depends = moved[anchors[corner]] != 0;
            for (uint32_t j = 0; j < plan->ring_size && !depends; ++j)
                depends = moved[ring[j]] && weights[(size_t)j * plan->point_count + i] != 0;
            if (depends) marks[u->numbers[u->first[p] + i]] = 1;
        }
    }
    free(pack.heads);
    free(pack.tree);
    free(pack.reals);
}

/* Moves some vertices of the mesh; tells which have other bits on the device then. */
static void move_vertices(qp_mesh *mesh, qp_random *random, uint32_t count, uint8_t *moved) {
    const qp_local_frame before = qp_mesh_local_frame(mesh);
    double *old = qp_alloc(3 * (size_t)mesh->n_vertices, sizeof *old, false);
    if (!CHECK(old != NULL)) exit(1);
    memcpy(old, mesh->positions, 3 * (size_t)mesh->n_vertices * sizeof *old);
    for (uint32_t k = 0; k < count; ++k) {
        const size_t at = 3 * (size_t)qp_random_below(random, mesh->n_vertices) + qp_random_below(random, 3);
        mesh->positions[at] += (qp_random_unit(random) - 0.5) * 0.01 * mesh->diagonal;
    }
    const qp_local_frame after = qp_mesh_local_frame(mesh);
    double *now = mesh->positions;
    memset(moved, 0, mesh->n_vertices);
    for (size_t i = 0; i < 3 * (size_t)mesh->n_vertices; ++i) {
        const float b = local_of(mesh, &after, i);
        mesh->positions = old;
        const float a = local_of(mesh, &before, i);
        mesh->positions = now;
        if (memcmp(&a, &b, sizeof a) != 0) moved[i / 3] = 1;
    }
    free(old);
}

/* How many marked points the layout's patches need. */
static uint64_t count_needed(const qp_frame *frame, uint8_t *marks) {
    const qp_unique *u = frame->cache.unique;
    uint64_t count = 0;
    for (size_t k = 0; k < frame->layout.n_items; ++k) {
        const qp_frame_item *item = &frame->layout.items[k];
        const uint64_t first = u->first[item->patch];
        const uint32_t rows =
            first == UINT64_MAX ? 0 : qp_frame_plan_of(frame, item->patch).plan->rows[item->level];
        for (uint32_t i = 0; i < rows; ++i) {
            count += marks[u->numbers[first + i]];
            marks[u->numbers[first + i]] = 0;
        }
    }
    return count;
}

/* One policy, evaluations and moves in any order, against fresh frames. */
static void check_moves(qp_device *device, qp_mesh *mesh, qp_supports_options supports, uint64_t seed,
                        int steps) {
    qp_surface *surface = surface_of(mesh, 6);
    const qp_frame_options options = options_of(QP_FLOAT, supports);
    qp_frame *frame = NULL;
    qp_random random = {seed};
    uint8_t *moved = qp_alloc(mesh->n_vertices, 1, true);
    if (surface != NULL) CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err);
    for (int k = 0; k < steps && frame != NULL && CHECK(moved != NULL); ++k) {
        const float factors[] = {1, 2, 3, 5, 8, 16};
        const float factor = factors[qp_random_below(&random, 6)];
        const qp_tessellation t = uniform(factor);
        uint64_t needed;
        qp_stream s;
        if (!CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err)) break;
        const uint64_t want = scratch_hash(device, surface, QP_FLOAT, factor, &needed);
        CHECK(s.hash == want);
        check_counters(&s.supports, needed);
        if (qp_random_below(&random, 3) == 0) continue;
        const qp_unique *u = frame->cache.unique;
        const bool all = supports.cache_policy == QP_CACHE_ALL;
        uint32_t *tags = qp_alloc(u->n_points, sizeof *tags, true),
                 *later = qp_alloc(u->n_points, sizeof *later, true);
        uint8_t *marks = qp_alloc(u->n_points, 1, true);
        if (!CHECK(tags != NULL && later != NULL && marks != NULL)) exit(1);
        const size_t bytes = all ? u->n_points * sizeof *tags : 0;
        CHECK_OK(qp_buffer_read(device, &frame->cache.tags, 0, tags, bytes, &err), err);
        move_vertices(mesh, &random, 1 + (uint32_t)qp_random_below(&random, 2), moved);
        brute_force(frame, moved, marks);
        if (!CHECK_OK(qp_frame_update_positions(frame, &err), err)) break;
        CHECK_OK(qp_buffer_read(device, &frame->cache.tags, 0, later, bytes, &err), err);
        uint64_t expected = 0, wrong = 0;
        for (uint32_t i = 0; i < u->n_points && all; ++i) {
            const uint32_t now = marks[i] ? QP_CACHE_EMPTY : tags[i];
            wrong += later[i] != now;
            expected += marks[i] && tags[i] == QP_CACHE_VALID;
        }
        CHECK(wrong == 0);
        /* What was thrown out, and no more, is computed again. */
        if (!CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err)) break;
        CHECK(s.hash == scratch_hash(device, surface, QP_FLOAT, factor, NULL));
        const uint64_t again = count_needed(frame, marks);
        if (all)
            CHECK(s.supports.invalidated == expected &&
                  s.supports.points_computed - s.supports.duplicates == again);
        free(tags);
        free(later);
        free(marks);
    }
    free(moved);
    qp_frame_free(frame);
    qp_surface_free(surface);
}

/* Deeper plans on demand: points of their own, and those of the surface stay. */
static void check_deep(qp_device *device, const qp_mesh *mesh) {
    qp_surface *surface = surface_of(mesh, 2);
    const qp_supports_options cached = {.kind = QP_SUPPORTS_CACHE};
    const qp_frame_options options[2] = {options_of(QP_FLOAT, cached),
                                         options_of(QP_FLOAT, (qp_supports_options){0})};
    qp_frame *frame[2] = {NULL, NULL};
    qp_stream s[2];
    if (surface == NULL) return;
    for (int k = 0; k < 2; ++k) CHECK_OK(qp_frame_create(device, surface, &options[k], &frame[k], &err), err);
    enum { POINTS = 64 };
    uint32_t patch[POINTS];
    double uv[2 * POINTS];
    for (uint32_t i = 0; i < POINTS; ++i) {
        patch[i] = i * 7 % mesh->n_patches;
        uv[2 * i] = ldexp(1.0, -(int)(i % 24));
        uv[2 * i + 1] = ldexp(0.7, -(int)(i % 24));
    }
    const qp_tessellation low = uniform(3), high = uniform(32);
    for (int round = 0; round < 3; ++round) {
        for (int k = 0; k < 2; ++k) CHECK_OK(qp_frame_eval(frame[k], &low, &s[k], &err), err);
        CHECK(s[0].hash == s[1].hash && (round < 2 || s[0].supports.points_computed == 0));
        if (round == 1) CHECK(s[0].supports.hits > 0);
        for (int k = 0; k < 2; ++k)
            CHECK_OK(qp_frame_eval_points(frame[k], POINTS, patch, uv, &s[k], &err), err);
        CHECK(s[0].hash == s[1].hash && (round < 2 || s[0].supports.points_computed == 0));
        for (int k = 0; k < 2; ++k) CHECK_OK(qp_frame_eval(frame[k], &high, &s[k], &err), err);
        CHECK(s[0].hash == s[1].hash && (round < 2 || s[0].supports.points_computed == 0));
    }
    for (int k = 0; k < 2; ++k) qp_frame_free(frame[k]);
    qp_surface_free(surface);
}

/* ---- the paper's numbers ---- */

static qp_mesh *model(const char *name) {
    char path[1024];
    qp_mesh *mesh = NULL;
    snprintf(path, sizeof path, "%s/%s.obj", check_models(), name);
    CHECK_OK(qp_mesh_read_obj(path, NULL, &mesh, &err), err);
    return mesh;
}

/* docs/subdivision-cache.md explains these, kind by kind. */
static void check_big_guy(qp_device *device) {
    qp_mesh *mesh = model("bigguy");
    if (mesh == NULL) return;
    qp_surface *surface = surface_of(mesh, 6);
    const qp_frame_options options = options_of(QP_FLOAT, (qp_supports_options){.kind = QP_SUPPORTS_CACHE});
    qp_frame *frame = NULL;
    qp_surface_info info;
    const qp_tessellation t = uniform(64);
    qp_stream s;
    CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err);
    CHECK_OK(qp_surface_get_info(surface, &info, &err), err);
    CHECK(info.control_points[6] == 105648 && info.unique_control_points[6] == 50373);
    CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err);
    CHECK(s.supports.points_needed == 104586 && s.supports.points_computed - s.supports.duplicates == 56525);
    CHECK_OK(qp_frame_eval(frame, &t, &s, &err), err);
    CHECK(s.supports.points_computed == 0);
    /* Distinct points by kind, and of refined ones by level. */
    const qp_unique *u = frame->cache.unique;
    uint8_t *kinds = qp_alloc(u->n_points, 1, true);
    uint32_t refined[7] = {0}, limits = 0, tangents = 0;
    for (uint32_t p = 0; p < mesh->n_patches && CHECK(kinds != NULL); ++p) {
        if (u->first[p] == UINT64_MAX) continue;
        const qp_plan *plan = surface->plans[surface->patch_plan[p]];
        for (uint32_t i = 0; i < plan->point_count; ++i)
            kinds[u->numbers[u->first[p] + i]] = plan->point_kinds[i];
    }
    for (uint32_t i = 0; i < u->n_points && kinds != NULL; ++i) {
        const uint32_t kind = kinds[i] & 3u;
        if (kind == QP_POINT_REFINED && kinds[i] >> 2 < 7) ++refined[kinds[i] >> 2];
        limits += kind == QP_POINT_LIMIT;
        tangents += kind == QP_POINT_TANGENT;
    }
    CHECK(refined[1] == 8202 && refined[2] == 8543 && limits == 196 && tangents == 1552);
    for (int level = 3; level <= 6; ++level) CHECK(refined[level] == 9508);
    free(kinds);
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* ---- ---- */

static qp_mesh *generated(const char *kind, uint64_t seed, uint32_t faces) {
    const qp_generate_options options = {.sharpness = -1, .seed = seed, .faces = faces};
    qp_mesh *mesh = NULL;
    CHECK_OK(qp_mesh_generate(kind, &options, &mesh, &err), err);
    return mesh;
}

/* On the device host, where work-groups are threads' work: many more threads than processors, small caches. */
static void check_threads(qp_device *device) {
    const char *const kinds[] = {"random-closed", "random-open", "fan"};
    for (uint32_t k = 0; k < (SLOW ? 2u : 3u); ++k) {
        qp_mesh *mesh = generated(kinds[k], 3 + k, full ? 150 : 50);
        if (mesh == NULL) continue;
        set_threads(8);
        check_policies(device, mesh, k == 1 ? QP_DOUBLE : QP_FLOAT, 7, SLOW || k != 0);
        for (int policy = QP_CACHE_ALL; policy <= QP_CACHE_SHARED; ++policy) {
            const qp_supports_options supports = {
                .kind = QP_SUPPORTS_CACHE, .cache_policy = (qp_cache_policy)policy, .cache_bytes = 4096};
            set_threads(policy == QP_CACHE_CLOCK ? 1 : 8);
            check_moves(device, mesh, supports, 10 * k + (uint64_t)policy, full ? 100 : SLOW ? 2 : 4);
        }
        qp_mesh_free(mesh);
    }
}

static void check_models_of(qp_device *device) {
    static const char *const names[] = {"monsterfrog", "rook", "bishop", "bigguy", "armorguy"};
    for (uint32_t k = 0; k < (full ? 5u : SLOW ? 0u : 1u); ++k) {
        qp_mesh *mesh = model(names[k]);
        if (mesh == NULL) continue;
        check_policies(device, mesh, QP_FLOAT, 8, !full);
        check_moves(device, mesh, (qp_supports_options){.kind = QP_SUPPORTS_CACHE}, k, full ? 30 : 2);
        qp_mesh_free(mesh);
    }
}

int main(int argc, char **argv) {
    const bool threads = argc > 1 && strcmp(argv[1], "--threads") == 0;
    const char *all = getenv("QUADPLAN_FULL");
    full = all != NULL && all[0] == '1';
    qp_device *host, *device;
    if (!CHECK_OK(qp_device_open("host", &host, &err), err)) return check_report();
    check_threads(host);
    if (!threads) {
        set_threads(2);
        qp_mesh *mesh = generated("random-closed", 9, 120), *prism = generated("prism", 0, 0);
        check_deep(host, mesh);
        check_deep(host, prism);
        if (check_models() != NULL) {
            check_models_of(host);
            if (!SLOW) check_big_guy(host);
        } else {
            printf("skipped: QUADPLAN_MODELS not set\n");
        }
        if (!SLOW && CHECK_OK(qp_device_open(NULL, &device, &err), err)) {
            check_policies(device, prism, QP_FLOAT, 6, true);
            check_moves(device, prism, (qp_supports_options){.kind = QP_SUPPORTS_CACHE}, 5, 6);
            qp_device_free(device);
        }
        qp_mesh_free(mesh);
        qp_mesh_free(prism);
    }
    qp_device_free(host);
    return check_report();
}
