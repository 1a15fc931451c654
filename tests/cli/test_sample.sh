# quadplan sample: points from the command line and from files, against the reference that it prints itself.
source "$(dirname "$0")/common.sh"

run sample --help
check "help" [ "$code" -eq 0 ]
check "help names --uv" grep -q -- '--uv U,V' "$work/stdout"

for precision in float double; do
    printf 'patch,u,v\n# any numbers in [0,1]\n0,0,0\n3, 0.1 ,0.7\n\n2,1e-12,0.3333333333333333\n1,1,0.99999999999\n' \
        >"$work/points.csv"
    run sample gen:fan,n=5 --points "$work/points.csv" --precision "$precision" --reference --device host --json
    check "$precision" [ "$code" -eq 0 ]
    keys sample mesh precision device samples
    value 'len(o["samples"]) == 4 and [s["patch"] for s in o["samples"]] == [0, 3, 2, 1]'
    value 'all(sorted(s) == sorted(["patch", "u", "v", "p", "du", "dv", "n", "flags", "reference"]) for s in o["samples"])'
    value 'o["samples"][2]["u"] == 1e-12 and o["samples"][0]["flags"] == 4 and o["samples"][1]["flags"] == 0'
    [ "$precision" = float ] && bound=1e-6 || bound=1e-13
    value "all(abs(a - b) < $bound for s in o['samples'] for k in ('p', 'n') for a, b in zip(s[k], s['reference'][k]))"
    value "all(abs(a - b) < 4 * $bound for s in o['samples'] if s['flags'] == 0
               for k in ('du', 'dv') for a, b in zip(s[k], s['reference'][k]))"
done

run sample gen:cube --patch 0 --uv 0.5,0.5 --precision double --device host --json
# The middle of a face of a cube of side 2 goes to 68/81.
value 'abs(max(abs(x) for x in o["samples"][0]["p"]) - 68 / 81) < 1e-14'
printf '0,0.25,0.75\n' >"$work/one.csv"
"$QUADPLAN_PROGRAM" sample gen:cube --points - --device host <"$work/one.csv" >"$work/a" 2>&1
"$QUADPLAN_PROGRAM" sample gen:cube --patch 0 --uv 0.25,0.75 --device host >"$work/b" 2>&1
check "standard input" cmp "$work/a" "$work/b"
run sample gen:fan,n=5 --patch 0 --uv 0,0 --device host
check "says limit frame" grep -q 'limit frame' "$work/stdout"

printf '0,0.5,0.5\n0,0.5\n' >"$work/bad.csv"
refuses "a bad line" 2 "bad.csv:2: '0,0.5' is no point" sample gen:cube --points "$work/bad.csv"
printf '0,nan,0.5\n' >"$work/bad.csv"
refuses "not a number" 2 "bad.csv:1:" sample gen:cube --points "$work/bad.csv"
refuses "no such file" 2 "none.csv" sample gen:cube --points "$work/none.csv"
refuses "outside" 2 "is not in \[0, 1\]" sample gen:cube --patch 0 --uv 0.5,1.5
refuses "no such patch" 2 "there is no patch 6" sample gen:cube --patch 6 --uv 0,0
refuses "half a point" 2 "give either" sample gen:cube --patch 0
refuses "both" 2 "give either" sample gen:cube --patch 0 --uv 0,0 --points "$work/one.csv"
refuses "no point" 2 "not of the form U,V" sample gen:cube --patch 0 --uv 0.5
finish
