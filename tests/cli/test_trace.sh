# eval --trace: a file that chrome://tracing reads, and that tells what happened.
source "$(dirname "$0")/common.sh"

# trace NAME ARGUMENTS...: writes and reads a trace of 15 patches.
trace() {
    local name=$1 schedule=$2 retirement=$3
    shift 3
    run eval gen:prism --tess 9 --supports ring --ring-bytes 8K --schedule "$schedule" --retire "$retirement" \
        --trace "$work/trace.json" --json "$@"
    check "$name" [ "$code" -eq 0 ]
    check "$name: reads as it should" python3 -c '
import json, sys
report = json.load(open(sys.argv[1]))["supports"]
o = json.load(open(sys.argv[2]))
schedule, retirement = sys.argv[3:]
events = o["traceEvents"]
assert o["otherData"]["patches"] == 15 == report["allocations"]
slices = [e for e in events if e["ph"] == "X"]
assert all(e["ts"] >= 0 and e["dur"] >= 0 and "pid" in e and "tid" in e for e in slices)
patches = [e for e in slices if e["name"].startswith("patch ")]
assert sorted(e["args"]["patch"] for e in patches) == sorted({e["args"]["patch"] for e in patches})
assert len(patches) == 15 and sum(e["args"]["bytes"] for e in patches) == report["allocated_bytes"]
assert all(e["args"]["samples"] > 0 and e["args"]["bytes"] == 16 * e["args"]["points"] > 0 for e in patches)
assert all(e["args"]["allocated"] <= e["args"]["done"] <= e["args"]["retired"] for e in patches)
names = {e["name"] for e in slices if not e["name"].startswith("patch ")}
if schedule == "fused":
    assert "hull" in names and "domain" in names, names
    assert ("wait to retire" in names) <= (retirement == "in-order"), names
else:
    assert "hull" in names and sum(n.startswith("domain of patch ") for n in names) == 15, names
# On a lane one patch follows the other, and stages lie within theirs.
lanes = {}
for e in slices:
    whole = e["name"].split(" ")[0] in ("patch", "domain") and e["name"] != "domain"
    lanes.setdefault((e["pid"], e["tid"]), ([], []))[0 if whole else 1].append((e["ts"], e["ts"] + e["dur"]))
slack = 1e-6
for wholes, parts in lanes.values():
    wholes.sort()
    assert all(b[0] >= a[1] - slack for a, b in zip(wholes, wholes[1:]))
    assert all(any(w[0] - slack <= p[0] and p[1] <= w[1] + slack for w in wholes) for p in parts)
live = [e for e in events if e["ph"] == "C" and e["name"] == "live bytes"]
assert live == sorted(live, key=lambda e: e["ts"]) and sum(live[-1]["args"].values()) == 0
most = max(sum(e["args"].values()) for e in live)
assert 0 < most <= report["capacity_bytes"], (most, report)
assert all(v >= 0 for e in live for v in e["args"].values())
assert {e["name"] for e in events if e["ph"] == "M"} == {"process_name"}
' "$work/stdout" "$work/trace.json" "$schedule" "$retirement"
    rm -f "$work/trace.json"
}

for device in host ""; do
    for schedule in fused streamed; do
        for retirement in in-order out-of-order; do
            trace "$schedule $retirement on '$device'" "$schedule" "$retirement" --device "$device"
        done
    done
done
trace "by patch" streamed in-order --device host --issue patch

# With room for one patch only, all others stall.
run eval gen:prism --tess 9 --device host --json
largest=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["supports"]["largest_bytes"])' "$work/stdout")
run eval gen:prism --tess 9 --device host --supports ring --ring-bytes "$largest" --schedule streamed --trace "$work/full.json" \
    --json
value 'o["supports"]["stalls"] > 0 and o["supports"]["stall_ms"] > 0'
check "stalls are drawn" python3 -c '
import json, sys
events = json.load(open(sys.argv[1]))["traceEvents"]
stalls = [e for e in events if e["name"] == "stall" and e["dur"] > 0]
sys.exit(len(stalls) < 10)' "$work/full.json"

refuses "a folder that is not there" 3 'cannot be written' eval gen:prism --device host --supports ring --trace \
    "$work/none/trace.json"
refuses "a trace of scratch" 2 'goes with --supports ring' eval gen:prism --device host --trace "$work/no.json"
check "which leaves nothing behind" [ ! -e "$work/no.json" ]
finish
