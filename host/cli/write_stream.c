/* Vertex streams as .obj, .ply and .npy. */
#include "host/base/number.h"
#include "host/base/output.h"
#include "host/cli/cli.h"

#include <inttypes.h>
#include <string.h>

static const char *extension(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && strchr(dot, '/') == NULL ? dot : "";
}

qp_status cli_stream_check_name(const char *path, qp_error *err) {
    const char *e = extension(path);
    if (strcmp(e, ".obj") == 0 || strcmp(e, ".ply") == 0 || strcmp(e, ".npy") == 0) return QP_OK;
    return qp_fail(err, QP_BAD_INPUT, "%s: an output is .obj, .ply or .npy", path);
}

/* "v x y z" or "vn x y z" of each sample; first: 0 for positions, 3 for normals. */
static void write_obj_lines(FILE *file, const qp_stream *s, const char *keyword, unsigned first) {
    char text[3][QP_NUMBER_CHARS];
    for (uint64_t i = 0; i < s->n_samples; ++i) {
        for (unsigned k = 0; k < 3; ++k) {
            uint64_t at = 6 * i + first + k;
            if (s->precision == QP_DOUBLE) {
                qp_write_double(text[k], ((const double *)s->vertices)[at]);
            } else {
                qp_write_float(text[k], ((const float *)s->vertices)[at]);
            }
        }
        fprintf(file, "%s %s %s %s\n", keyword, text[0], text[1], text[2]);
    }
}

static void write_obj(FILE *file, const qp_stream *s) {
    write_obj_lines(file, s, "v", 0);
    write_obj_lines(file, s, "vn", 3);
    for (uint64_t i = 0; i < s->n_triangles; ++i) {
        uint64_t a = s->triangles[3 * i] + 1ull, b = s->triangles[3 * i + 1] + 1ull,
                 c = s->triangles[3 * i + 2] + 1ull;
        fprintf(file, "f %" PRIu64 "//%" PRIu64 " %" PRIu64 "//%" PRIu64 " %" PRIu64 "//%" PRIu64 "\n", a, a,
                b, b, c, c);
    }
}

static size_t sample_bytes(const qp_stream *s) {
    return 6 * (s->precision == QP_DOUBLE ? sizeof(double) : sizeof(float));
}

/* The machine's own byte order, which the two headers below name. */
static bool little_endian(void) {
    const uint16_t one = 1;
    return *(const unsigned char *)&one == 1;
}

static void write_ply(FILE *file, const qp_stream *s) {
    static const char *const names[6] = {"x", "y", "z", "nx", "ny", "nz"};
    fprintf(file, "ply\nformat binary_%s_endian 1.0\nelement vertex %" PRIu64 "\n",
            little_endian() ? "little" : "big", s->n_samples);
    for (int k = 0; k < 6; ++k)
        fprintf(file, "property %s %s\n", s->precision == QP_DOUBLE ? "double" : "float", names[k]);
    fprintf(file, "element face %" PRIu64 "\nproperty list uchar uint vertex_indices\nend_header\n",
            s->n_triangles);
    fwrite(s->vertices, sample_bytes(s), s->n_samples, file);
    for (uint64_t i = 0; i < s->n_triangles; ++i) {
        fputc(3, file);
        fwrite(s->triangles + 3 * i, sizeof(uint32_t), 3, file);
    }
}

static void write_npy(FILE *file, const qp_stream *s) {
    char header[128];
    int length = snprintf(header, sizeof header,
                          "{'descr': '%cf%d', 'fortran_order': False, 'shape': (%" PRIu64 ", 6), }",
                          little_endian() ? '<' : '>', s->precision == QP_DOUBLE ? 8 : 4, s->n_samples);
    /* Version 1.0: magic, version, header length, header; all of it padded to a multiple of 64 bytes. */
    int padded = (10 + length + 1 + 63) / 64 * 64 - 10;
    fwrite("\x93NUMPY\x01\x00", 1, 8, file);
    fputc(padded & 255, file);
    fputc(padded >> 8, file);
    fprintf(file, "%s%*s\n", header, padded - length - 1, "");
    fwrite(s->vertices, sample_bytes(s), s->n_samples, file);
}

qp_status cli_stream_write(const qp_stream *stream, const char *path, qp_error *err) {
    qp_output output;
    qp_status status = qp_output_open(&output, path, err);
    if (status != QP_OK) return status;
    const char *e = extension(path);
    if (strcmp(e, ".obj") == 0) {
        write_obj(output.file, stream);
    } else if (strcmp(e, ".ply") == 0) {
        write_ply(output.file, stream);
    } else {
        write_npy(output.file, stream);
    }
    return qp_output_commit(&output, err);
}
