# SPDX-License-Identifier: Apache-2.0
# takt top in a terminal: each page and key, from 40 to 200 columns; the terminal is given back after q, Ctrl-C, signals,
# a suspension and the end of the run; a run that has let go of it is found again. Elsewhere it prints what other programs read.
source "$(dirname "$0")/lib.sh" "$@"
in_terminal() { python3 "$source/tests/integration/top_keys.py" "$takt" "$run" "$1" || fail "in a terminal: $1"; }

start_run main --isolate subsystem --for 0s
for case in pages narrow plain term hangup suspended held; do
  echo "=== in a terminal: $case"
  in_terminal $case
done

echo "=== elsewhere"
expect 0 "" "$takt" top --once --run $run
prints "ace (sim profile, "
prints "node                  Hz  completed  missed skipped  paused   CPU ms  resp ms"
grep -q $'\x1b' "$work/stdout" && fail "sequences for a terminal in a file"
"$takt" top --json --run $run | head -n 2 >"$work/lines"
python3 -c 'import json, sys; assert [sorted(json.loads(line)) for line in sys.stdin] == [sorted(["graph", "profile", "transport", "running_s", "parameters", "frozen", "nodes"])] * 2' \
  <"$work/lines" || fail "two lines of JSON"

echo "=== in a terminal: the run is stopped"
in_terminal stopped
wait $run
got=$?
[[ " 0 1 " == *" $got "* ]] || fail "the run ended with $got"
finish
