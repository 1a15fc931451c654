#define _POSIX_C_SOURCE 200809L
/* Scene files. The format is one table a section, walked by host/scene/fields.c; what a table cannot say is
 * checked in check_whole. docs/scene-format.md describes the same keys for readers. */
#include "host/scene/scene.h"
#include "host/scene/fields.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Keys whose mere presence means something. */
enum {
    GIVEN_FILE = 1,
    GIVEN_GENERATE,
    GIVEN_BOUNDARY,
    GIVEN_CREASE,
    GIVEN_TRIANGLES,
    GIVEN_RANDOM,
    GIVEN_FACTOR,
    GIVEN_TOLERANCE,
    GIVEN_EYE,
    GIVEN_TARGET,
    GIVEN_ANGLE,
    GIVEN_GROUND,
    GIVEN_WIRE,
    GIVEN_MESH,
    GIVEN_COUNT
};

typedef struct draft {
    qp_scene scene;
    bool given[GIVEN_COUNT];
} draft;

#define AT(member) offsetof(draft, scene.member)

static const char *const boundary_names[] = {"none", "edge_and_corner", "edge_only", NULL};
static const char *const crease_names[] = {"uniform", "chaikin", NULL};
static const char *const triangle_names[] = {"catmark", "smooth", NULL};
static const char *const spacing_names[] = {"equal", "fractional_even", "fractional_odd", NULL};
static const char *const colour_names[] = {"material", "kind",   "level",     "plan",
                                           "patch",    "normal", "component", NULL};

static const qp_field mesh_fields[] = {
    {.key = "file", .kind = QP_FIELD_TEXT, .offset = AT(mesh_path), .given = GIVEN_FILE},
    {.key = "generate", .kind = QP_FIELD_TEXT, .offset = AT(generate_kind), .given = GIVEN_GENERATE},
    {.key = "n", .kind = QP_FIELD_COUNTS, .offset = AT(generate.n), .low = 0, .high = 4096},
    {.key = "sharpness", .kind = QP_FIELD_NUMBER, .offset = AT(generate.sharpness), .low = 0, .high = 10},
    {.key = "seed", .kind = QP_FIELD_SEED, .offset = AT(generate.seed)},
    {.key = "faces", .kind = QP_FIELD_COUNT, .offset = AT(generate.faces), .low = 1, .high = 1e6},
    {0}};

static const qp_field subdivision_fields[] = {{.key = "boundary",
                                               .kind = QP_FIELD_CHOICE,
                                               .offset = AT(mesh_options.boundary),
                                               .names = boundary_names,
                                               .given = GIVEN_BOUNDARY},
                                              {.key = "crease",
                                               .kind = QP_FIELD_CHOICE,
                                               .offset = AT(mesh_options.crease_method),
                                               .names = crease_names,
                                               .given = GIVEN_CREASE},
                                              {.key = "triangles",
                                               .kind = QP_FIELD_CHOICE,
                                               .offset = AT(mesh_options.triangle_rule),
                                               .names = triangle_names,
                                               .given = GIVEN_TRIANGLES},
                                              {.key = "depth",
                                               .kind = QP_FIELD_COUNT,
                                               .offset = AT(surface_options.depth),
                                               .low = 1,
                                               .high = QP_DEPTH_LIMIT},
                                              {0}};

static const qp_field random_fields[] = {
    {.key = "seed", .kind = QP_FIELD_SEED, .offset = AT(factor_seed)},
    {.key = "min", .kind = QP_FIELD_COUNT, .offset = AT(factor_min), .low = 1, .high = 64},
    {.key = "max", .kind = QP_FIELD_COUNT, .offset = AT(factor_max), .low = 1, .high = 64},
    {0}};

static const qp_field tessellation_fields[] = {
    {.key = "factor",
     .kind = QP_FIELD_NUMBER,
     .offset = AT(factor),
     .low = 1,
     .high = 64,
     .given = GIVEN_FACTOR},
    {.key = "tolerance",
     .kind = QP_FIELD_NUMBER,
     .offset = AT(tolerance),
     .low = 1e-300,
     .high = 1e300,
     .given = GIVEN_TOLERANCE},
    {.key = "spacing", .kind = QP_FIELD_CHOICE, .offset = AT(spacing), .names = spacing_names},
    {.key = "halve_ngons", .kind = QP_FIELD_FLAG, .offset = AT(halve_ngons)},
    {.key = "random", .kind = QP_FIELD_SECTION, .section = random_fields, .given = GIVEN_RANDOM},
    {0}};

