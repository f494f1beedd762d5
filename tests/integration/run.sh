# SPDX-License-Identifier: Apache-2.0
# The main job, short: it counts its releases right, ends on a signal, and two runs live side by side. Deadlines are not
# judged here: a shared machine would make that a coin toss.
source "$(dirname "$0")/lib.sh" "$@"

check_report() { # releases = ceil((duration - offset) * rate), every job accounted for, pools empty at the end
  python3 - "$1" <<'PY' || fail "report $1"
import json, sys
report = json.load(open(sys.argv[1]))
for node in report["nodes"]:
    done = node["completed"] + node["skipped"] + node["reused"]
    assert node["released"] == done, (node["name"], node["released"], done)
    assert node["rate_hz"] is None or abs(node["released"] - node["rate_hz"] * report["duration_s"]) <= 1, node["name"]
for edge in report["edges"]:
    assert edge["received"] + edge["dropped"] <= edge["sent"], edge
assert report["memory"]["pools"] and report["edges"]
PY
}

run_ok() { # exit 0 or 1 (a deadline missed on this machine), nothing else
  "$takt" run "$@" >"$work/stdout" 2>"$work/stderr"
  local code=$?
  cat "$work/stdout"
  [ $code -le 1 ] || { cat "$work/stderr"; fail "exit $code: $*"; }
}

run_ok --for 3s --policy cooperative --report "$work/a.json" --output "$work/out"
command -v python3 >/dev/null && check_report "$work/a.json"
ls "$work"/out/*.png >/dev/null || fail "no picture was written"

# Virtual time gives the same pictures every time.
run_ok --clock virtual --for 3s --report "$work/v.json" --output "$work/v"
run_ok --clock virtual --for 3s --report "$work/w.json" --output "$work/w"
for picture in left disparity track obstacles; do
  cmp "$work/v/$picture.png" "$work/w/$picture.png" || fail "$picture.png differs between two runs in virtual time"
done
command -v python3 >/dev/null && check_report "$work/v.json"

# Two runs beside one another, both stopped by a signal; how long that takes is told, not judged.
for signal in INT TERM; do
  start_run one --for 0s; first=$run
  start_run two --for 0s; second=$run
  start=$(date +%s%N)
  kill -$signal $first $second
  wait $first; a=$?
  wait $second; b=$?
  took=$((($(date +%s%N) - start) / 1000000))
  echo "SIG$signal ended both in $took ms, exit $a and $b"
  [ $a -le 1 ] && [ $b -le 1 ] || fail "exit $a and $b after SIG$signal: $(cat "$work/one.err" "$work/two.err")"
  grep -q "CPU" "$work/one.out" || fail "no summary after SIG$signal"
done

# A signal at any moment, also while the run is being prepared, ends it; 143: before the program could install its
# handler.
for delay in 0.01 0.05 0.1 0.2 0.3 0.5 0.8; do
  "$takt" run --for 0s --policy cooperative --output "$work/one" >"$work/1" 2>&1 & first=$!
  sleep $delay
  start=$(date +%s%N)
  kill -TERM $first
  wait $first; code=$?
  took=$((($(date +%s%N) - start) / 1000000))
  echo "SIGTERM after $delay s ended it in $took ms, exit $code"
  [ $code -le 1 ] || [ $code -eq 143 ] || fail "exit $code after SIGTERM at $delay s"
done
finish
