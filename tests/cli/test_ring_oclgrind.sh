#!/usr/bin/env bash
# The fused ring buffer under Oclgrind, which watches every access of every work-item: memory that nobody allocated, values that
# nobody wrote, and accesses of two work-items without a barrier between them.
#
# Oclgrind knows of no order between work-groups but the end of a kernel. That a patch may have the place of one that is gone, as words of the
# ring tell it, it takes for a race; ThreadSanitizer, which follows atomics, finds none there (unit.ring_threads). So races
# are looked for with a ring that all patches fit in, where there may be none at all, and with a starved one, where all are to be in
# the control points themselves and none in the words of the ring.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
if ! command -v oclgrind >/dev/null; then
    echo "skipped: Oclgrind is not there"
    exit 77
fi
mesh=gen:random-open,seed=4,faces=24
# The sanitizers' run-time libraries and Oclgrind's do not go together.
if ldd "$QUADPLAN_PROGRAM" | grep -q libasan; then
    echo "skipped: a build with sanitizers"
    exit 77
fi
"$QUADPLAN_PROGRAM" eval --device host --tess 2 --json $mesh >"$work/host.json" 2>"$work/host.log"
check "the host evaluates it" [ $? -eq 0 ]
hash_of() { grep -o '"stream_hash": "[0-9a-f]*"' "$1"; }

# watch NAME OPTIONS-OF-OCLGRIND -- OPTIONS: fills $work/NAME.json and $work/NAME.log.
watch() {
    local name=$1 options=()
    shift
    while [ "$1" != -- ]; do
        options+=("$1")
        shift
    done
    shift
    timeout 300 oclgrind --build-options -cl-opt-disable --max-errors 100000 "${options[@]}" "$QUADPLAN_PROGRAM" \
        eval --device 0.0 --tess 2 --json --supports ring "$@" $mesh >"$work/$name.json" 2>"$work/$name.log"
    check "$name: runs" [ $? -eq 0 ]
    check "$name: same stream" [ "$(hash_of "$work/$name.json")" = "$(hash_of "$work/host.json")" ]
}

for retire in in-order out-of-order; do
    watch "whole-$retire" --data-races --uninitialized -- --ring-bytes 64K --retire $retire
    check "whole-$retire: nothing to say" [ ! -s "$work/whole-$retire.log" ]
    watch "starved-$retire" --uninitialized -- --ring-bytes 500 --retire $retire --canaries
    check "starved-$retire: nothing to say" [ ! -s "$work/starved-$retire.log" ]
done

watch races --data-races -- --ring-bytes 500 --retire out-of-order
grep -o 'data race at .* address 0x[0-9a-f]*' "$work/races.log" | grep -o '0x[0-9a-f]*' | sort -u >"$work/addresses"
check "races: places are used again" [ -s "$work/addresses" ]
# The upper 16 bits are the number of a buffer: that of the points, which begin behind their margin of 256 bytes.
check "races: in one buffer" [ "$(sed 's/.\{12\}$//' "$work/addresses" | sort -u | wc -l)" -eq 1 ]
low=$(sed 's/.*\(.\{12\}\)$/\1/' "$work/addresses" | sort | head -n 1)
high=$(sed 's/.*\(.\{12\}\)$/\1/' "$work/addresses" | sort | tail -n 1)
check "races: within the ring" [ $((16#$low)) -ge 256 -a $((16#$high)) -lt $((256 + 500)) ]
finish