static const qp_field camera_fields[] = {
    {.key = "azimuth",
     .kind = QP_FIELD_NUMBER,
     .offset = AT(azimuth),
     .low = -360,
     .high = 360,
     .given = GIVEN_ANGLE},
    {.key = "elevation",
     .kind = QP_FIELD_NUMBER,
     .offset = AT(elevation),
     .low = -89,
     .high = 89,
     .given = GIVEN_ANGLE},
    {.key = "zoom",
     .kind = QP_FIELD_NUMBER,
     .offset = AT(zoom),
     .low = 0.01,
     .high = 100,
     .given = GIVEN_ANGLE},
    {.key = "eye", .kind = QP_FIELD_VECTOR, .offset = AT(eye), .low = -1e9, .high = 1e9, .given = GIVEN_EYE},
    {.key = "target",
     .kind = QP_FIELD_VECTOR,
     .offset = AT(target),
     .low = -1e9,
     .high = 1e9,
     .given = GIVEN_TARGET},
    {.key = "up", .kind = QP_FIELD_VECTOR, .offset = AT(up), .low = -1e9, .high = 1e9},
    {.key = "fov", .kind = QP_FIELD_NUMBER, .offset = AT(fov), .low = 1, .high = 150},
    {0}};

#define LIGHT_FIELDS(name)                                                                                   \
    static const qp_field name##_fields[] = {                                                                \
        {.key = "azimuth", .kind = QP_FIELD_NUMBER, .offset = AT(name.azimuth), .low = -360, .high = 360},   \
        {.key = "elevation", .kind = QP_FIELD_NUMBER, .offset = AT(name.elevation), .low = -90, .high = 90}, \
        {.key = "size", .kind = QP_FIELD_NUMBER, .offset = AT(name.size), .low = 0, .high = 60},             \
        {.key = "intensity", .kind = QP_FIELD_NUMBER, .offset = AT(name.intensity), .low = 0, .high = 1000}, \
        {.key = "colour", .kind = QP_FIELD_COLOUR, .offset = AT(name.colour)},                               \
        {0}}
LIGHT_FIELDS(key);
LIGHT_FIELDS(fill);
LIGHT_FIELDS(rim);

static const qp_field sky_fields[] = {
    {.key = "zenith", .kind = QP_FIELD_COLOUR, .offset = AT(sky_zenith)},
    {.key = "horizon", .kind = QP_FIELD_COLOUR, .offset = AT(sky_horizon)},
    {.key = "ground", .kind = QP_FIELD_COLOUR, .offset = AT(sky_ground)},
    {.key = "intensity", .kind = QP_FIELD_NUMBER, .offset = AT(sky_intensity), .low = 0, .high = 1000},
    {0}};

static const qp_field light_fields[] = {
    {.key = "key", .kind = QP_FIELD_SECTION, .section = key_fields},
    {.key = "fill", .kind = QP_FIELD_SECTION, .section = fill_fields},
    {.key = "rim", .kind = QP_FIELD_SECTION, .section = rim_fields},
    {.key = "sky", .kind = QP_FIELD_SECTION, .section = sky_fields},
    {.key = "shadow_samples", .kind = QP_FIELD_COUNT, .offset = AT(shadow_samples), .low = 0, .high = 256},
    {0}};

static const qp_field material_fields[] = {
    {.key = "colour", .kind = QP_FIELD_COLOUR, .offset = AT(colour)},
    {.key = "back_colour", .kind = QP_FIELD_COLOUR, .offset = AT(back_colour)},
    {.key = "palette",
     .kind = QP_FIELD_PALETTE,
     .offset = AT(palette),
     .high = QP_PALETTE_MAX,
     .count_offset = AT(palette_count)},
    {.key = "gloss", .kind = QP_FIELD_NUMBER, .offset = AT(gloss), .low = 0, .high = 1},
    {.key = "specular", .kind = QP_FIELD_NUMBER, .offset = AT(specular), .low = 0, .high = 1},
    {0}};

static const qp_field ground_fields[] = {
    {.key = "colour", .kind = QP_FIELD_COLOUR, .offset = AT(ground_colour)}, {0}};

static const qp_field background_fields[] = {
    {.key = "top", .kind = QP_FIELD_COLOUR, .offset = AT(background_top)},
    {.key = "bottom", .kind = QP_FIELD_COLOUR, .offset = AT(background_bottom)},
    {.key = "alpha", .kind = QP_FIELD_NUMBER, .offset = AT(background_alpha), .low = 0, .high = 1},
    {0}};

