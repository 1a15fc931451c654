/* The same bits on both sides of every edge and around every vertex, as qp_watertight_check finds from the mesh's faces alone: every
 * model, random meshes with a random factor for every edge, renumbered meshes, patch factors that do not fit, points at any place; and
 * the check fails when something is wrong. QUADPLAN_FULL=1 takes the models at factor 64 too, and larger random meshes;
 * QUADPLAN_SEEDS=A-B picks the random ones. */
#include "host/base/random.h"
#include "host/frame/frame.h"
#include "host/reference/watertight.h"
#include "tests/check.h"
#include "tests/unit/mesh_files.h"

#include <string.h>

static qp_device *device;
static bool full;

static struct { uint64_t streams, edges, samples, skipped; } sum;

/* One evaluation, checked. */
static bool evaluate(const qp_mesh *mesh, const qp_surface *surface, const qp_frame_options *options,
                     const qp_tessellation *tessellation, qp_watertight_report *report) {
    qp_error err = {0};
    qp_frame *frame = NULL;
    qp_stream stream;
    bool good = CHECK_OK(qp_frame_create(device, surface, options, &frame, &err), err) &&
                CHECK_OK(qp_frame_eval(frame, tessellation, &stream, &err), err) &&
                CHECK_OK(qp_watertight_check(mesh, &stream, report, &err), err);
    qp_frame_free(frame);
    return good;
}

static void check_holds(const char *name, const qp_mesh *mesh, const qp_surface *surface,
                        qp_precision precision, const qp_tessellation *tessellation) {
    qp_watertight_report r;
    const qp_frame_options options = {.precision = precision};
    if (!evaluate(mesh, surface, &options, tessellation, &r)) return;
    ++sum.streams;
    sum.edges += r.edges;
    sum.samples += r.samples;
    sum.skipped += r.sharp_edges_skipped;
    if (CHECK(qp_watertight_holds(&r))) return;
    printf("%s, %s, spacing %d, factor %g: %llu positions, %llu normals, %llu unmatched; patch %u (%g, %g)\n",
           name, precision == QP_DOUBLE ? "double" : "float", (int)tessellation->spacing,
           (double)tessellation->factor, (unsigned long long)r.position_mismatches,
           (unsigned long long)r.normal_mismatches, (unsigned long long)r.unmatched_samples, r.worst_patch,
           (double)r.worst_u, (double)r.worst_v);
}

/* ---- Models ---- */

static void check_model(const char *name, qp_mesh *mesh) {
    static const float factors[] = {5, 7, 16, 64};
    qp_error err = {0};
    qp_surface *surface = NULL;
    if (!CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) return;
    const bool large = mesh->n_patches > 1000;
    for (int f = 0; f < 4; ++f) {
        for (int spacing = QP_EQUAL; spacing <= QP_FRACTIONAL_ODD; ++spacing) {
            for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
                if (!full && large && (f + spacing + precision) % (f == 2 ? 6 : 3) != 0) continue;
                if (!full && factors[f] == 64 && (mesh->n_patches > 100 || precision != QP_FLOAT)) continue;
                if (CHECK_SANITIZED && (large || factors[f] > 7)) continue;
                check_holds(name, mesh, surface, (qp_precision)precision,
                            &(qp_tessellation){.spacing = (qp_spacing)spacing, .factor = factors[f]});
            }
        }
    }
    qp_surface_free(surface);
}

/* ---- Random meshes ---- */

static void random_factors(float *factors, size_t count, float most, qp_random *random) {
    for (size_t i = 0; i < count; ++i) {
        const double x = qp_random_unit(random);
        factors[i] = (float)(1 + (double)(most - 1) * x * x);
        if (qp_random_chance(random, 0.3)) factors[i] = roundf(factors[i]);
    }
}

