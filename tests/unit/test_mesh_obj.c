/* The OBJ reader: index forms, line ends, tags, warnings, and every refusal with its line. */
#include "host/mesh/mesh.h"
#include "tests/check.h"

#include <string.h>

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
#define CUBE                                                                                                 \
    "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n"                   \
    "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"

typedef struct warnings {
    unsigned count;
    char last[480];
} warnings;

static void keep_warning(void *context, const char *line) {
    warnings *w = context;
    ++w->count;
    snprintf(w->last, sizeof w->last, "%s", line);
    CHECK(strchr(line, '\n') == NULL);
}

static qp_mesh *parse(const char *text, warnings *w) {
    qp_mesh *mesh = NULL;
    qp_error err = {0};
    qp_mesh_options options = {.warn = w != NULL ? keep_warning : NULL, .warn_context = w};
    if (w != NULL) *w = (warnings){0};
    if (!CHECK_OK(qp_mesh_parse_obj("text", text, strlen(text), &options, &mesh, &err), err)) {
        fprintf(stderr, "    on: %s\n", text);
    }
    return mesh;
}

/* All of these are the square 1 2 3 4. */
static void check_forms(void) {
    static const char *const forms[] = {
        SQUARE "f 1 2 3 4\n",
        SQUARE "f 1 2 3 4",
        SQUARE "f -4 -3 -2 -1\n",
        SQUARE "f 1 -3 3 -1\n",
        "f 1 2 3 4\n" SQUARE,
        SQUARE "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
        SQUARE "vt 0\nvt 1 0\nvt 1 1 0\nvt 0 1\nf 1/-4 2/-3 3/-2 4/-1\n",
        SQUARE "vn 0 0 1\nf 1//1 2//1 3//-1 4//1\n",
        SQUARE "vt 0 0\nvn nan nan nan\nf 1/1/1 2/1/1 3/1/1 4/1/1\n",
        SQUARE "f 1/ 2/ 3// 4\n",
        SQUARE "  f\t1 2   3\t4  # a comment\n",
        SQUARE "f 1 2 \\\n 3 \\\n4\n",
        SQUARE "f 1 2 \\\r\n 3 4\r\n",
        "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4\r\n",
        "v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3 4\r",
        "\xef\xbb\xbf" SQUARE "f 1 2 3 4\n",
        "# C:\\folder\\\n" SQUARE "f 1 2 3 4\n",
        "o x\ng a b\ns off\nusemtl m\nmtllib x.mtl\nl 1 2\np 1\n" SQUARE "f 1 2 3 4\n",
        "v 0 0 0 1\nv 1.0 0. .0 1 0.5 0.5 0.5\nv +1 10e-1 0\nv 0 .1E+1 -0\nf 1 2 3 4\n"};
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; ++i) {
        warnings w;
        qp_mesh *m = parse(forms[i], &w);
        if (m == NULL) continue;
        static const uint32_t square[4] = {0, 1, 2, 3};
        static const double corners[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
        CHECK(m->n_vertices == 4 && m->n_faces == 1 && memcmp(m->face_vertices, square, sizeof square) == 0);
        for (int k = 0; k < 12; ++k) CHECK(m->positions[k] == corners[k]);
        CHECK(w.count == 0);
        CHECK(m->boundary == QP_BOUNDARY_EDGE_ONLY && m->crease_method == QP_CREASE_UNIFORM &&
              m->triangle_rule == QP_TRIANGLE_CATMARK && m->fvar_boundary == 5);
        CHECK((m->corner_texcoords != NULL) ==
              (strchr(forms[i], '/') != NULL && strstr(forms[i], "vt") != NULL));
        CHECK_NEAR(m->diagonal, sqrt(2), 1e-15);
        qp_mesh_free(m);
    }
}

static uint32_t edge_of(const qp_mesh *m, uint32_t a, uint32_t b) {
    for (uint32_t e = 0; e < m->n_edges; ++e) {
        if (m->edge_vertices[2 * e] == a && m->edge_vertices[2 * e + 1] == b) return e;
    }
    return QP_NONE;
}

