# cmake --install into an empty prefix; a C99 program finds, builds and runs against it, by find_package and by
# pkg-config; the shared library shows the symbols of quadplan.h and no others.
source "$(dirname "$0")/common.sh"
prefix=$work/prefix
check "install" cmake --install "$QUADPLAN_BINARY_DIR" --prefix "$prefix"
check "program" [ -x "$prefix/bin/quadplan" ]
check "program draws, with its module for pictures" "$prefix/bin/quadplan" render --device host --size 16x16 --tess 1 \
    "$QUADPLAN_SOURCE_DIR/scenes/creased-torus.json" -o "$work/picture.png"
check "man page" [ -s "$prefix/share/man/man1/quadplan.1" ]
library=$(find "$prefix" -name libquadplan.so)
check "library" [ -n "$library" ]
check "soname" sh -c "readelf -d '$library' | grep -qE 'SONAME.*libquadplan\.so\.[0-9]+\]'"

nm -D --defined-only "$library" | awk '$2 ~ /[TDBR]/ {print $3}' | sort >"$work/exported"
grep -E '^QP_API' "$prefix/include/quadplan.h" | grep -oE '\bqp_[a-z_]+\(' | tr -d '(' | sort -u >"$work/declared"
check "exported symbols are those of the header" diff "$work/declared" "$work/exported"

cat >"$work/consumer.c" <<'END'
#include <quadplan.h>
#include <stdio.h>

int main(void) {
    static const double positions[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
    static const uint32_t sizes[] = {4, 4, 4, 4, 4, 4};
    static const uint32_t faces[] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    qp_mesh_desc desc = {0};
    qp_tessellation tessellation = {0};
    qp_frame_options options = {0};
    qp_error err;
    qp_mesh *mesh = NULL;
    qp_surface *surface = NULL;
    qp_device *device = NULL;
    qp_frame *frame = NULL;
    qp_stream stream;
    desc.n_vertices = 8;
    desc.n_faces = 6;
    desc.positions = positions;
    desc.face_sizes = sizes;
    desc.face_vertices = faces;
    desc.boundary = QP_BOUNDARY_EDGE_ONLY;
    tessellation.factor = 4;
    if (qp_mesh_create(&desc, &mesh, &err) != QP_OK || qp_surface_create(mesh, NULL, &surface, &err) != QP_OK ||
        qp_device_open("host", &device, &err) != QP_OK ||
        qp_frame_create(device, surface, &options, &frame, &err) != QP_OK ||
        qp_frame_eval(frame, &tessellation, &stream, &err) != QP_OK) {
        fprintf(stderr, "%s\n", err.message);
        return 1;
    }
    printf("%lu samples\n", (unsigned long)stream.n_samples);
    qp_frame_free(frame);
    qp_device_free(device);
    qp_surface_free(surface);
    qp_mesh_free(mesh);
    return 0;
}
END
cat >"$work/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(consumer C)
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_EXTENSIONS OFF)
find_package(quadplan 0.1 REQUIRED)
add_executable(consumer consumer.c)
target_link_libraries(consumer PRIVATE quadplan::quadplan)
END
# A library that is built with sanitizers needs them in the program too.
flags=
if nm -D "$library" | grep -q __asan_init; then flags=-fsanitize=address,undefined; fi
check "find_package: configure" cmake -S "$work" -B "$work/build" -DCMAKE_PREFIX_PATH="$prefix" \
    -DCMAKE_C_FLAGS="$flags"
check "find_package: build" cmake --build "$work/build"
check "find_package: run" test "$("$work/build/consumer")" = "150 samples"

PKG_CONFIG_PATH=$(dirname "$library")/pkgconfig
export PKG_CONFIG_PATH
check "pkg-config" pkg-config --exists quadplan
# shellcheck disable=SC2046,SC2086
check "pkg-config: build" cc -std=c99 -Wall -Wextra -Wpedantic -Werror $flags "$work/consumer.c" -o "$work/consumer" \
    $(pkg-config --cflags --libs quadplan)
check "pkg-config: run" test "$(LD_LIBRARY_PATH=$(dirname "$library") "$work/consumer")" = "150 samples"
check "pkg-config: version" test "quadplan $(pkg-config --modversion quadplan)" = "$("$QUADPLAN_PROGRAM" --version)"
finish
