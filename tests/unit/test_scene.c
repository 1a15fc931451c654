/* Scene files: what is read, what is refused and in which words; factors that match across edges. */
#include "host/scene/scene.h"
#include "tests/check.h"

#include <string.h>

static qp_status parse(const char *text, qp_scene **scene, qp_error *err) {
    return qp_scene_parse("dir/s.json", text, strlen(text), scene, err);
}

static void reads_values(void) {
    qp_scene *s;
    qp_error err;
    const char *text =
        "{\"why\": \"w\", \"mesh\": {\"file\": \"meshes/a.obj\"}, \"tessellation\": {\"factor\": 7.5,"
        " \"spacing\": \"fractional_odd\"}, \"subdivision\": {\"boundary\": \"none\", \"depth\": 5},"
        " \"material\": {\"colour\": \"#ff8000\"}, \"colour_by\": \"plan\", \"ground\": {}}";
    if (!CHECK_OK(parse(text, &s, &err), err)) return;
    CHECK(strcmp(s->mesh_path, "dir/meshes/a.obj") == 0);
    CHECK(s->factor == 7.5 && s->spacing == QP_FRACTIONAL_ODD);
    CHECK(s->mesh_options.override_boundary && s->mesh_options.boundary == QP_BOUNDARY_NONE);
    CHECK(!s->mesh_options.override_crease_method && s->surface_options.depth == 5);
    CHECK_NEAR(s->colour[0], 1, 1e-12);
    CHECK_NEAR(s->colour[1], 0.21586, 1e-5); /* 0x80 of sRGB */
    CHECK(s->colour[2] == 0 && s->colour_by == QP_COLOUR_PLAN && s->ground && s->fit);
    CHECK(s->wire_width == 0 && !s->random_factors);
    qp_scene_free(s);
}