static void check_creases(void) {
    qp_mesh *m = parse(CUBE "t crease 2/1/0 0 1 2.5\nt crease 4/1/0 1 3 3 2 4\nt crease 4/3/0 4 5 5 7 1 9 2\n"
                            "t crease 2/1/0 7 6 12\nt crease 2/1/0 0 1 1.25\nt corner 1/1/0 0 3\n"
                            "t corner 2/2/0 1 2 4 100\nt corner 2/1/0 3 4 0.5\nt hole 2/0/0 1 3\n",
                       NULL);
    if (m == NULL) return;
    CHECK(m->edge_sharpness[edge_of(m, 0, 1)] == 1.25f); /* the later one wins */
    CHECK(m->edge_sharpness[edge_of(m, 1, 3)] == 4 && m->edge_sharpness[edge_of(m, 2, 3)] == 4);
    CHECK(m->edge_sharpness[edge_of(m, 4, 5)] == 1 && m->edge_sharpness[edge_of(m, 5, 7)] == 2);
    CHECK(m->edge_sharpness[edge_of(m, 6, 7)] == QP_SHARPNESS_INFINITE);
    CHECK(m->edge_sharpness[edge_of(m, 0, 2)] == 0);
    CHECK(m->vertex_sharpness[0] == 3 && m->vertex_sharpness[1] == 4 && m->vertex_sharpness[3] == 0.5f);
    CHECK(m->vertex_sharpness[2] == QP_SHARPNESS_INFINITE && m->vertex_sharpness[5] == 0);
    CHECK(m->face_flags[1] == QP_FACE_HOLE && m->face_flags[3] == QP_FACE_HOLE && m->face_flags[0] == 0);
    CHECK(m->n_creases == 7 && m->n_corner_tags == 5 && m->n_hole_tags == 2);
    qp_mesh_free(m);
}

static void check_rules(void) {
    qp_mesh *m = parse("t interpolateboundary 1/0/0 1\nt facevaryinginterpolateboundary 1/0/0 3\n"
                       "t creasemethod 0/0/1 chaikin\nt smoothtriangles 0/0/1 smooth\n" SQUARE "f 1 2 3 4\n",
                       NULL);
    if (m != NULL) {
        CHECK(m->boundary == QP_BOUNDARY_EDGE_AND_CORNER && m->fvar_boundary == 3 &&
              m->crease_method == QP_CREASE_CHAIKIN && m->triangle_rule == QP_TRIANGLE_SMOOTH);
        CHECK(m->vertex_sharpness[0] == QP_SHARPNESS_INFINITE);
        CHECK(m->edge_sharpness[0] == QP_SHARPNESS_INFINITE && m->edge_flags[0] == QP_EDGE_BOUNDARY);
    }
    qp_mesh_free(m);
    m = parse("t creasemethod 1/1/1 0 0.0 normal\nt interpolateboundary 1/0/0 0\n" SQUARE "f 1 2 3 4\n",
              NULL);
    if (m != NULL) CHECK(m->crease_method == QP_CREASE_UNIFORM && m->face_flags[0] == QP_FACE_HOLE);
    qp_mesh_free(m);
    static const char text[] = "t interpolateboundary 1/0/0 0\n" SQUARE "f 1 2 3 4\n";
    qp_mesh_options options = {.override_boundary = 1, .boundary = QP_BOUNDARY_EDGE_ONLY};
    qp_error err;
    if (CHECK_OK(qp_mesh_parse_obj("text", text, sizeof text - 1, &options, &m, &err), err)) {
        CHECK(m->boundary == QP_BOUNDARY_EDGE_ONLY && m->face_flags[0] == 0 && m->vertex_sharpness[0] == 0);
        qp_mesh_free(m);
    }
}

