# Bad usage, bad input, devices and files that are not there: exit code, one line, nothing half written.
source "$(dirname "$0")/common.sh"
cube=$work/cube.obj
run gen cube -o "$cube"

refuses "no subcommand" 2 "no subcommand"
refuses "unknown subcommand" 2 "unknown subcommand 'frobnicate'" frobnicate
for subcommand in info gen eval error render devices; do
    refuses "$subcommand, unknown option" 2 "unknown option '--frobnicate'" "$subcommand" --frobnicate
done
refuses "no mesh" 2 "MESH is missing" info
refuses "two meshes" 2 "unexpected argument" info "$cube" "$cube"
refuses "value missing" 2 "needs a value" eval "$cube" --tess
for number in nan inf 1e999 0 65 -1 "" 4x 0x10; do
    refuses "bad factor '$number'" 2 "not a number from 1 to 64" eval "$cube" --tess "$number"
done
refuses "bad spacing" 2 "none of equal" eval "$cube" --spacing odd
refuses "bad repeat" 2 "whole number" eval "$cube" --repeat 1.5
refuses "bad depth" 2 "whole number from 1 to 60" info "$cube" --depth 61
refuses "flag with a value" 2 "takes no value" info "$cube" --json=1
refuses "unknown kind" 2 "icosahedron" gen icosahedron -o "$work/x.obj"
refuses "unknown kind in a mesh argument" 2 "icosahedron" info gen:icosahedron
refuses "bad setting in a mesh argument" 2 "'n=-4' is not a setting" info gen:torus,n=-4
refuses "gen without -o" 2 "gen needs -o" gen cube
refuses "missing file" 2 "nowhere.obj: " info "$work/nowhere.obj"
refuses "a folder" 2 "$work" info "$work"
refuses "missing scene" 2 "nowhere.json: " render "$work/nowhere.json" -o "$work/x.png"
refuses "unknown picture" 2 "x.gif" render "$work/nowhere.json" -o "$work/x.gif"
refuses "unknown stream" 2 "x.stl" eval "$cube" -o "$work/x.stl"

printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n' >"$work/range.obj"
refuses "index out of range" 2 "range.obj:4: " info "$work/range.obj"
printf 'v 0 0 nan\n' >"$work/nan.obj"
refuses "NaN" 2 "nan.obj:1: " info "$work/nan.obj"
printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2\n' >"$work/two.obj"
refuses "a face of two" 2 "two.obj:4: " info "$work/two.obj"
: >"$work/empty.obj"
refuses "empty file" 2 "empty.obj" info "$work/empty.obj"
printf '{"mesh": ' >"$work/half.json"
refuses "half a scene" 2 "half.json" render "$work/half.json" -o "$work/x.png"

scene=$QUADPLAN_SOURCE_DIR/scenes/creased-torus.json
refuses "render without -o" 2 "render needs -o" render "$scene"
refuses "a size of one side" 2 "width and height" render "$scene" --size 64 -o "$work/x.png"
refuses "an empty picture" 2 "width and height" render "$scene" --size 0x64 -o "$work/x.png"
refuses "not a scene" 2 "README.md:1: " render "$QUADPLAN_SOURCE_DIR/README.md" -o "$work/x.png"
QUADPLAN_GL=directx refuses "unknown GL" 2 "directx" render "$scene" --device host --size 8x8 -o "$work/x.png"
refuses "picture in a missing folder" 3 "nowhere/x.png: " render "$scene" --device host --size 8x8 \
    -o "$work/nowhere/x.png"

refuses "no such device" 3 "nonesuch" eval "$cube" --device nonesuch
vendors=${OCL_ICD_VENDORS-}
export OCL_ICD_VENDORS=$work/no-vendors
refuses "no OpenCL device" 3 "OpenCL" eval "$cube"
run eval "$cube" --device host --json
check "host needs no OpenCL device" [ "$code" -eq 0 ]
run devices
check "devices without OpenCL" [ "$code" -eq 0 ]
if [ -n "$vendors" ]; then OCL_ICD_VENDORS=$vendors; else unset OCL_ICD_VENDORS; fi

refuses "folder missing" 3 "nowhere/x.obj: " gen cube -o "$work/nowhere/x.obj"
ln -s /dev/full "$work/full.obj"
refuses "disk full" 3 "full.obj: .*space" eval "$cube" --device host -o "$work/full.obj"
"$QUADPLAN_PROGRAM" devices >/dev/full 2>"$work/stderr"
check "standard output full: exit 3" [ $? -eq 3 ]
check "standard output full: one line" one_line
cp "$cube" "$work/kept.obj"
before=$(find "$work" | sort)
# A file size limit stands in for a disk that fills up half-way.
(
    ulimit -f 4
    trap '' XFSZ
    "$QUADPLAN_PROGRAM" eval "$cube" --device host --tess 64 -o "$work/kept.obj" >/dev/null 2>"$work/limited"
    echo $? >>"$work/limited"
)
(
    ulimit -f 1
    trap '' XFSZ
    "$QUADPLAN_PROGRAM" render "$scene" --device host --size 200x200 -o "$work/x.png" >/dev/null 2>"$work/stderr"
    echo $? >"$work/picture"
)
check "write error of a picture: exit 3" [ "$(cat "$work/picture")" -eq 3 ]
check "write error of a picture: one line" one_line
rm "$work/picture"
check "write error: exit 3" [ "$(tail -n 1 "$work/limited")" -eq 3 ]
check "write error: the old file is kept" cmp "$cube" "$work/kept.obj"
rm "$work/limited"
check "nothing half written" [ "$(find "$work" | sort)" = "$before" ]
refuses "stress: no such family" 2 "'nothing' is none of" stress --family nothing
refuses "stress: a case of no family" 2 "case needs --family" stress --case 1
refuses "stress: half a sample" 2 "patch and --uv go together" stress --family far --case 1 --patch 0
refuses "stress: no such patch" 2 "the case has [0-9]+ patches" stress --family far --case 1 --patch 999999 --uv 0,0 --device host
refuses "stress: no point" 2 "not of the form U,V" stress --family far --case 1 --patch 0 --uv 0 --device host

finish