/* The same mesh with other numbers: vertices and faces shuffled, faces turned. */
static qp_mesh *renumbered(const qp_mesh *mesh, qp_random *random) {
    const uint32_t nv = mesh->n_vertices, nf = mesh->n_faces;
    uint32_t *vertex = malloc((nv + 1) * sizeof *vertex), *order = malloc(nf * sizeof *order);
    uint32_t *face = malloc(nf * sizeof *face), *sizes = malloc(nf * sizeof *sizes);
    uint32_t *corners = malloc(mesh->n_corners * sizeof *corners);
    uint32_t *creases = malloc((2 * (size_t)mesh->n_creases + 1) * sizeof *creases);
    uint32_t *tags = malloc((mesh->n_corner_tags + 1) * sizeof *tags);
    uint32_t *holes = malloc((mesh->n_hole_tags + 1) * sizeof *holes);
    double *positions = malloc((3 * (size_t)nv + 1) * sizeof *positions);
    qp_mesh *made = NULL;
    if (CHECK(vertex && order && face && sizes && corners && creases && tags && holes && positions)) {
        for (uint32_t i = 0; i < nv; ++i) vertex[i] = i;
        for (uint32_t i = 0; i < nf; ++i) order[i] = i;
        for (uint32_t i = nv; i > 1; --i) {
            const uint32_t j = qp_random_below(random, i), t = vertex[i - 1];
            vertex[i - 1] = vertex[j];
            vertex[j] = t;
        }
        for (uint32_t i = nf; i > 1; --i) {
            const uint32_t j = qp_random_below(random, i), t = order[i - 1];
            order[i - 1] = order[j];
            order[j] = t;
        }
        for (uint32_t i = 0; i < nv; ++i) memcpy(positions + 3 * vertex[i], mesh->positions + 3 * i, 24);
        size_t at = 0;
        for (uint32_t i = 0; i < nf; ++i) {
            const uint32_t f = order[i], n = qp_face_size(mesh, f), turn = qp_random_below(random, n);
            face[f] = i;
            sizes[i] = n;
            for (uint32_t k = 0; k < n; ++k)
                corners[at++] = vertex[mesh->face_vertices[mesh->face_offsets[f] + (k + turn) % n]];
        }
        for (uint32_t i = 0; i < 2 * mesh->n_creases; ++i) creases[i] = vertex[mesh->crease_vertices[i]];
        for (uint32_t i = 0; i < mesh->n_corner_tags; ++i) tags[i] = vertex[mesh->corner_tag_vertices[i]];
        for (uint32_t i = 0; i < mesh->n_hole_tags; ++i) holes[i] = face[mesh->hole_tag_faces[i]];
        const qp_mesh_desc desc = {nv,
                                   nf,
                                   positions,
                                   sizes,
                                   corners,
                                   mesh->n_creases,
                                   creases,
                                   mesh->crease_sharpness,
                                   mesh->n_corner_tags,
                                   tags,
                                   mesh->corner_tag_sharpness,
                                   mesh->n_hole_tags,
                                   holes,
                                   mesh->boundary,
                                   mesh->crease_method,
                                   mesh->triangle_rule};
        qp_error err = {0};
        if (!CHECK_OK(qp_mesh_create(&desc, &made, &err), err)) made = NULL;
    }
    free(vertex);
    free(order);
    free(face);
    free(sizes);
    free(corners);
    free(creases);
    free(tags);
    free(holes);
    free(positions);
    return made;
}

/* Patch factors without regard to neighbours: where samples do meet, they have the same bits, though patches be discarded that own
 * them. */
static void check_unmatched(const qp_mesh *mesh, const qp_surface *surface, qp_precision precision,
                            qp_random *random) {
    float *factors = malloc(6 * (size_t)mesh->n_patches * sizeof *factors);
    if (CHECK(factors != NULL)) {
        for (size_t i = 0; i < 6 * (size_t)mesh->n_patches; ++i)
            factors[i] = (float)(1 + qp_random_below(random, 12));
        for (uint32_t p = 0; p < mesh->n_patches; p += 5) factors[6 * p] = 0;
        qp_watertight_report r;
        const qp_tessellation tessellation = {.spacing = QP_EQUAL, .patch_factors = factors};
        const qp_frame_options options = {.precision = precision};
        if (evaluate(mesh, surface, &options, &tessellation, &r)) {
            CHECK(r.position_mismatches == 0 && r.normal_mismatches == 0);
            CHECK(r.unmatched_samples > 0 || r.edges == 0);
        }
    }
    free(factors);
}

