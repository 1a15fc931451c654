# eval --supports and its fellows: the same bits, the counters, refusals, and an overrun that is found.
source "$(dirname "$0")/common.sh"
mesh=gen:prism

hash_of() {
    python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["stream_hash"])' "$work/stdout"
}
# same NAME ARGUMENTS...: the stream has the hash that scratch gave.
same() {
    local name=$1
    shift
    run eval "$mesh" --tess 9 --json "$@"
    check "$name" [ "$code" -eq 0 ]
    check "$name: the same bits" [ "$(hash_of)" = "$expected" ]
}

run eval "$mesh" --tess 9 --device host --json
expected=$(hash_of)
value 'o["supports"]["kind"] == "scratch" and o["supports"]["capacity_bytes"] == o["peak_support_bytes"]'
value 'o["supports"]["points_needed"] == o["supports"]["points_computed"] == o["supports"]["allocated_bytes"] // 16'
worst=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["supports"]["worst_case_bytes"])' "$work/stdout")
largest=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["supports"]["largest_bytes"])' "$work/stdout")
run eval "$mesh" --tess 9 --device host
check "text names scratch" grep -q "scratch of $worst bytes" "$work/stdout"

same "scratch" --device host --supports scratch
# The device that is the default compiles for each schedule, so one retirement will do there.
for device in host ""; do
    for schedule in fused streamed; do
        for retirement in in-order out-of-order; do
            [ "$device$retirement" = in-order ] && continue
            same "$schedule $retirement on '$device'" --device "$device" --supports ring --ring-bytes "$largest" \
                --schedule "$schedule" --retire "$retirement" --canaries
            value 'o["supports"]["kind"] == "ring" and o["supports"]["schedule"] == "'"$schedule"'"'
            value 'o["supports"]["retirement"] == "'"$retirement"'" and o["supports"]["issue"] == "plan"'
            value 'o["supports"]["peak_bytes"] <= o["supports"]["capacity_bytes"] == '"$largest"
            value 'o["supports"]["wraps"] > 0 and o["supports"]["allocations"] == 15'
            value 'o["supports"]["allocated_bytes"] == '"$worst"
            value 'all(k in o["supports"] for k in ("stalls", "stall_ms", "hits", "misses", "in_flight"))'
        done
    done
done
same "by patch" --device host --supports ring --ring-bytes 8K --issue patch
value 'o["supports"]["issue"] == "patch" and o["supports"]["capacity_bytes"] == 8192'
same "cache by patch" --device host --supports cache --issue patch
same "cache" --device host --supports cache --repeat 2
value 'o["supports"]["kind"] == "cache" and o["supports"]["policy"] == "all"'
value 'o["supports"]["hits"] == o["supports"]["points_needed"] and o["supports"]["misses"] == 0'
same "bounded cache" --device host --supports cache --cache-policy clock --cache-bytes 4K
value 'o["supports"]["misses"] == o["supports"]["points_computed"] > 0 and o["supports"]["capacity_bytes"] <= 4096'
for subcommand in error watertight; do
    run "$subcommand" "$mesh" --tess 4 --device host --supports ring --ring-bytes 4K --schedule streamed --json
    check "$subcommand --supports ring" [ "$code" -eq 0 ]
done
run render "$QUADPLAN_SOURCE_DIR/scenes/creased-torus.json" --size 64x48 --tess 4 --device host --supports ring --json \
    -o "$work/ring.png"
check "render --supports ring" [ "$code" -eq 0 ]
value 'o["supports"]["kind"] == "ring" and o["supports"]["capacity_bytes"] == 1 << 20'

refuses "a ring of nothing" 2 'too small: patch [0-9]+ needs [0-9]+ bytes' eval "$mesh" --supports ring --ring-bytes 0
refuses "a ring too small by a byte" 2 "needs $largest bytes" eval "$mesh" --tess 9 --supports ring \
    --ring-bytes $((largest - 1)) --schedule streamed
for option in "--ring-bytes 1M" "--schedule streamed" "--retire in-order" --canaries "--trace $work/no.json"; do
    # shellcheck disable=SC2086
    refuses "$option without a ring" 2 "^quadplan: ${option%% *} goes with --supports ring only" eval "$mesh" $option
done
refuses "--issue of scratch" 2 '^quadplan: --issue goes with --supports ring or cache only' eval "$mesh" --issue patch
refuses "--cache-bytes with a ring" 2 'goes with --supports cache' eval "$mesh" --supports ring --cache-bytes 1M
refuses "--cache-policy with scratch" 2 'goes with --supports cache' eval "$mesh" --cache-policy direct
refuses "--cache-bytes of all" 2 'goes with --cache-policy' eval "$mesh" --supports cache --cache-bytes 1M
refuses "a kind that is none" 2 "'stack' is none of scratch" eval "$mesh" --supports stack
for size in 1Q -1 M 1.5M 1MB 99999999999999999999 2000000T ""; do
    refuses "a size of '$size'" 2 'number of bytes' eval "$mesh" --supports ring --ring-bytes "$size"
done

# A hull stage that writes a point too many into the ring: the canaries see it.
mkdir "$work/kernels"
cp "$QUADPLAN_SOURCE_DIR"/kernels/* "$work/kernels"
sed -i 's/place\.points, memory/place.points + 1u, memory/' "$work/kernels/stream_hull.cl"
check "the kernel is another one" test "$(cmp -s "$work/kernels/stream_hull.cl" \
    "$QUADPLAN_SOURCE_DIR/kernels/stream_hull.cl"; echo $?)" -eq 1
export QUADPLAN_KERNELS=$work/kernels
run devices --json
if python3 -c 'import json, sys; sys.exit(len(json.load(open(sys.argv[1]))["devices"]) < 2)' "$work/stdout"; then
    refuses "an overrun" 1 'canaries of [0-9]+ of 15 patches were overwritten' eval "$mesh" --tess 9 --supports ring \
        --ring-bytes 8K --schedule streamed --canaries
fi
finish