static void check_warnings(void) {
    warnings w;
    qp_mesh *m = parse("t unknown 1/0/0 3\nt unknown 1/0/0 4\nt other junk\n" SQUARE "f 1 2 3 4\n", &w);
    CHECK(w.count == 2 && strcmp(w.last, "text:3: unknown tag other ignored") == 0);
    qp_mesh_free(m);
    m = parse("t vertexedit 1/1/1 0 0 a\nt edgeedit 1/1/1 x\nt faceedit\n" SQUARE "f 1 2 3 4\n", &w);
    CHECK(w.count == 1 && strstr(w.last, "hierarchical edits are ignored") != NULL);
    qp_mesh_free(m);
    m = parse("vp 1 2\ncurv 1\nvp 3\n" SQUARE "f 1 2 3 4\n", &w);
    CHECK(w.count == 2);
    qp_mesh_free(m);
    m = parse(SQUARE "f 1 2 3 4\nt crease 6/1/0 0 2 0 1 1 3 2\n", &w);
    CHECK(w.count == 1 && strstr(w.last, "2 creases") != NULL && strstr(w.last, "0 2") != NULL);
    if (m != NULL) CHECK(m->n_creases == 1 && m->crease_vertices[0] == 0 && m->crease_vertices[1] == 1);
    qp_mesh_free(m);
}