static void check_random(unsigned seed) {
    qp_error err = {0};
    qp_mesh *mesh = NULL, *other = NULL;
    const qp_generate_options options = {.seed = seed, .sharpness = -1.0, .faces = full ? 200 : 30};
    if (!CHECK_OK(qp_mesh_generate(seed % 2 == 0 ? "random-closed" : "random-open", &options, &mesh, &err),
                  err))
        return;
    qp_random random = {seed};
    if (seed % 3 == 2 && (other = renumbered(mesh, &random)) != NULL) {
        qp_mesh_free(mesh);
        mesh = other;
    }
    qp_surface *surface = NULL;
    float *factors = malloc(mesh->n_edges * sizeof *factors);
    /* Deep enough for most of the factors; the patches that need more get deeper plans. */
    const qp_surface_options shallow = {.depth = 6};
    if (CHECK(factors != NULL) && CHECK_OK(qp_surface_create(mesh, &shallow, &surface, &err), err)) {
        char name[32];
        snprintf(name, sizeof name, "seed %u", seed);
        random_factors(factors, mesh->n_edges, full ? 64 : 20, &random);
        const qp_precision precision = seed / 2 % 2 == 0 ? QP_FLOAT : QP_DOUBLE;
        for (int spacing = QP_EQUAL; spacing <= QP_FRACTIONAL_ODD; ++spacing) {
            if (!full && spacing != (int)(seed / 4 % 3)) continue;
            check_holds(name, mesh, surface, precision,
                        &(qp_tessellation){.spacing = (qp_spacing)spacing, .edge_factors = factors});
        }
        if (seed % 16 == 1) check_unmatched(mesh, surface, precision, &random);
    }
    free(factors);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* ---- Points ---- */

/* The place t along half-edge h, from its start, on its face. Exact where t and 1 - t are. */
static void place_on(const qp_mesh *mesh, uint32_t h, double t, uint32_t *patch, double uv[2]) {
    const uint32_t face = mesh->corner_face[h], i = h - mesh->face_offsets[face],
                   first = mesh->patch_offsets[face];
    const uint32_t n = qp_face_size(mesh, face);
    *patch = first;
    if (n == 4) {
        uv[0] = i == 0 ? t : i == 1 ? 1 : i == 2 ? 1 - t : 0;
        uv[1] = i == 0 ? 0 : i == 1 ? t : i == 2 ? 1 : 1 - t;
    } else if (t <= 0.5) { /* edge v=0 of the child at its start */
        *patch += i;
        uv[0] = 2 * t;
        uv[1] = 0;
    } else { /* u=0 of the child at its end, towards v=0 */
        *patch += i + 1 == n ? 0 : i + 1;
        uv[0] = 0;
        uv[1] = 2 - 2 * t;
    }
}

/* Both sides of every edge, at places close to the ends, in the middle and anywhere. */
static void check_points(const qp_mesh *mesh, qp_precision precision, qp_random *random) {
    enum { EACH = 12 };
    qp_error err = {0};
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream stream;
    const qp_frame_options options = {.precision = precision};
    const size_t most = 2 * EACH * (size_t)mesh->n_edges;
    uint32_t *patch = malloc(most * sizeof *patch);
    double *uv = malloc(2 * most * sizeof *uv);
    uint8_t *smooth = malloc(most);
    size_t n = 0;
    if (CHECK(patch && uv && smooth) && CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err)) {
        for (uint32_t h = 0; h < mesh->n_corners; ++h) {
            const uint32_t twin = mesh->corner_twin[h];
            if (twin == QP_NONE || twin < h) continue;
            if (surface->patch_plan[mesh->patch_offsets[mesh->corner_face[h]]] == QP_NONE ||
                surface->patch_plan[mesh->patch_offsets[mesh->corner_face[twin]]] == QP_NONE)
                continue;
            for (int k = 0; k < EACH; ++k, n += 2) {
                double t = ldexp(floor(qp_random_unit(random) * 0x1p24), -24);
                if (k < 6) t = ldexp(1, -1 - (int)qp_random_below(random, 50));
                if (k < 3) t = 1 - t;
                place_on(mesh, h, t, &patch[n], uv + 2 * n);
                place_on(mesh, twin, 1 - t, &patch[n + 1], uv + 2 * (n + 1));
                smooth[n] = mesh->edge_sharpness[mesh->corner_edge[h]] < QP_SHARPNESS_INFINITE && t != 0;
            }
        }
        const size_t part = 3 * (precision == QP_DOUBLE ? sizeof(double) : sizeof(float));
        if (CHECK_OK(qp_frame_eval_points(frame, n, patch, uv, &stream, &err), err)) {
            size_t bad = 0;
            for (size_t i = 0; i < n; i += 2) {
                const char *a = (const char *)stream.vertices + 2 * part * i, *b = a + 2 * part;
                bad += memcmp(a, b, part) != 0 || (smooth[i] && memcmp(a + part, b + part, part) != 0);
            }
            CHECK(bad == 0);
            sum.samples += n;
            /* And again after others, which may have made deeper plans of other patches. */
            char *kept = malloc(2 * part * (n + 1));
            const uint64_t half = n / 2;
            if (CHECK(kept != NULL) && n != 0) {
                memcpy(kept, stream.vertices, 2 * part * n);
                if (CHECK_OK(qp_frame_eval_points(frame, half, patch + half, uv + 2 * half, &stream, &err),
                             err) &&
                    CHECK_OK(qp_frame_eval_points(frame, n, patch, uv, &stream, &err), err))
                    CHECK(memcmp(kept, stream.vertices, 2 * part * n) == 0);
            }
            free(kept);
        }
    }
    free(patch);
    free(uv);
    free(smooth);
    qp_frame_free(frame);
    qp_surface_free(surface);
}

