#!/usr/bin/env bash
# Samples a second of whole frames, and their ratio to a memset of the same stream in the same run, as a table.
#   bench/frame_speed.sh PROGRAM MESH.obj ...    (PROGRAM: build-release/quadplan)
# FACTORS, DEVICES, REPEAT can be set in the environment; an empty device is the first OpenCL device.
set -eu
program=$1
shift
echo "| mesh | factor | device | samples | hull ms | domain ms | frame ms | million samples/s | memset ratio |"
echo "|---|---|---|---|---|---|---|---|---|"
for mesh in "$@"; do
    for factor in ${FACTORS:-4 8 16 32}; do
        for device in ${DEVICES:-opencl host}; do
            [ "$device" = opencl ] && device=
            "$program" eval "$mesh" --tess "$factor" --device "$device" --repeat "${REPEAT:-11}" --json
        done
    done
done | python3 -c '
import json, os, sys
for line in sys.stdin:
    o = json.loads(line)
    print("| %s | %g | %s | %d | %.2f | %.2f | %.2f | %.1f | %.4f |" % (
        os.path.basename(o["mesh"]), o["tess"], o["device"], o["samples"], o["hull_ms"], o["domain_ms"],
        o["frame_ms"], o["samples_per_second"] / 1e6, o["memset_ratio"]))'