static const qp_field image_fields[] = {
    {.key = "width", .kind = QP_FIELD_COUNT, .offset = AT(width), .low = 1, .high = 16384},
    {.key = "height", .kind = QP_FIELD_COUNT, .offset = AT(height), .low = 1, .high = 16384},
    {.key = "exposure", .kind = QP_FIELD_NUMBER, .offset = AT(exposure), .low = 0.001, .high = 1000},
    {0}};

static const qp_field wire_fields[] = {
    {.key = "width", .kind = QP_FIELD_NUMBER, .offset = AT(wire_width), .low = 0.1, .high = 20},
    {.key = "colour", .kind = QP_FIELD_COLOUR, .offset = AT(wire_colour)},
    {0}};

/* Of a further view. */
static const qp_field pass_fields[] = {
    {.key = "name", .kind = QP_FIELD_TEXT, .offset = AT(name)},
    {.key = "tessellation", .kind = QP_FIELD_SECTION, .section = tessellation_fields},
    {.key = "camera", .kind = QP_FIELD_SECTION, .section = camera_fields},
    {.key = "image", .kind = QP_FIELD_SECTION, .section = image_fields},
    {0}};

static const qp_field scene_fields[] = {
    {.key = "why", .kind = QP_FIELD_TEXT, .offset = AT(why)},
    {.key = "mesh", .kind = QP_FIELD_SECTION, .section = mesh_fields, .given = GIVEN_MESH},
    {.key = "subdivision", .kind = QP_FIELD_SECTION, .section = subdivision_fields},
    {.key = "tessellation", .kind = QP_FIELD_SECTION, .section = tessellation_fields},
    {.key = "camera", .kind = QP_FIELD_SECTION, .section = camera_fields},
    {.key = "lights", .kind = QP_FIELD_SECTION, .section = light_fields},
    {.key = "material", .kind = QP_FIELD_SECTION, .section = material_fields},
    {.key = "ground", .kind = QP_FIELD_SECTION, .section = ground_fields, .given = GIVEN_GROUND},
    {.key = "background", .kind = QP_FIELD_SECTION, .section = background_fields},
    {.key = "image", .kind = QP_FIELD_SECTION, .section = image_fields},
    {.key = "colour_by", .kind = QP_FIELD_CHOICE, .offset = AT(colour_by), .names = colour_names},
    {.key = "wireframe", .kind = QP_FIELD_SECTION, .section = wire_fields, .given = GIVEN_WIRE},
    {.key = "passes", .kind = QP_FIELD_LIST, .offset = AT(n_passes), .high = QP_PASSES_MAX},
    {0}};

static const draft defaults = {.scene = {.generate = {.sharpness = -1},
                                         .factor = 16,
                                         .halve_ngons = true,
                                         .factor_seed = 1,
                                         .factor_min = 1,
                                         .factor_max = 16,
                                         .fit = true,
                                         .azimuth = 30,
                                         .elevation = 25,
                                         .zoom = 1,
                                         .up = {0, 1, 0},
                                         .fov = 30,
                                         .key = {-35, 48, 5, 1.0, {1.0, 0.95, 0.86}},
                                         .fill = {65, 15, 30, 0.2, {0.75, 0.85, 1.0}},
                                         .rim = {160, 40, 10, 0.5, {0.9, 0.95, 1.0}},
                                         .sky_zenith = {0.55, 0.68, 0.95},
                                         .sky_horizon = {0.95, 0.93, 0.9},
                                         .sky_ground = {0.35, 0.32, 0.3},
                                         .sky_intensity = 0.45,
                                         .shadow_samples = 64,
                                         .colour = {0.55, 0.56, 0.58},
                                         .back_colour = {0.5, 0.16, 0.1},
                                         .palette = {{0.55, 0.56, 0.58},
                                                     {0.72, 0.36, 0.12},
                                                     {0.13, 0.28, 0.42},
                                                     {0.62, 0.55, 0.42},
                                                     {0.35, 0.09, 0.08},
                                                     {0.16, 0.32, 0.2}},
                                         .palette_count = 6,
                                         .gloss = 0.6,
                                         .specular = 0.5,
                                         .ground_colour = {0.5, 0.5, 0.5},
                                         .background_top = {0.36, 0.42, 0.5},
                                         .background_bottom = {0.8, 0.82, 0.85},
                                         .background_alpha = 1,
                                         .width = 960,
                                         .height = 720,
                                         .exposure = 1,
                                         .wire_colour = {0.02, 0.02, 0.03}}};

