#!/usr/bin/env bash
# The numbers and charts of docs/ring-buffer.md and docs/subdivision-cache.md:
#     QUADPLAN_MODELS=FOLDER bench/supports_all.sh OUT_FOLDER [ring|validate|cache]...
# OUT_FOLDER gets ring/MODEL[-MACHINE].csv and .png, ring/smallest.txt, ring/validate.txt, and cache/MODEL.csv and .png. The program is build-release/quadplan, or QUADPLAN_PROGRAM. The models of rings take seconds and need no idle machine; validations
# and the times of caches mean something only where the processors are the program's alone.
set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=${QUADPLAN_PROGRAM:-$root/build-release/quadplan}
if [ -z "${QUADPLAN_MODELS:-}" ]; then
    echo "QUADPLAN_MODELS is not set" >&2
    exit 2
fi
if [ $# -lt 1 ]; then
    echo "usage: bench/supports_all.sh OUT_FOLDER [ring|validate|cache]..." >&2
    exit 2
fi
out=$1
shift
[ $# -gt 0 ] || set -- ring validate cache
mkdir -p "$out/ring" "$out/cache"

# smallest MODEL FACTOR MACHINE RETIREMENT ISSUE: a line of smallest.txt
smallest() {
    "$program" ring "$QUADPLAN_MODELS/$1.obj" --tess "$2" --machine "$3" --retire "$4" --issue "$5" --sizes 1M --json | python3 -c '
import json, sys
o = json.load(sys.stdin)
row = o["rows"][0]
print("%-12s %6s %-11s %-13s %-6s %11d %11d %11d %11d %11d %9.4f" % (*sys.argv[1:], o["smallest_ring_bytes_at_99_percent"],
      o["estimate_bytes"], o["worst_case_bytes"], o["scratch"]["peak_bytes"], o["largest_bytes"], row["relative_throughput"]))' "$@"
}

rings() {
    for model in bigguy monsterfrog armorguy; do
        machines=paper
        [ $model = armorguy ] && machines="paper mobile large hull-bound"
        for machine in $machines; do
            name=$model
            [ "$machine" = paper ] || name=$name-$machine
            "$program" ring "$QUADPLAN_MODELS/$model.obj" --tess 64 --machine "$machine" \
                --sizes 8K..32M,96K,192K,384K,768K,1536K,3M,6M --csv "$out/ring/$name.csv" --chart "$out/ring/$name.png" >/dev/null
        done
    done
    {
        printf '%-12s %6s %-11s %-13s %-6s %11s %11s %11s %11s %11s %9s\n' model factor machine retirement issue '99 percent' estimate \
            'worst case' 'scratch peak' 'a patch' 'at 1 MB'
        for factor in 8 16 32 64; do
            for retirement in in-order out-of-order; do
                for machine in paper mobile large hull-bound; do smallest armorguy $factor $machine $retirement patch; done
            done
        done
        for machine in paper mobile large hull-bound; do
            for retirement in in-order out-of-order; do smallest armorguy 64 $machine $retirement plan; done
        done
        for model in bigguy monsterfrog; do
            for machine in paper mobile large hull-bound; do smallest $model 64 $machine in-order patch; done
        done
    } >"$out/ring/smallest.txt"
}

validate() {
    for model in bigguy monsterfrog armorguy; do
        for retirement in in-order out-of-order; do
            "$program" ring "$QUADPLAN_MODELS/$model.obj" --tess 16 --retire $retirement --issue plan --validate --sizes 1M |
                sed -n '/^the fused/,$p' | sed "s/^the fused/$model, factor 16, $retirement: the fused/"
        done
    done >"$out/ring/validate.txt"
}

caches() {
    for model in bigguy monsterfrog armorguy; do
        factor=64 sizes=32K..2M
        [ $model = armorguy ] && factor=16 sizes=256K..16M
        "$program" cache "$QUADPLAN_MODELS/$model.obj" --tess $factor --issue patch --sizes $sizes --repeat 3 \
            --csv "$out/cache/$model.csv" --chart "$out/cache/$model.png" >/dev/null
    done
}

for part; do
    case $part in
    ring) rings ;;
    validate) validate ;;
    cache) caches ;;
    *)
        echo "no part '$part': ring, validate, cache" >&2
        exit 2
        ;;
    esac
done
