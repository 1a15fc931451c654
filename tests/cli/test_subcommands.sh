# Every subcommand: help, JSON keys, outputs, exit codes.
source "$(dirname "$0")/common.sh"
cube=$work/cube.obj

run --help
check "help" [ "$code" -eq 0 ]
check "help names the subcommands" grep -q devices "$work/stdout"
run --version
check "version" grep -qE '^quadplan [0-9]+\.[0-9]+\.[0-9]+$' "$work/stdout"
for subcommand in info gen eval error watertight stress render devices; do
    run "$subcommand" --help
    check "$subcommand --help" [ "$code" -eq 0 ]
    check "$subcommand --help names --json" grep -q -- --json "$work/stdout"
    check "$subcommand --help is quiet" [ ! -s "$work/stderr" ]
done

run gen cube -o "$cube" --json
check "gen" [ "$code" -eq 0 ]
keys gen vertices faces
for kind in torus creased-torus cubes fan prism terrain random-closed random-open; do
    run gen "$kind" -o "$work/$kind.obj"
    check "gen $kind" [ "$code" -eq 0 ]
    check "gen $kind writes" [ -s "$work/$kind.obj" ]
done
run gen random-open --seed 5 --faces 50 -o "$work/a.obj"
run gen random-open --seed 5 --faces 50 -o "$work/b.obj"
check "a seed fixes a mesh" cmp "$work/a.obj" "$work/b.obj"
run gen random-open --seed 6 --faces 50 -o "$work/b.obj"
check "another seed makes another mesh" test "$(cmp -s "$work/a.obj" "$work/b.obj"; echo $?)" -eq 1

run info "$cube" --json
check "info" [ "$code" -eq 0 ]
keys info vertices faces patches regular_faces irregular_faces irregular_patches plans nodes stencils \
    quadtree_bytes stencil_bytes control_points unique_control_points scratch_bytes build_ms
value 'o["vertices"] == 8 and o["faces"] == 6 and o["patches"] == 6 and o["irregular_patches"] == 6'
value 'o["plans"] == 1 and len(o["control_points"]) == 7 and len(o["unique_control_points"]) == 7'
run info gen:torus --json
value 'o["plans"] == 1 and o["regular_faces"] == o["faces"]'

for device in "" host; do
    run eval "$cube" --tess 8 --repeat 3 --device "$device" --json
    check "eval" [ "$code" -eq 0 ]
    keys eval patches samples triangles hull_ms domain_ms frame_ms samples_per_second memset_ratio \
        peak_support_bytes stream_hash device
    value 'o["samples"] == 6 * 81 and o["triangles"] == 6 * 128'
    cp "$work/stdout" "$work/eval$device.json"
done
check "host and device: the same bits" python3 -c '
import json, sys
a, b = (json.load(open(f))["stream_hash"] for f in sys.argv[1:])
sys.exit(a != b)' "$work/eval.json" "$work/evalhost.json"

run eval "$cube" --tolerance 1e-2 --device host --json
check "eval --tolerance" [ "$code" -eq 0 ]
keys "eval --tolerance" tolerance bound patches_over_tolerance factor_min factor_mean factor_max samples
value 'o["tolerance"] == 0.01 and 0 < o["bound"] <= 0.01 and o["patches_over_tolerance"] == 0'
value '1 < o["factor_min"] <= o["factor_max"] < 64 and "tess" not in o'
check "a tolerance that is met is quiet" [ ! -s "$work/stderr" ]
run eval "$cube" --tolerance 1e-5 --tess 4 --device host --json
check "eval --tolerance, too few" [ "$code" -eq 0 ]
value 'o["bound"] > 1e-5 and o["patches_over_tolerance"] == 6 and o["factor_max"] == 4'
check "a warning says so" grep -q '6 patches need larger factors' "$work/stderr"
run sample "$cube" --patch 0 --uv 0.001,0.0003 --tolerance 1e-3 --device host --json
check "sample --tolerance" [ "$code" -eq 0 ]
keys "sample --tolerance" bound samples
value '0 < o["bound"] <= 1e-3 and o["samples"][0]["flags"] == 1'
run watertight gen:prism --tolerance 1e-2 --spacing fractional_odd --device host
check "watertight --tolerance" [ "$code" -eq 0 ]
run eval "$cube" --tolerance 0
check "eval --tolerance 0" [ "$code" -eq 2 ]

run stress --list
check "stress --list" grep -q '^far-scaled .*24 cases' "$work/stdout"
run stress --device host --family far-scaled --cases 3 --samples 20 --json
check "stress" [ "$code" -eq 0 ]
keys stress families precision device seed
value 'len(o["families"]) == 1 and o["families"][0]["name"] == "far-scaled" and o["families"][0]["cases"] == 3'
value 'o["families"][0]["samples"] == 60 and o["families"][0]["nonfinite"] == 0'
value '0 < o["families"][0]["worst_ulp"] <= 8'
cp "$work/stdout" "$work/stress.json"
again=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["families"][0]["command"])' "$work/stress.json")
check "stress prints its command" [ "${again#quadplan stress --family far-scaled --case }" != "$again" ]
eval "run ${again#quadplan } --json"
check "stress: the command of the worst sample" [ "$code" -eq 0 ]
check "stress: which errs as much" python3 -c '
import json, sys
a, b = (json.load(open(f))["families"][0]["worst_ulp"] for f in sys.argv[1:])
sys.exit(a != b)' "$work/stress.json" "$work/stdout"
run stress --device host --family needles --case 1 --write "$work/needles.obj"
check "stress --write" [ -s "$work/needles.obj" ]

