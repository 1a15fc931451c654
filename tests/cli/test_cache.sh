# quadplan cache: keys, what must hold of the rows, files, usage errors.
source "$(dirname "$0")/common.sh"

run cache --help
check "cache --help" [ "$code" -eq 0 ]
for option in sizes passes policy issue repeat precision device json csv chart tess; do
    check "cache --help names --$option" grep -q -e "--$option" "$work/stdout"
done

host=(--device host --repeat 2)
run cache gen:random-closed,faces=60 "${host[@]}" --tess 16 --sizes 4K..64K --passes 3 --json --csv "$work/rows.csv"
check "cache" [ "$code" -eq 0 ]
keys cache mesh device precision repeat passes rows
value 'all(k in r for r in o["rows"] for k in ("cache_bytes", "passes", "policy", "hit_rate", "points_computed",
 "points_needed", "relative_hull_time"))'
value '[p["tess"] for p in o["passes"]] == [16, 8, 4]'
value 'len(o["rows"]) == 3 * (1 + 3 * 5) and {r["policy"] for r in o["rows"]} == {"all", "direct", "clock", "shared"}'
value 'all(r["points_computed"] == r["misses_cold"] + r["misses_capacity"] + r["misses_conflict"] and
 r["hits"] + r["points_computed"] == r["points_needed"] and abs(r["hit_rate"] - r["hits"] / r["points_needed"]) < 1e-5 for r in o["rows"])'
value 'all(r["relative_hull_time"] > 0 for r in o["rows"])'
# Patches share points, and need the same ones again at lower factors; nothing that fits is computed twice.
value 'len({r["points_needed"] for r in o["rows"] if r["passes"] == 1}) == 1'
value '[r["points_computed"] for r in o["rows"] if r["policy"] == "all"][0] < o["rows"][0]["points_needed"]'
value 'len({r["points_computed"] - r["duplicates"] for r in o["rows"] if r["policy"] == "all"}) == 1'
value 'all(r["points_computed"] - r["duplicates"] >= o["rows"][0]["points_computed"] - o["rows"][0]["duplicates"] for r in o["rows"])'
value 'all(r["capacity_bytes"] <= r["cache_bytes"] for r in o["rows"])'
cp "$work/stdout" "$work/rows.json"
check "csv has the same rows" python3 -c '
import csv, json, sys
rows = list(csv.DictReader(open(sys.argv[1])))
same = json.load(open(sys.argv[2]))["rows"]
assert len(rows) == len(same)
assert all((r[k] == s[k] if k == "policy" else float(r[k]) == float(s[k])) for r, s in zip(rows, same) for k in r)
' "$work/rows.csv" "$work/rows.json"

# Every repetition begins with an empty cache, a scene has passes of its own, and more of them go round.
run cache "$QUADPLAN_SOURCE_DIR/scenes/passes.json" "${host[@]}" --policy all --json
value '[p["tess"] for p in o["passes"]] == [32, 8, 16] and [p["name"] for p in o["passes"]] == [None, "shadow", "mirror"]'
value '[r["policy"] for r in o["rows"]] == ["all"] * 3'
value 'o["rows"][0]["misses_cold"] == o["rows"][0]["points_computed"] > 0'
value 'o["rows"][0]["points_computed"] == o["rows"][2]["points_computed"]'
run cache "$QUADPLAN_SOURCE_DIR/scenes/passes.json" "${host[@]}" --policy all --json --passes 5
value '[p["tess"] for p in o["passes"]] == [32, 8, 16, 32, 8]'
value 'o["rows"][4]["points_computed"] == o["rows"][0]["points_computed"]'
run cache gen:cube "${host[@]}" --policy clock --sizes 4K --passes 1 --issue patch --json
value 'o["issue"] == "patch" and o["rows"][0]["points_needed"] == 6 * 237'
run cache gen:cube "${host[@]}" --policy direct --sizes 64K --passes 1 --tess 4 --precision double
check "the table" grep -q "hit rate" "$work/stdout"
run cache gen:torus "${host[@]}" --policy all --passes 1 --tess 4 --json
check "a mesh whose patches need none" [ "$code" -eq 0 ]
value 'o["rows"][0]["points_needed"] == 0 and o["rows"][0]["hit_rate"] == 0'

if /usr/bin/python3 -c 'import matplotlib, PIL' 2>/dev/null; then
    run cache gen:cube "${host[@]}" --sizes 1K..16K --passes 2 --tess 4 --chart "$work/chart.png"
    check "chart" [ "$code" -eq 0 ]
    check "a PNG" python3 -c '
import sys
data = open(sys.argv[1], "rb").read()
sys.exit(data[:8] != b"\x89PNG\r\n\x1a\n" or len(data) > 150000)' "$work/chart.png"
else
    echo "charts are not tested: no matplotlib"
fi

refuses "no mesh" 2 "MESH\|SCENE is missing" cache
refuses "sizes" 2 "is no list of sizes" cache gen:cube --sizes many
refuses "passes" 2 "passes: '0'" cache gen:cube --passes 0
refuses "policy" 2 "none of every" cache gen:cube --policy lru
refuses "repeats" 2 "repeat: '1000'" cache gen:cube --repeat 1000
refuses "chart's name" 2 "\.png or \.svg" cache gen:cube --chart "$work/chart.jpg"
refuses "csv cannot be written" 3 "no/such" cache gen:cube --csv "$work/no/such/rows.csv"
refuses "device" 3 "toaster" cache gen:cube --device toaster
refuses "missing mesh" 2 "nowhere.obj" cache "$work/nowhere.obj"
finish