const char *qp_colour_name(qp_colour colour) {
    return (unsigned)colour <= QP_COLOUR_COMPONENT ? colour_names[colour] : NULL;
}

qp_status qp_colour_from_name(const char *name, qp_colour *colour, qp_error *err) {
    for (int k = 0; colour_names[k] != NULL; k++)
        if (strcmp(name, colour_names[k]) == 0) {
            *colour = (qp_colour)k;
            return QP_OK;
        }
    return qp_fail(err, QP_BAD_INPUT,
                   "no colour mode '%s'; there are material, kind, level, plan, patch, normal, component",
                   name);
}

/* ---- What the tables cannot express ---- */

/* Where a view is seen from, and its tessellation. A pass keeps of the scene's what it does not give. */
static qp_status check_view(const char *name, draft *d, qp_error *err) {
    qp_scene *s = &d->scene;
    const bool *given = d->given;
    if (given[GIVEN_EYE] != given[GIVEN_TARGET])
        return qp_fail(err, QP_BAD_INPUT, "%s: camera needs both \"eye\" and \"target\"", name);
    if (given[GIVEN_EYE] && given[GIVEN_ANGLE])
        return qp_fail(err, QP_BAD_INPUT,
                       "%s: camera has an \"eye\"; azimuth, elevation and zoom are for fitting without one",
                       name);
    if (s->factor_min > s->factor_max)
        return qp_fail(err, QP_BAD_INPUT, "%s: tessellation.random.min is above max", name);
    if (given[GIVEN_EYE] || given[GIVEN_ANGLE]) s->fit = !given[GIVEN_EYE];
    if (given[GIVEN_TOLERANCE] && given[GIVEN_RANDOM])
        return qp_fail(err, QP_BAD_INPUT, "%s: tessellation has both \"random\" and \"tolerance\"", name);
    if (given[GIVEN_FACTOR] || given[GIVEN_RANDOM] || given[GIVEN_TOLERANCE]) {
        s->random_factors = given[GIVEN_RANDOM];
        if (!given[GIVEN_TOLERANCE]) s->tolerance = 0;
    }
    if (given[GIVEN_TOLERANCE] && !given[GIVEN_FACTOR]) s->factor = 64;

    double toward[3] = {0, 0, -1}, across[3];
    if (!s->fit)
        for (int k = 0; k < 3; k++) toward[k] = s->target[k] - s->eye[k];
    for (int k = 0; k < 3; k++)
        across[k] = toward[(k + 1) % 3] * s->up[(k + 2) % 3] - toward[(k + 2) % 3] * s->up[(k + 1) % 3];
    double scale = hypot(hypot(toward[0], toward[1]), toward[2]) * hypot(hypot(s->up[0], s->up[1]), s->up[2]);
    double sine = hypot(hypot(across[0], across[1]), across[2]);
    if (s->fit ? !(hypot(hypot(s->up[0], s->up[1]), s->up[2]) > 0) : !(sine > 1e-6 * scale))
        return qp_fail(err, QP_BAD_INPUT, "%s: camera looks nowhere (eye at the target, or along \"up\")",
                       name);
    return QP_OK;
}

static qp_status check_whole(const char *name, draft *d, qp_error *err) {
    qp_scene *s = &d->scene;
    const bool *given = d->given;
    if (s->why == NULL) return qp_fail(err, QP_BAD_INPUT, "%s: no \"why\"", name);
    if (given[GIVEN_FILE] == given[GIVEN_GENERATE])
        return qp_fail(err, QP_BAD_INPUT, "%s: mesh needs either \"file\" or \"generate\"", name);
    s->ground = given[GIVEN_GROUND];
    if (given[GIVEN_WIRE] && !(s->wire_width > 0)) s->wire_width = 1;
    s->mesh_options.override_boundary = given[GIVEN_BOUNDARY];
    s->mesh_options.override_crease_method = given[GIVEN_CREASE];
    s->mesh_options.override_triangle_rule = given[GIVEN_TRIANGLES];
    return check_view(name, d, err);
}

