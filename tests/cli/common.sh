# Sourced by the command-line tests. Needs QUADPLAN_PROGRAM and QUADPLAN_SOURCE_DIR, which ctest sets.
set -u
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
checks=0
failures=0

# check NAME COMMAND...: counts one check; the command must succeed.
check() {
    local name=$1
    shift
    checks=$((checks + 1))
    if ! "$@" >"$work/check.log" 2>&1; then
        failures=$((failures + 1))
        echo "failed: $name" >&2
        head -n 5 "$work/check.log" >&2
    fi
}

# run ARGUMENTS...: runs the program; sets $code, and fills $work/stdout and $work/stderr.
run() {
    timeout 120 "$QUADPLAN_PROGRAM" "$@" >"$work/stdout" 2>"$work/stderr" </dev/null
    code=$?
}

# One line on stderr, and nothing else: no sanitizer's report either.
one_line() {
    [ "$(wc -l <"$work/stderr")" -eq 1 ] && grep -q '^quadplan: ' "$work/stderr"
}

# refuses NAME CODE PATTERN ARGUMENTS...: the exit code, one line that matches PATTERN, no output.
refuses() {
    local name=$1 expected=$2 pattern=$3
    shift 3
    run "$@"
    check "$name: exit code $code, expected $expected" [ "$code" -eq "$expected" ]
    check "$name: one line" one_line
    check "$name: says $pattern" grep -qE "$pattern" "$work/stderr"
    check "$name: prints nothing" [ ! -s "$work/stdout" ]
}

# keys NAME KEY...: stdout is one JSON object that has these keys.
keys() {
    local name=$1
    shift
    check "$name: JSON keys" python3 -c '
import json, sys
o = json.load(open(sys.argv[1]))
lacking = [k for k in sys.argv[2:] if k not in o]
sys.exit("lacking: %s" % lacking if lacking else 0)' "$work/stdout" "$@"
}

# value EXPRESSION: a Python condition on o, the JSON object on stdout.
value() {
    check "$1" python3 -c 'import json, sys; o = json.load(open(sys.argv[1])); sys.exit(not ('"$1"'))' "$work/stdout"
}

finish() {
    echo "$checks checks, $failures failed"
    [ "$failures" -eq 0 ] && [ "$checks" -gt 0 ]
    exit
}
