#!/usr/bin/env bash
# Runs `quadplan bench error-time` on the five models and draws their charts:
#     QUADPLAN_MODELS=FOLDER bench/error_time_all.sh OUT_FOLDER [options of bench error-time]
# OUT_FOLDER gets MODEL.json, MODEL.csv, MODEL.png and MODEL.txt. The program is build-release/quadplan, or
# QUADPLAN_PROGRAM. On idle processors this takes some ten minutes; on busy ones the times are worth nothing.
set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=${QUADPLAN_PROGRAM:-$root/build-release/quadplan}
if [ -z "${QUADPLAN_MODELS:-}" ]; then
    echo "QUADPLAN_MODELS is not set" >&2
    exit 2
fi
if [ $# -lt 1 ]; then
    echo "usage: bench/error_time_all.sh OUT_FOLDER [options of bench error-time]" >&2
    exit 2
fi
out=$1
shift
mkdir -p "$out"
for model in bigguy monsterfrog rook bishop armorguy; do
    # A model of 9,000 faces has samples enough with 16 a face.
    samples=64
    [ "$model" = armorguy ] && samples=16
    "$program" bench error-time "$QUADPLAN_MODELS/$model.obj" --samples "$samples" --json "$out/$model.json" \
        --csv "$out/$model.csv" --chart "$out/$model.png" "$@" >"$out/$model.txt"
    echo "$model: $(tail -n 1 "$out/$model.txt")"
done
