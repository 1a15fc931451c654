#!/usr/bin/env bash
# The cache of control points under Oclgrind: memory that nobody allocated, values that nobody wrote, races. Its kernels say there by
# atomics which words work-groups share on purpose (kernels/portable.h, QP_WORD_ATOMICS).
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
if ! command -v oclgrind >/dev/null; then
    echo "skipped: Oclgrind is not there"
    exit 77
fi
if ldd "$QUADPLAN_PROGRAM" | grep -q libasan; then
    echo "skipped: a build with sanitizers"
    exit 77
fi
mesh=gen:random-open,seed=4,faces=6
hash_of() { grep -o '"stream_hash": "[0-9a-f]*"' "$1"; }
"$QUADPLAN_PROGRAM" eval --device host --tess 2 --json $mesh >"$work/host.json"
check "host" [ $? -eq 0 ]
for policy in "all" "direct --cache-bytes 1K" "shared --cache-bytes 4K"; do
    timeout 300 oclgrind --build-options -cl-opt-disable --data-races --uninitialized "$QUADPLAN_PROGRAM" \
        eval --device 0.0 --tess 2 --repeat 2 --json --supports cache --cache-policy $policy $mesh >"$work/out.json" 2>"$work/log"
    check "$policy: runs" [ $? -eq 0 ]
    check "$policy: same stream" [ "$(hash_of "$work/out.json")" = "$(hash_of "$work/host.json")" ]
    check "$policy: nothing to say" [ ! -s "$work/log" ]
done
finish
