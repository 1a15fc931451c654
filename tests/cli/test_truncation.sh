# Every input file, cut short at random places: good (a cut may leave a smaller mesh) or exit code 2 with one
# line; never a crash, never a sanitizer's report. QUADPLAN_CUTS: cuts of each file (default 200).
source "$(dirname "$0")/common.sh"
cuts=${QUADPLAN_CUTS:-200}
RANDOM=1

# cut_short NAME FILE SUFFIX COMMAND...: COMMAND takes the cut file's path as its last word.
cut_short() {
    local name=$1 file=$2 suffix=$3 size length
    shift 3
    size=$(stat -c %s "$file")
    for ((i = 0; i < cuts; ++i)); do
        length=$(((RANDOM * 32768 + RANDOM) % size))
        head -c "$length" "$file" >"$work/cut$suffix"
        timeout 60 "$QUADPLAN_PROGRAM" "$@" "$work/cut$suffix" >"$work/stdout" 2>"$work/stderr" </dev/null
        code=$?
        if [ "$code" -eq 0 ]; then
            check "$name cut at $length: only warnings" test "$(grep -vc '^quadplan: warning: ' "$work/stderr")" -eq 0
        else
            check "$name cut at $length: exit code $code" [ "$code" -eq 2 ]
            # Warnings about unknown tags may stand before the one line.
            check "$name cut at $length: one line" test "$(grep -vc '^quadplan: warning: ' "$work/stderr")" -eq 1
            check "$name cut at $length: names the file" grep -q "cut$suffix" "$work/stderr"
        fi
    done
}

run gen random-open --seed 11 --faces 60 -o "$work/random.obj"
cut_short "random mesh" "$work/random.obj" .obj info --depth 2
for mesh in "$QUADPLAN_SOURCE_DIR"/scenes/meshes/*.obj; do
    cut_short "$(basename "$mesh")" "$mesh" .obj info --depth 2
done
# A scene that lost no more than its last line's end is whole, and finds its mesh.
ln -s "$QUADPLAN_SOURCE_DIR/scenes/meshes" "$work/meshes"
for scene in "$QUADPLAN_SOURCE_DIR"/scenes/*.json; do
    cut_short "$(basename "$scene")" "$scene" .json render --device host --size 16x16 --tess 1 --depth 2 \
        -o "$work/cut.png"
done
finish
