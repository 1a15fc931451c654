/* OBJ out: what qp_mesh_parse_obj reads back to the same mesh, number for number. */
#include "host/base/number.h"
#include "host/base/output.h"
#include "host/mesh/mesh.h"

static void put_numbers(FILE *file, const char *keyword, const double *value, int count) {
    char text[QP_NUMBER_CHARS];
    fputs(keyword, file);
    for (int i = 0; i < count; ++i) {
        qp_write_double(text, value[i]);
        fprintf(file, " %s", text);
    }
    fputc('\n', file);
}

static void put_faces(FILE *file, const qp_mesh *mesh) {
    for (uint32_t f = 0; f < mesh->n_faces; ++f) {
        fputc('f', file);
        for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1]; ++c) {
            fprintf(file, " %u", mesh->face_vertices[c] + 1);
            if (mesh->corner_texcoords != NULL && mesh->corner_texcoords[c] != QP_NONE) {
                fprintf(file, "/%u", mesh->corner_texcoords[c] + 1);
            }
        }
        fputc('\n', file);
    }
}

static void put_tags(FILE *file, const qp_mesh *mesh) {
    char text[QP_NUMBER_CHARS];
    for (uint32_t i = 0; i < mesh->n_creases; ++i) {
        qp_write_float(text, mesh->crease_sharpness[i]);
        fprintf(file, "t crease 2/1/0 %u %u %s\n", mesh->crease_vertices[2 * (size_t)i],
                mesh->crease_vertices[2 * (size_t)i + 1], text);
    }
    for (uint32_t i = 0; i < mesh->n_corner_tags; ++i) {
        qp_write_float(text, mesh->corner_tag_sharpness[i]);
        fprintf(file, "t corner 1/1/0 %u %s\n", mesh->corner_tag_vertices[i], text);
    }
    for (uint32_t i = 0; i < mesh->n_hole_tags; ++i)
        fprintf(file, "t hole 1/0/0 %u\n", mesh->hole_tag_faces[i]);
    fprintf(file, "t interpolateboundary 1/0/0 %d\n", (int)mesh->boundary);
    if (mesh->fvar_boundary != 5) {
        fprintf(file, "t facevaryinginterpolateboundary 1/0/0 %d\n", mesh->fvar_boundary);
    }
    if (mesh->crease_method == QP_CREASE_CHAIKIN) fputs("t creasemethod 0/0/1 chaikin\n", file);
    if (mesh->triangle_rule == QP_TRIANGLE_SMOOTH) fputs("t smoothtriangles 0/0/1 smooth\n", file);
}

qp_status qp_mesh_write_obj(const qp_mesh *mesh, const char *path, qp_error *err) {
    qp_output output;
    qp_status status = qp_output_open(&output, path, err);
    if (status != QP_OK) return status;
    FILE *file = output.file;
    fprintf(file, "# %u vertices, %u faces\n", mesh->n_vertices, mesh->n_faces);
    for (uint32_t v = 0; v < mesh->n_vertices; ++v)
        put_numbers(file, "v", mesh->positions + 3 * (size_t)v, 3);
    for (uint32_t v = 0; v < mesh->n_texcoords; ++v)
        put_numbers(file, "vt", mesh->texcoords + 2 * (size_t)v, 2);
    put_faces(file, mesh);
    put_tags(file, mesh);
    return qp_output_commit(&output, err);
}