static void test_points(void) {
    for (unsigned seed = 0; seed < (CHECK_SANITIZED ? 4 : full ? 200 : 16); ++seed) {
        qp_error err = {0};
        qp_mesh *mesh = NULL;
        const qp_generate_options options = {.seed = 5000 + seed, .sharpness = -1.0, .faces = 60};
        qp_random random = {seed};
        if (!CHECK_OK(
                qp_mesh_generate(seed % 2 == 0 ? "random-closed" : "random-open", &options, &mesh, &err),
                err))
            continue;
        check_points(mesh, seed / 2 % 2 == 0 ? QP_FLOAT : QP_DOUBLE, &random);
        qp_mesh_free(mesh);
    }
}

/* ---- What must fail ---- */

static void test_failures(void) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream stream;
    qp_watertight_report r;
    const qp_generate_options random_closed = {.seed = 2, .sharpness = -1.0, .faces = 60};
    const qp_tessellation tessellation = {.factor = 16};
    if (CHECK_OK(qp_mesh_generate("random-closed", &random_closed, &mesh, &err), err) &&
        CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err)) {
        for (int precision = QP_FLOAT; precision <= QP_DOUBLE; ++precision) {
            /* Every patch evaluates its own edges. */
            const qp_frame_options apart = {.precision = (qp_precision)precision, .no_sharing = 1};
            if (evaluate(mesh, surface, &apart, &tessellation, &r)) {
                CHECK(!qp_watertight_holds(&r));
                CHECK(r.position_mismatches > 0 && r.normal_mismatches > 0 && r.unmatched_samples == 0);
                CHECK(r.worst_ulp > 0 && r.worst_ulp < 100);
            }
            /* The canonical order of one edge broken: it is copied the wrong way round, or not at all. */
            const qp_frame_options options = {.precision = (qp_precision)precision};
            if (CHECK_OK(qp_frame_create(device, surface, &options, &frame, &err), err) &&
                CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err)) {
                qp_copies *copies = &frame->layout.copies;
                size_t longest = 0;
                for (size_t i = 0; i < copies->count; ++i)
                    if (copies->list[i].count > copies->list[longest].count) longest = i;
                qp_copy *copy = &copies->list[longest];
                const qp_copy kept = *copy;
                copy->from = copy->step > 0 ? copy->from + copy->count - 1 : copy->from - (copy->count - 1);
                copy->step = (int8_t)-copy->step;
                if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err) &&
                    CHECK_OK(qp_watertight_check(mesh, &stream, &r, &err), err)) {
                    CHECK(!qp_watertight_holds(&r));
                    /* Both samples of a place may count, and the one in the middle is right. */
                    CHECK(r.position_mismatches >= kept.count - 1u &&
                          r.position_mismatches <= 2u * kept.count);
                }
                *copy = kept;
                if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err) &&
                    CHECK_OK(qp_watertight_check(mesh, &stream, &r, &err), err))
                    CHECK(qp_watertight_holds(&r));
                copies->count /= 2;
                if (CHECK_OK(qp_frame_eval(frame, &tessellation, &stream, &err), err) &&
                    CHECK_OK(qp_watertight_check(mesh, &stream, &r, &err), err))
                    CHECK(!qp_watertight_holds(&r) && r.position_mismatches > 0);
            }
            qp_frame_free(frame);
            frame = NULL;
        }
    }
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

