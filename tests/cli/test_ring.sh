# quadplan ring: keys, what must hold of the rows, files, usage errors.
source "$(dirname "$0")/common.sh"

run --help
check "--help lists ring" grep -qE '^  ring ' "$work/stdout"
run ring --help
check "ring --help" [ "$code" -eq 0 ]
for option in sizes machine sm warps-per-sm fill retire issue hull-rate tessellator-rate tessellator domain-rate latency \
    point-bytes regular-points validate json csv chart tess; do
    check "ring --help names --$option" grep -q -e "--$option" "$work/stdout"
done

# The cube's six patches have 237 points each, 3792 bytes.
run ring gen:cube --json --sizes 2K..64K,3792,12K --csv "$work/rows.csv"
check "ring" [ "$code" -eq 0 ]
keys ring mesh tess machine patches patches_with_points points samples largest_bytes worst_case_bytes estimate_bytes \
    smallest_ring_bytes_at_99_percent scratch rows histogram live
value '[r["ring_bytes"] for r in o["rows"]] == [2048, 3792, 4096, 8192, 12288, 16384, 32768, 65536]'
value 'all(k in r for r in o["rows"] for k in ("relative_throughput", "stall_fraction", "occupancy", "peak_bytes", "in_flight"))'
value 'o["worst_case_bytes"] == 6 * 3792 and o["largest_bytes"] == 3792 and o["estimate_bytes"] == 6 * 3792'
value 'o["points"] == 6 * 237 and o["samples"] == 6 * 17 * 17 and o["patches"] == o["patches_with_points"] == 6'
value 'o["rows"][0]["relative_throughput"] == 0 and o["rows"][0]["stall_fraction"] == 1 and not o["rows"][0]["fits"]'
value 'abs(o["rows"][1]["relative_throughput"] - 1 / 6) < 1e-6 and abs(o["rows"][1]["stall_fraction"] - 5 / 6) < 1e-5'
value '[r["in_flight"] for r in o["rows"]] == [0, 1, 1, 2, 3, 4, 6, 6]'
value '[r["peak_bytes"] for r in o["rows"]] == [3792 * r["in_flight"] for r in o["rows"]]'
value 'o["rows"][-1]["relative_throughput"] == 1 and o["rows"][-1]["stall_fraction"] == 0'
value 'o["smallest_ring_bytes_at_99_percent"] == 6 * 3792'
value 'sum(o["histogram"]["patches"]) == 6 and o["histogram"]["patches"][237 // o["histogram"]["points_per_bin"]] == 6'
value 'max(o["live"][0]["bytes"]) == 6 * 3792 == o["scratch"]["peak_bytes"]'
cp "$work/stdout" "$work/rows.json"
check "csv has the same rows" python3 -c '
import csv, json, sys
rows = list(csv.DictReader(open(sys.argv[1])))
same = json.load(open(sys.argv[2]))["rows"]
assert len(rows) == len(same)
assert all(float(r[k]) == float(s[k]) for r, s in zip(rows, same) for k in r)' "$work/rows.csv" "$work/rows.json"

# Parameters reach the model: one slot is never held up, and two are faster than one.
run ring gen:cube --json --sm 1 --warps-per-sm 1 --sizes 4K
value 'o["rows"][0]["relative_throughput"] == 1 and o["rows"][0]["stall_fraction"] == 0 and o["rows"][0]["occupancy"] == 1'
value 'o["smallest_ring_bytes_at_99_percent"] == 4096 and o["estimate_bytes"] == 3792'
# One slot: per patch 237 points x 8 vertices / 4, then 289 points, then 289 vertices / 0.5, and 7.
run ring gen:cube --json --sm 1 --warps-per-sm 1 --hull-rate 4 --tessellator-rate 1 --domain-rate 0.5 --latency 7 --sizes 1M
value 'o["scratch"]["cycles"] == 6 * (o["weights"] / 6 / 4 + 289 + 578 + 7)'
for machine in paper mobile large hull-bound; do
    run ring gen:random-closed,faces=60 --json --machine $machine --sizes 1K..1M --retire out-of-order --issue plan --tess 8
    check "machine $machine" [ "$code" -eq 0 ]
    value 'o["machine"]["name"] == "'$machine'" and o["machine"]["retirement"] == "out-of-order" and o["machine"]["issue"] == "plan"'
    value 'any(r["relative_throughput"] >= 0.99 for r in o["rows"])'
