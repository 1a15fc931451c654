# Every input file, cut short at random places: good (a cut may leave a smaller mesh) or exit code 2 with one
# line; never a crash, never a sanitizer's report. QUADPLAN_CUTS: cuts of each file (default 200).
source "$(dirname "$0")/common.sh"
cuts=${QUADPLAN_CUTS:-200}
RANDOM=1

# broken NAME: counts a failed check, and shows what the program said.
broken() {
    failures=$((failures + 1))
    echo "failed: $1" >&2
    head -n 5 "$work/stderr" >&2
}

# cut_short FILE SUFFIX COMMAND...: COMMAND takes the cut file's path as its last word.
cut_short() {
    local file=$1 suffix=$2 name size length lines
    shift 2
    name=$(basename "$file")
    size=$(stat -c %s "$file")
    for ((i = 0; i < cuts; ++i)); do
        length=$(((RANDOM * 32768 + RANDOM) % size))
        head -c "$length" "$file" >"$work/cut$suffix"
        timeout 60 "$QUADPLAN_PROGRAM" "$@" "$work/cut$suffix" >"$work/stdout" 2>"$work/stderr" </dev/null
        code=$?
        # Warnings, as of a tag that the cut made unknown, may stand before the one line.
        mapfile -t lines <"$work/stderr"
        checks=$((checks + 1))
        while [ "${#lines[@]}" -gt 0 ] && [[ ${lines[0]} == "quadplan: warning: "* ]]; do lines=("${lines[@]:1}"); done
        if [ "$code" -eq 0 ]; then
            [ "${#lines[@]}" -eq 0 ] || broken "$name cut at $length: good, but not quiet"
        elif [ "$code" -ne 2 ] || [ "${#lines[@]}" -ne 1 ] || [[ ${lines[0]} != "quadplan: "*"cut$suffix"* ]]; then
            broken "$name cut at $length: exit code $code, not 2 and one line that names the file"
        fi
    done
}

run gen random-open --seed 11 --faces 60 -o "$work/random.obj"
cut_short "$work/random.obj" .obj info --depth 2
for mesh in "$QUADPLAN_SOURCE_DIR"/scenes/meshes/*.obj; do
    cut_short "$mesh" .obj info --depth 2
done
# A scene that lost no more than its last line's end is whole, and finds its mesh.
ln -s "$QUADPLAN_SOURCE_DIR/scenes/meshes" "$work/meshes"
for scene in "$QUADPLAN_SOURCE_DIR"/scenes/*.json; do
    cut_short "$scene" .json render --device host --size 16x16 --tess 1 --depth 2 \
        -o "$work/cut.png"
done
finish