static void refuses(void) {
    static const struct {
        const char *text, *message; /* part of it */
    } cases[] = {
        {"", "dir/s.json:"},
        {"{\"why\": \"w\",\n\"mesh\": }", "dir/s.json:2:"},
        {"[]", "a scene is an object"},
        {"{\"mesh\": {\"generate\": \"cube\"}}", "no \"why\""},
        {"{\"why\": \"\", \"mesh\": {\"generate\": \"cube\"}}", "why must be a text"},
        {"{\"why\": \"w\"}", "either \"file\" or \"generate\""},
        {"{\"why\": \"w\", \"mesh\": {\"file\": \"a\", \"generate\": \"cube\"}}", "either"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"kamera\": {}}", "unknown key kamera"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\", \"m\": 1}}", "unknown key mesh.m"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"tessellation\": {\"factor\": 65}}",
         "tessellation.factor must be a number from 1 to 64"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"image\": {\"width\": 1.5}}",
         "image.width must be an integer"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"image\": {\"width\": 0}}", "image.width"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"colour_by\": \"red\"}",
         "colour_by must be one of material, kind"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"material\": {\"colour\": \"#12345g\"}}",
         "material.colour"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"material\": {\"palette\": []}}",
         "material.palette"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"camera\": {\"eye\": [0,0,1]}}", "both"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"camera\": {\"eye\": [0,1,0], \"target\": "
         "[0,0,0]}}",
         "camera looks nowhere"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"camera\": {\"up\": [0,0,0]}}", "nowhere"},
        {"{\"why\": \"w\", \"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}}", "dir/s.json:1:"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"lights\": {\"key\": {\"size\": 1e999}}}",
         "dir/s.json:1:"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"tessellation\": {\"random\": {\"min\": 9, "
         "\"max\": 3}}}",
         "min is above max"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"passes\": {}}", "passes must be an array"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"passes\": [1]}",
         "passes[0] must be an object"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"passes\": [{}, {\"mesh\": {}}]}",
         "unknown key passes[1].mesh"},
        {"{\"why\": \"w\", \"mesh\": {\"generate\": \"cube\"}, \"passes\": [{\"camera\": {\"eye\": "
         "[0,0,1]}}]}",
         "passes[0]: camera needs both"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        qp_scene *s;
        qp_error err = {0};
        CHECK(parse(cases[k].text, &s, &err) == QP_BAD_INPUT && s == NULL);
        if (!CHECK(strstr(err.message, cases[k].message) != NULL))
            fprintf(stderr, "    '%s', not '%s'\n", err.message, cases[k].message);
    }
    qp_scene *s;
    qp_error err;
    CHECK(qp_scene_read("/nonexistent/s.json", &s, &err) == QP_BAD_INPUT);
    CHECK(qp_scene_read("/", &s, &err) == QP_BAD_INPUT);
}

static void reads_passes(void) {
    qp_scene *s;
    qp_error err;
    const char *text = "{\"passes\": [{\"name\": \"shadow\", \"tessellation\": {\"factor\": 4}, \"camera\": "
                       "{\"eye\": [1, 2, 3],"
                       " \"target\": [0, 0, 0]}}, {\"camera\": {\"azimuth\": 90}, \"image\": {\"width\": "
                       "7}}], \"why\": \"w\","
                       " \"mesh\": {\"generate\": \"cube\"}, \"tessellation\": {\"tolerance\": 0.5, "
                       "\"spacing\": \"fractional_even\"},"
                       " \"camera\": {\"azimuth\": 5, \"elevation\": 6, \"fov\": 50}}";
    if (!CHECK_OK(parse(text, &s, &err), err)) return;
    if (CHECK(s->n_passes == 2 && s->name == NULL)) {
        const qp_scene *first = &s->passes[0], *second = &s->passes[1];
        CHECK(strcmp(first->name, "shadow") == 0 && strcmp(second->name, "3") == 0);
        CHECK(first->factor == 4 && first->tolerance == 0 && first->spacing == QP_FRACTIONAL_EVEN);
        CHECK(!first->fit && first->eye[2] == 3 && first->fov == 50 && first->n_passes == 0);
        CHECK(second->tolerance == 0.5 && second->factor == 64 && second->fit);
        CHECK(second->azimuth == 90 && second->elevation == 6 && second->width == 7 &&
              second->height == s->height);
        CHECK(second->why == s->why);
    }
    qp_scene_free(s);
}

static void tolerances(void) {
    static const char both[] =
        "{\"why\": \"w\", \"mesh\": {\"generate\": \"prism\"}, \"tessellation\": {\"tolerance\": 1e-3%s}}";
    static const struct {
        const char *more;
        double factor;
    } good[] = {{"", 64}, {", \"factor\": 8", 8}};
    qp_error err;
    qp_scene *s;
    char text[200];
    for (int i = 0; i < 2; i++) {
        qp_mesh *m = NULL;
        qp_tessellation t;
        float *factors = NULL;
        snprintf(text, sizeof text, both, good[i].more);
        if (!CHECK_OK(parse(text, &s, &err), err)) return;
        CHECK(s->tolerance == 1e-3 && s->factor == good[i].factor);
        if (CHECK_OK(qp_scene_mesh(s, NULL, NULL, &m, &err), err) &&
            CHECK_OK(qp_scene_tessellation(s, m, &t, &factors, &err), err))
            CHECK(t.tolerance == 1e-3 && (double)t.factor == good[i].factor && t.patch_factors == NULL &&
                  factors == NULL);
        qp_mesh_free(m);
        qp_scene_free(s);
    }
    snprintf(text, sizeof text, both, ", \"random\": {\"seed\": 1}");
    CHECK(parse(text, &s, &err) == QP_BAD_INPUT && strstr(err.message, "tolerance") != NULL);
}

/* Points that a patch side makes on an edge: the factor, or twice it on a half edge. */
static void factors_match(qp_spacing spacing, bool random) {
    qp_error err;
    qp_scene *s;
    qp_mesh *m;
    qp_tessellation t;
    float *factors;
    const char *text = "{\"why\": \"w\", \"mesh\": {\"generate\": \"prism\", \"n\": 7}}";
    if (!CHECK_OK(parse(text, &s, &err), err)) return;
    s->spacing = spacing;
    s->factor = 12;
    s->random_factors = random;
    s->factor_min = 1, s->factor_max = 64;
    if (!CHECK_OK(qp_scene_mesh(s, NULL, NULL, &m, &err), err)) return;
    if (!CHECK_OK(qp_scene_tessellation(s, m, &t, &factors, &err), err) || !CHECK(factors != NULL)) return;
    double *edge = calloc(m->n_edges, sizeof *edge);
    bool equal = true, in_range = true;
    for (uint32_t f = 0; f < m->n_faces; f++) {
        uint32_t first = m->face_offsets[f], n = qp_face_size(m, f);
        for (uint32_t k = 0; k < n; k++) {
            const float *own = factors + 6 * (size_t)(m->patch_offsets[f] + (n == 4 ? 0 : k));
            uint32_t e = m->corner_edge[first + k];
            /* Side v=0 of child k is the first half of edge k; u=0 of child k + 1 the second. */
            double here = n == 4 ? own[(k + 1) % 4] : 2 * own[1];
            if (n != 4) {
                const float *next = factors + 6 * (size_t)(m->patch_offsets[f] + (k + 1) % n);
                equal = equal && next[0] == own[1] && next[3] == own[2];
            }
            equal = equal && (edge[e] == 0 || edge[e] == here);
            edge[e] = here;
        }
    }
    for (uint32_t k = 0; k < 6 * m->n_patches; k++)
        in_range = in_range && factors[k] >= 1 && factors[k] <= 64;
    CHECK(equal);
    CHECK(in_range);
    free(edge);
    free(factors);
    qp_mesh_free(m);
    qp_scene_free(s);
}

int main(void) {
    tolerances();
    reads_values();
    reads_passes();
    refuses();
    factors_match(QP_EQUAL, false);
    factors_match(QP_EQUAL, true);
    factors_match(QP_FRACTIONAL_EVEN, true);
    return check_report();
}