static void check_refusals(void) {
    static const struct {
        const char *text, *message;
    } bad[] = {
        {"", "text: the mesh has no faces"},
        {SQUARE, "text: the mesh has no faces"},
        {SQUARE "f 1 2 3 5\n", "text:5: vertex index 5 is out of range"},
        {SQUARE "f 1 2 3 0\n", "text:5: vertex index 0 is out of range"},
        {SQUARE "f 1 2 3 -5\n", "text:5: vertex index -5 is out of range"},
        {SQUARE "f 1 2 3 99999999999\n", "text:5: vertex index 99999999999 is out of range"},
        {SQUARE "f 1 2 3 99999999999999999999\n", "text:5: "},
        {SQUARE "f 1 2 3 x\n", "text:5: \"x\" is no vertex index"},
        {SQUARE "f 1 2 3 4/1\n", "text:5: texture index 1 is out of range"},
        {SQUARE "f 1 2 3 4//2\nvn 0 0 1\n", "text:5: normal index 2 is out of range"},
        {SQUARE "f 1 2 3 4/1/1/1\nvt 0\nvn 0 0 1\n", "text:5: \"4/1/1/1\" is no face corner"},
        {SQUARE "f 1 2 3 4.5\n", "text:5: \"4.5\" is no face corner"},
        {SQUARE "f 1 2\n", "text:5: a face with fewer than 3 vertices"},
        {SQUARE "f\n", "text:5: a face with fewer than 3 vertices"},
        {SQUARE "f 1 2 3 4\nf 1 2 3 2\n", "text:6: face 1 uses vertex 2 twice"},
        {"v 0 0\n", "text:1: coordinate is missing"},
        {"v 0 0 nan\n", "text:1: coordinate \"nan\" is no finite number"},
        {"v 0 inf 0\n", "text:1: coordinate \"inf\" is no finite number"},
        {"v 0 1e999 0\n", "text:1: coordinate \"1e999\" is no finite number"},
        {"v 0 0x10 0\n", "text:1: coordinate \"0x10\" is no finite number"},
        {"v 0 1,5 0\n", "text:1: coordinate \"1,5\" is no finite number"},
        {"v 0 . 0\n", "text:1: coordinate \".\" is no finite number"},
        {"v 0 1e 0\n", "text:1: coordinate \"1e\" is no finite number"},
        {"v 0 1e37 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "text:1: coordinate 1e+37 is beyond 1e+36"},
        {"v 1 2 3 4 5 6 7 8 9\n", "text:1: more numbers"},
        {"vt x\n", "text:1: texture coordinate \"x\" is no finite number"},
        {SQUARE "f 1 2 3 4\nt\n", "text:6: a tag line without a tag"},
        {SQUARE "f 1 2 3 4\nt crease\n", "text:6: tag crease wants its three counts"},
        {SQUARE "f 1 2 3 4\nt crease 2/1 0 1 2\n", "text:6: tag crease wants its three counts"},
        {SQUARE "f 1 2 3 4\nt crease 2/-1/0 0 1 2\n", "text:6: tag crease wants its three counts"},
        {SQUARE "f 1 2 3 4\nt crease 2/1/0 0 1\n", "text:6: tag crease has fewer arguments"},
        {SQUARE "f 1 2 3 4\nt crease 999999999999/1/0 0 1 2\n", "text:6: tag crease has fewer"},
        {SQUARE "f 1 2 3 4\nt crease 2/1/0 0 1 2 3\n", "text:6: tag crease has more arguments"},
        {SQUARE "f 1 2 3 4\nt crease 3/1/0 0 1 2 3\n", "text:6: tag crease wants pairs"},
        {SQUARE "f 1 2 3 4\nt crease 4/2/0 0 1 1 2 3 3\n", "text:6: tag crease with 4 integers"},
        {SQUARE "f 1 2 3 4\nt crease 2/0/0 0 1\n", "text:6: tag crease with 2 integers"},
        {SQUARE "f 1 2 3 4\nt crease 2/1/0 0 4 1\n", "text:6: tag names vertex 4, but there are 4"},
        {SQUARE "f 1 2 3 4\nt crease 2/1/0 0 -1 1\n", "text:6: tag crease: \"-1\" is no index"},
        {SQUARE "f 1 2 3 4\nt crease 2/1/0 0 1 -1\n", "text:6: tag crease: sharpness -1 is negative"},
        {SQUARE "f 1 2 3 4\nt crease 2/1/0 0 1 nan\n", "text:6: sharpness \"nan\" is no finite number"},
        {SQUARE "f 1 2 3 4\nt corner 1/1/0 4 1\n", "text:6: tag names vertex 4, but there are 4"},
        {SQUARE "f 1 2 3 4\nt corner 0/1/0 1\n", "text:6: tag corner names no vertex"},
        {SQUARE "f 1 2 3 4\nt corner 3/2/0 0 1 2 1 1\n", "text:6: tag corner with 3 integers"},
        {SQUARE "f 1 2 3 4\nt hole 1/0/0 1\n", "text:6: tag names face 1, but there are 1"},
        {SQUARE "f 1 2 3 4\nt interpolateboundary 1/0/0 3\n", "text:6: tag interpolateboundary wants"},
        {SQUARE "f 1 2 3 4\nt interpolateboundary 0/0/0\n", "text:6: tag interpolateboundary wants"},
        {SQUARE "f 1 2 3 4\nt creasemethod 0/0/1 round\n", "text:6: tag creasemethod wants"},
        {SQUARE "f 1 2 3 4\nt smoothtriangles 0/0/0\n", "text:6: tag smoothtriangles wants"},
        {"\\\n\\\nv 0 0 x\n", "text:3: coordinate \"x\""}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        qp_mesh *mesh = NULL;
        qp_error err = {0};
        warnings w = {0};
        qp_mesh_options options = {.warn = keep_warning, .warn_context = &w};
        qp_status status = qp_mesh_parse_obj("text", bad[i].text, strlen(bad[i].text), &options, &mesh, &err);
        if (!CHECK(status == QP_BAD_INPUT && err.status == QP_BAD_INPUT && mesh == NULL && w.count == 0) ||
            !CHECK(strncmp(err.message, bad[i].message, strlen(bad[i].message)) == 0)) {
            fprintf(stderr, "    \"%s\" instead of \"%s\"\n", err.message, bad[i].message);
        }
        qp_mesh_free(mesh);
    }
    qp_mesh *mesh;
    qp_error err;
    CHECK(qp_mesh_read_obj("no/such/file.obj", NULL, &mesh, &err) == QP_BAD_INPUT);
    CHECK(strstr(err.message, "no/such/file.obj") != NULL);
    CHECK(qp_mesh_read_obj(".", NULL, &mesh, &err) == QP_BAD_INPUT);
    CHECK(qp_mesh_parse_obj("text", "", 0, NULL, &mesh, NULL) == QP_BAD_INPUT);
}

/* Every prefix of a file is a mesh or refused with one line; warnings only come with a mesh. */
static void check_prefixes(void) {
    static const char text[] =
        "o cube\nvt 0.5 0.25\n" CUBE "t crease 4/1/0 0 1 1 3 2.5\nt corner 1/1/0 2 10\n"
        "t hole 1/0/0 3\nt interpolateboundary 1/0/0 1\nt creasemethod 0/0/1 chaikin\n";
    unsigned good = 0;
    for (size_t length = 0; length < sizeof text; ++length) {
        /* A block of the very size, so that a sanitizer sees any reading past the end. */
        char *copy = malloc(length + 1);
        if (!CHECK(copy != NULL)) return;
        memmove(copy + 1, text, length);
        qp_mesh *mesh = NULL;
        qp_error err = {0};
        warnings w = {0};
        qp_mesh_options options = {.warn = keep_warning, .warn_context = &w};
        qp_status status = qp_mesh_parse_obj("cut", copy + 1, length, &options, &mesh, &err);
        CHECK(status == QP_OK || status == QP_BAD_INPUT);
        CHECK((status == QP_OK) == (mesh != NULL));
        if (status != QP_OK) CHECK(w.count == 0 && strncmp(err.message, "cut:", 4) == 0);
        good += status == QP_OK;
        qp_mesh_free(mesh);
        free(copy);
    }
    CHECK(good > 10 && good < sizeof text);
}

/* The description: what qp_mesh_create refuses, and elements that no face uses. */
static void check_create(void) {
    static const double positions[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    static const uint32_t sizes[1] = {3}, face[3] = {0, 1, 3}, hole[1] = {1};
    qp_mesh_desc desc = {.n_vertices = 4,
                         .n_faces = 1,
                         .positions = positions,
                         .face_sizes = sizes,
                         .face_vertices = face,
                         .boundary = QP_BOUNDARY_EDGE_ONLY};
    qp_mesh *m;
    qp_error err;
    if (CHECK_OK(qp_mesh_create(&desc, &m, &err), err)) {
        CHECK(qp_mesh_vertex_count(m) == 4 && qp_mesh_face_count(m) == 1 && qp_mesh_patch_count(m) == 3);
        CHECK(m->vertex_flags[2] == QP_VERTEX_UNUSED && m->vertex_flags[0] == QP_VERTEX_BOUNDARY);
        CHECK(qp_mesh_positions(m)[3] == 1);
        qp_mesh_free(m);
    }
    qp_mesh_desc broken = desc;
    broken.face_vertices = NULL;
    CHECK(qp_mesh_create(&broken, &m, &err) == QP_BAD_INPUT);
    CHECK(qp_mesh_create(NULL, &m, &err) == QP_BAD_INPUT && m == NULL);
    broken = desc;
    double far[12] = {0};
    far[7] = -1e37;
    broken.positions = far;
    CHECK(qp_mesh_create(&broken, &m, &err) == QP_BAD_INPUT && strstr(err.message, "vertex 2") != NULL);
    broken = desc;
    broken.n_vertices = 3;
    CHECK(qp_mesh_create(&broken, &m, &err) == QP_BAD_INPUT);
    CHECK(strcmp(err.message, "mesh: face 0 uses vertex 3 of 3") == 0);
    broken = desc;
    broken.n_holes = 1;
    broken.hole_faces = hole;
    CHECK(qp_mesh_create(&broken, &m, &err) == QP_BAD_INPUT);
    broken = desc;
    broken.boundary = (qp_boundary)7;
    CHECK(qp_mesh_create(&broken, &m, &err) == QP_BAD_INPUT);
    qp_mesh_free(NULL);
}

int main(void) {
    check_forms();
    check_creases();
    check_rules();
    check_warnings();
    check_refusals();
    check_prefixes();
    check_create();
    return check_report();
}