/* The passes of a scene that is otherwise complete. */
static qp_status read_passes(const char *name, const char *text, size_t length, qp_scene *scene,
                             qp_error *err) {
    const uint32_t count = scene->n_passes;
    scene->n_passes = 0;
    if (count == 0) return QP_OK;
    scene->passes = qp_alloc(count, sizeof *scene->passes, false);
    if (scene->passes == NULL)
        return qp_fail_memory(err, count * sizeof *scene->passes, "the passes of a scene");
    for (uint32_t i = 0; i < count; ++i) {
        draft d = {.scene = *scene};
        char place[240], number[24];
        d.scene.n_passes = 0;
        d.scene.passes = NULL;
        snprintf(place, sizeof place, "%.200s: passes[%u]", name, (unsigned)i);
        snprintf(number, sizeof number, "%u", (unsigned)i + 2u);
        qp_status status =
            qp_fields_parse_item(name, text, length, "passes", i, pass_fields, &d, d.given, err);
        if (status == QP_OK) status = check_view(place, &d, err);
        if (status == QP_OK && d.scene.name == NULL && (d.scene.name = strdup(number)) == NULL)
            status = qp_fail_memory(err, sizeof number, "a text");
        if (status != QP_OK) {
            free(d.scene.name);
            return status;
        }
        scene->passes[scene->n_passes++] = d.scene;
    }
    return QP_OK;
}

/* A mesh file is named relative to the scene file. */
static qp_status resolve_mesh_path(const char *name, qp_scene *scene, qp_error *err) {
    const char *slash = strrchr(name, '/');
    if (scene->mesh_path == NULL || scene->mesh_path[0] == '/' || slash == NULL) return QP_OK;
    size_t folder = (size_t)(slash - name) + 1, size = folder + strlen(scene->mesh_path) + 1;
    char *joined = qp_alloc(size, 1, false);
    if (joined == NULL) return qp_fail_memory(err, size, "a file name");
    snprintf(joined, size, "%.*s%s", (int)folder, name, scene->mesh_path);
    free(scene->mesh_path);
    scene->mesh_path = joined;
    return QP_OK;
}

static void free_parts(qp_scene *scene) {
    for (uint32_t i = 0; scene->passes != NULL && i < scene->n_passes; ++i) free(scene->passes[i].name);
    free(scene->passes);
    free(scene->path);
    free(scene->why);
    free(scene->mesh_path);
    free(scene->generate_kind);
}

qp_status qp_scene_parse(const char *name, const char *text, size_t length, qp_scene **out, qp_error *err) {
    *out = NULL;
    draft *d = qp_alloc(1, sizeof *d, false);
    if (d == NULL) return qp_fail_memory(err, sizeof *d, "a scene");
    *d = defaults;
    qp_status status = qp_fields_parse(name, text, length, scene_fields, d, d->given, err);
    if (status == QP_OK) status = check_whole(name, d, err);
    if (status == QP_OK) status = resolve_mesh_path(name, &d->scene, err);
    if (status == QP_OK) {
        d->scene.path = strdup(name);
        *out = qp_alloc(1, sizeof **out, false);
        if (d->scene.path == NULL || *out == NULL)
            status = qp_fail_memory(err, sizeof **out + strlen(name), "a scene");
    }
    if (status == QP_OK) status = read_passes(name, text, length, &d->scene, err);
    if (status == QP_OK) {
        **out = d->scene;
    } else {
        free(*out);
        *out = NULL;
        free_parts(&d->scene);
    }
    free(d);
    return status;
}

qp_status qp_scene_read(const char *path, qp_scene **scene, qp_error *err) {
    enum { LIMIT = 4 << 20 };
    *scene = NULL;
    FILE *file = fopen(path, "rb");
    if (file == NULL) return qp_fail(err, QP_BAD_INPUT, "%s: cannot be read: %s", path, strerror(errno));
    char *text = qp_alloc(LIMIT + 1, 1, false);
    size_t length = 0;
    qp_status status = QP_OK;
    if (text == NULL) {
        status = qp_fail_memory(err, LIMIT + 1, "a scene file");
    } else {
        errno = 0;
        length = fread(text, 1, LIMIT + 1, file);
        if (ferror(file))
            status = qp_fail(err, QP_BAD_INPUT, "%s: cannot be read: %s", path, strerror(errno));
        else if (length > LIMIT)
            status = qp_fail(err, QP_BAD_INPUT, "%s: longer than %d bytes: not a scene", path, LIMIT);
    }
    fclose(file);
    if (status == QP_OK) status = qp_scene_parse(path, text, length, scene, err);
    free(text);
    return status;
}

void qp_scene_free(qp_scene *scene) {
    if (scene == NULL) return;
    free_parts(scene);
    free(scene);
}
