# bench error-time: help, a small run with all outputs, usage errors.
source "$(dirname "$0")/common.sh"
export OMP_NUM_THREADS=2

run bench --help
check "bench --help" [ "$code" -eq 0 ]
check "bench --help lists error-time" grep -q error-time "$work/stdout"
run bench error-time --help
check "bench error-time --help" [ "$code" -eq 0 ]
for option in samples repeats peers max-level threads json csv chart seed; do
    check "bench error-time --help names --$option" grep -q -e "--$option" "$work/stdout"
done

small=(bench error-time gen:cube --device host --max-level 2 --repeats 2 --samples 8 --seed 3)
# LeakSanitizer itself crashes on the thread-local storage of the threads that Embree leaves running; the other runs,
# without Embree, are searched for leaks.
ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0" run "${small[@]}" --json - --csv "$work/out.csv"
check "error-time" [ "$code" -eq 0 ]
keys error-time mesh faces patches samples samples_per_patch seed repeats threads device configurations left_out \
    peers_beyond_front
value 'o["samples"] == 48 and o["seed"] == 3 and o["repeats"] == 2'
value 'all(c[k] >= 0 for c in o["configurations"] for k in ("ns_per_sample", "setup_ms", "locate_ms", "position_max",
 "position_rms", "normal_max_deg", "normal_rms_deg"))'
value 'all(c["position_rms"] <= c["position_max"] and c["nonfinite"] == 0 for c in o["configurations"])'
value 'any(c["front"] for c in o["configurations"])'
value '{c["precision"] for c in o["configurations"] if c["library"] == "quadplan"} == {"float", "double"}'
value '{c["level"] for c in o["configurations"] if c["series"] == "quadplan-float"} == {1, 2}'
value '{c["exact_tail"] for c in o["configurations"] if c["library"] == "quadplan"} == {True, False}'
value 'all(c["position_max"] < (1e-15 if c["precision"] == "double" else 5e-7)
           for c in o["configurations"] if c["library"] == "quadplan" and c["exact_tail"])'
value '{"osd-cpu/bspline", "osd-cpu/gregory", "osd-cpu/bilinear", "osd-omp/gregory", "far-double/gregory", "bfr",
 "bfr-default", "bfr-double"} <= {c["series"] for c in o["configurations"]}'
cp "$work/stdout" "$work/out.json"
check "csv has a line a configuration" python3 -c '
import csv, json, sys
rows = list(csv.DictReader(open(sys.argv[1])))
configurations = json.load(open(sys.argv[2]))["configurations"]
assert len(rows) == len(configurations)
assert all(r["series"] == c["series"] and float(r["position_max"]) == c["position_max"]
           for r, c in zip(rows, configurations))' "$work/out.csv" "$work/out.json"

run "${small[@]}" --peers none
check "no peers" [ "$code" -eq 0 ]
check "the table names quadplan's series" grep -q quadplan-double "$work/stdout"
check "the table names no peer" test "$(grep -cE 'osd|bfr|embree' "$work/stdout")" -eq 0
run "${small[@]}" --peers bfr,osd-cpu/gregory --json -
value '{c["series"] for c in o["configurations"] if c["library"] != "quadplan"} ==
 {"bfr", "bfr-default", "bfr-double", "bfr-double-default", "osd-cpu/gregory"}'

run "${small[@]}" --peers none --clock processor --json -
value 'o["clock"] == "processor" and all(c["ns_per_sample"] > 0 for c in o["configurations"])'

# Where a peer means another surface is no error of its; here it is at the corners of one face.
if [ -e "$(dirname "$QUADPLAN_PROGRAM")/quadplan_embree.so" ]; then
    ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0" run bench error-time gen:terrain --device host \
        --max-level 1 --repeats 1 --samples 4 --peers embree --json -
    value 'all(c["nonfinite"] == 0 for c in o["configurations"])'
    value 'all(c["apart"] > 0 and c["position_max"] < 1e-6 for c in o["configurations"] if c["series"] == "embree")'
fi

# A peer's series ends, and says so, where its set-up takes too long.
run "${small[@]}" --peers bfr-double --setup-limit 0 --json -
value 'any(s["series"] == "bfr-double" and s["from_level"] == 2 and "set-up" in s["reason"] for s in o["left_out"])'

if /usr/bin/python3 -c 'import matplotlib, PIL' 2>/dev/null; then
    run "${small[@]}" --peers bfr --chart "$work/chart.png"
    check "chart" [ "$code" -eq 0 ]
    check "a PNG" python3 -c '
import sys
data = open(sys.argv[1], "rb").read()
sys.exit(data[:8] != b"\x89PNG\r\n\x1a\n" or len(data) > 150000)' "$work/chart.png"
else
    echo "charts are not tested: no matplotlib"
fi

refuses "no benchmark" 2 "no benchmark" bench
refuses "unknown benchmark" 2 "unknown benchmark 'speed'" bench speed
refuses "no mesh" 2 "MESH is missing" bench error-time
refuses "unknown peer" 2 "no peer 'tmr'" "${small[@]}" --peers bfr,tmr
refuses "chart's name" 2 "\.png or \.svg" "${small[@]}" --chart "$work/chart.pdf"
refuses "level" 2 "max-level" bench error-time gen:cube --max-level 11
refuses "samples" 2 "samples" bench error-time gen:cube --samples 0
refuses "repeats" 2 "repeats" bench error-time gen:cube --repeats 0
refuses "missing file" 2 "nowhere.obj" bench error-time "$work/nowhere.obj"
refuses "json cannot be written" 3 "no/such" "${small[@]}" --peers none --json "$work/no/such/folder.json"
mkdir "$work/bin"
printf '#!/bin/sh\nexit 127\n' >"$work/bin/python3"
chmod +x "$work/bin/python3"
PATH="$work/bin:$PATH" refuses "no python3" 3 "python3, which is missing" "${small[@]}" --peers none --chart "$work/chart.png"
finish