/* Factors out of range are refused. */
static void test_refusals(void) {
    qp_error err = {0};
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_frame *frame = NULL;
    qp_stream stream;
    float factors[12];
    if (CHECK_OK(qp_mesh_generate("cube", &(qp_generate_options){.sharpness = -1}, &mesh, &err), err) &&
        CHECK(mesh->n_edges == 12) && CHECK_OK(qp_surface_create(mesh, NULL, &surface, &err), err) &&
        CHECK_OK(qp_frame_create(device, surface, NULL, &frame, &err), err)) {
        static const float bad[] = {0, 0.5f, 65, -1, NAN, INFINITY};
        for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
            for (int e = 0; e < 12; ++e) factors[e] = 3;
            factors[7] = bad[i];
            CHECK(qp_frame_eval(frame, &(qp_tessellation){.edge_factors = factors}, &stream, &err) ==
                      QP_BAD_INPUT &&
                  strstr(err.message, "edge 7") != NULL);
        }
        /* One factor changed is another tessellation. */
        for (int e = 0; e < 12; ++e) factors[e] = 3;
        CHECK_OK(qp_frame_eval(frame, &(qp_tessellation){.edge_factors = factors}, &stream, &err), err);
        const uint64_t samples = stream.n_samples;
        factors[0] = 9;
        CHECK_OK(qp_frame_eval(frame, &(qp_tessellation){.edge_factors = factors}, &stream, &err), err);
        CHECK(stream.n_samples > samples);
    }
    qp_frame_free(frame);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
}

int main(void) {
    unsigned first = 0, last = CHECK_SANITIZED ? 39 : 999;
    const char *seeds = getenv("QUADPLAN_SEEDS"), *all = getenv("QUADPLAN_FULL");
    full = all != NULL && all[0] == '1';
    if (seeds != NULL && sscanf(seeds, "%u-%u", &first, &last) != 2) {
        fprintf(stderr, "QUADPLAN_SEEDS is to be A-B\n");
        return 1;
    }
    qp_error err = {0};
    if (!CHECK_OK(qp_device_open("host", &device, &err), err)) return check_report();
    test_failures();
    test_refusals();
    test_points();
    for (unsigned seed = first; seed <= last; ++seed) check_random(seed);
    visit_models(check_model);
    printf("%llu streams: %llu shared edges, %llu samples on them; %llu sharp edges without normals\n",
           (unsigned long long)sum.streams, (unsigned long long)sum.edges, (unsigned long long)sum.samples,
           (unsigned long long)sum.skipped);
    qp_device_free(device);
    return check_report();
}