done
run ring gen:torus --json --sizes 1K
value 'o["points"] == 0 and o["smallest_ring_bytes_at_99_percent"] == 0 and o["rows"][0]["relative_throughput"] == 1'
run ring gen:torus --json --sizes 1K --regular-points 16
value 'o["points"] == 16 * o["patches"] and o["largest_bytes"] == 256'
run ring "$QUADPLAN_SOURCE_DIR/scenes/passes.json" --json --sizes 64K
value 'o["tess"] == 32'
run ring "$QUADPLAN_SOURCE_DIR/scenes/passes.json" --json --sizes 64K --tess 4
value 'o["tess"] == 4'
run ring gen:cube --tess 4 --sizes 1K..4K
check "the table" grep -q "99 percent of scratch's throughput" "$work/stdout"

# The model beside the real thing; how near they are depends on who else runs, but not what there is to be counted.
run ring gen:cubes,n=3x3x3 --json --validate --sizes 64K
check "validation" [ "$code" -eq 0 ]
value 'all(v["measured_peak_bytes"] <= v["ring_bytes"] and v["model_peak_bytes"] <= v["ring_bytes"] for v in o["validation"]["rows"])'
value 'o["validation"]["rows"][0]["ring_bytes"] == 3792 == o["validation"]["rows"][0]["measured_peak_bytes"]'
value 'o["validation"]["rows"][0]["model_wraps"] == o["validation"]["rows"][0]["measured_wraps"] == 161'
value 'o["validation"]["rows"][-1]["measured_stalls"] == o["validation"]["rows"][-1]["model_stalls"] == 0'
refuses "nothing to validate" 2 "no patch of gen:torus needs" ring gen:torus --validate --json

if /usr/bin/python3 -c 'import matplotlib, PIL' 2>/dev/null; then
    run ring gen:cube --sizes 1K..64K --chart "$work/chart.png"
    check "chart" [ "$code" -eq 0 ]
    check "a PNG" python3 -c '
import sys
data = open(sys.argv[1], "rb").read()
sys.exit(data[:8] != b"\x89PNG\r\n\x1a\n" or len(data) > 150000)' "$work/chart.png"
    run ring gen:torus --sizes 64K --chart "$work/chart.svg"
    check "an SVG" grep -q "<svg" "$work/chart.svg"
else
    echo "charts are not tested: no matplotlib"
fi

refuses "no mesh" 2 "MESH\|SCENE is missing" ring
refuses "sizes" 2 "'64K..32Q' is no list of sizes" ring gen:cube --sizes 64K..32Q
refuses "sizes the wrong way round" 2 "is no list of sizes" ring gen:cube --sizes 2M..1M
refuses "no size" 2 "is no list of sizes" ring gen:cube --sizes 0
refuses "an empty item" 2 "is no list of sizes" ring gen:cube --sizes 64K,
refuses "machine" 2 "none of paper" ring gen:cube --machine toaster
refuses "SMs" 2 "sm: '0'" ring gen:cube --sm 0
refuses "rate" 2 "hull-rate: 'nan'" ring gen:cube --hull-rate nan
refuses "regular points" 2 "regular-points: '17'" ring gen:cube --regular-points 17
refuses "chart's name" 2 "\.png or \.svg" ring gen:cube --chart "$work/chart.pdf"
refuses "csv cannot be written" 3 "no/such" ring gen:cube --csv "$work/no/such/rows.csv"
refuses "missing scene" 2 "nowhere.json" ring "$work/nowhere.json"
refuses "a scene's rules are its own" 2 "rules of its own" ring "$QUADPLAN_SOURCE_DIR/scenes/passes.json" --boundary none
mkdir "$work/bin"
printf '#!/bin/sh\nexit 127\n' >"$work/bin/python3"
chmod +x "$work/bin/python3"
PATH="$work/bin:$PATH" refuses "no python3" 3 "python3, which is missing" ring gen:cube --chart "$work/chart.png"
finish