run eval "$cube" --tess 4 --device host -o "$work/out.obj"
check "eval -o obj" [ "$(grep -c '^v ' "$work/out.obj")" -eq 150 ]
check "eval -o obj triangles" [ "$(grep -c '^f ' "$work/out.obj")" -eq 192 ]
run info "$work/out.obj" --json
check "eval's obj reads back" [ "$code" -eq 0 ]
value 'o["faces"] == 192'
for precision in float double; do
    run eval "$cube" --tess 4 --device host --precision "$precision" -o "$work/out.npy"
    check "eval -o npy" [ "$code" -eq 0 ]
    run eval "$cube" --tess 4 --device host --precision "$precision" -o "$work/out.ply"
    check "eval -o ply" [ "$code" -eq 0 ]
    check "npy and ply hold the stream" python3 -c '
import ast, struct, sys
folder, letter, size = sys.argv[1], *(("f", 4) if sys.argv[2] == "float" else ("d", 8))
npy = open(folder + "/out.npy", "rb").read()
assert npy[:8] == b"\x93NUMPY\x01\x00"
length = struct.unpack("<H", npy[8:10])[0]
header = ast.literal_eval(npy[10:10 + length].decode())
assert (10 + length) % 64 == 0 and header["shape"] == (150, 6) and header["descr"] == "<f%d" % size, header
data = npy[10 + length:]
values = struct.unpack("<%d%s" % (150 * 6, letter), data)
for i in range(0, 900, 6):
    assert abs(sum(x * x for x in values[i + 3:i + 6]) - 1) < 1e-5
    assert 0 < sum(x * x for x in values[i:i + 3])
ply = open(folder + "/out.ply", "rb").read()
end = ply.index(b"end_header\n") + 11
assert ply[end:end + len(data)] == data
assert len(ply) == end + len(data) + 192 * 13' "$work" "$precision"
done

run error "$cube" --tess 4 --device host --json
check "error" [ "$code" -eq 0 ]
keys error samples position_max position_rms normal_max_deg normal_rms_deg worst
value 'sorted(o["worst"]) == ["patch", "u", "v"] and 0 < o["position_max"] < 1e-6 and o["normal_max_deg"] < 0.05'
run error "$cube" --set random --samples 500 --seed 3 --device host --json
value 'o["samples"] == 500'
run error "$cube" --set corner --device host --json
check "error --set corner" [ "$code" -eq 0 ]
run error "$cube" --tess 4 --device host --max-position 0 --json
check "error above a threshold: exit 1" [ "$code" -eq 1 ]
check "error above a threshold: one line" one_line
keys "error above a threshold" position_max

scene=$QUADPLAN_SOURCE_DIR/scenes/creased-torus.json
for spacing in equal fractional_even fractional_odd; do
    run watertight gen:random-closed,seed=4 --tess 20 --spacing "$spacing" --random-factors 7 --device host \
        --json
    check "watertight $spacing" [ "$code" -eq 0 ]
    keys watertight edges samples position_mismatches normal_mismatches unmatched_samples \
        sharp_edges_skipped worst_ulp
    value 'o["position_mismatches"] == 0 and o["normal_mismatches"] == 0 and o["unmatched_samples"] == 0'
    value 'o["edges"] > 0 and o["samples"] > 4 * o["edges"] and o["worst_ulp"] == 0'
done
run watertight gen:random-closed,seed=4 --tess 16 --no-sharing --json
check "not watertight: exit 1" [ "$code" -eq 1 ]
check "not watertight: one line" one_line
check "not watertight: names a place" grep -qE 'patch [0-9]+ \(' "$work/stderr"
value 'o["position_mismatches"] > 0 and o["normal_mismatches"] > 0 and 0 < o["worst_ulp"] < 100'

run render "$QUADPLAN_SOURCE_DIR/scenes/passes.json" --passes --size 48x32 --device host --supports cache --json \
    -o "$work/view.png"
check "render --passes" [ "$code" -eq 0 ]
check "render --passes: three pictures" [ -s "$work/view.png" -a -s "$work/view-2.png" -a -s "$work/view-3.png" ]
value '[p["name"] for p in o["passes"]] == ["shadow", "mirror"]'
value 'o["supports"]["hits"] > 0 and all(p["supports"]["points_computed"] == 0 and p["samples"] > 0 for p in o["passes"])'

run render "$scene" --size 96x64 --tess 4 --json -o "$work/picture.png"
check "render" [ "$code" -eq 0 ]
keys render scene picture width height patches samples triangles frame_ms stream_hash device gl
value 'o["width"] == 96 and o["height"] == 64'
check "render: a PNG of that size, not of one colour" python3 -c '
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
assert data[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", data[16:24]) == (96, 64)
at, pixels = 8, b""
while at < len(data):
    length, kind = struct.unpack(">I4s", data[at:at + 8])
    if kind == b"IDAT": pixels += data[at + 8:at + 8 + length]
    at += 12 + length
assert len(set(zlib.decompress(pixels))) > 50' "$work/picture.png"
cp "$work/stdout" "$work/opencl.json"
run render "$scene" --size 96x64 --tess 4 --json --device host -o "$work/host.png"
check "render: host and device, the same bits" python3 -c '
import json, sys
a, b = (json.load(open(f))["stream_hash"] for f in sys.argv[1:])
sys.exit(a != b)' "$work/opencl.json" "$work/stdout"
check "render: host and device, the same picture" cmp "$work/picture.png" "$work/host.png"
run render "$scene" --size 96x64 --tess 4 --color kind --wireframe -o "$work/kind.exr"
check "render to exr" [ "$(head -c 4 "$work/kind.exr" | od -An -tx1 | tr -d ' ')" = 762f3101 ]

run devices --json
check "devices" [ "$code" -eq 0 ]
value 'any(d["id"] == "host" for d in o["devices"])'
finish
