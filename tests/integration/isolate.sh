# SPDX-License-Identifier: Apache-2.0
# Runs in several processes: the same report as in one, attachable, one beside the other, and what a killed process
# leaves behind. Deadlines are not judged here: a shared machine would make that a coin toss.
source "$(dirname "$0")/lib.sh" "$@"

traces() { ls /dev/shm /tmp "$XDG_RUNTIME_DIR/takt" 2>/dev/null | grep -E '^(takt-[0-9]|roudi|iceoryx|iox|[0-9]+\.sock)' | grep -v '\.lock$'; }
before=$(traces)
new_traces() { comm -13 <(sort <<<"$before") <(traces | sort); }
# What a test before this one had left may go meanwhile; nothing may come.
unchanged() { [ -z "$(new_traces)" ] || fail "$1 left behind: $(new_traces)"; }

ended() { # NAME CODE...
  wait $run
  local got=$? name=$1
  shift
  for code in "$@"; do [ $got -eq "$code" ] && return; done
  cat "$work/$name.err"
  fail "run $name: exit $got instead of $*"
}

"$takt" run --isolate none --for 3s --policy cooperative --report "$work/one.json" --output "$work/out" >/dev/null 2>&1
"$takt" run --isolate subsystem --for 3s --policy cooperative --report "$work/many.json" --output "$work/out" >"$work/stdout" 2>"$work/stderr"
[ $? -le 1 ] || { cat "$work/stderr"; fail "the isolated run failed"; }
cat "$work/stdout"
unchanged "an isolated run"
if command -v python3 >/dev/null; then
  python3 - "$work/one.json" "$work/many.json" <<'PY' || fail "the two reports differ in kind"
import json, sys
one, many = (json.load(open(name)) for name in sys.argv[1:])
assert many["isolation"] == "subsystem" and len(many["processes"]) >= 2, many["processes"]
assert one["isolation"] == "none"
shape = lambda r: [(n["name"], n["rate_hz"], n["released"]) for n in r["nodes"]]
assert shape(one) == shape(many), (shape(one), shape(many))
assert [(e["from"], e["to"]) for e in one["edges"]] == [(e["from"], e["to"]) for e in many["edges"]]
for node in many["nodes"]:
    assert node["released"] == node["completed"] + node["skipped"] + node["reused"], node
PY
fi

start_run first --isolate subsystem --for 0s
first=$run
grep -q "stereo" "$work/top" || fail "top does not show stereo"
expect 0 "" "$takt" echo stereo.disparity --png "$work/disparity.png" --run $first
grep -q '"type": "disparity"' "$work/stdout" || fail "echo shows no disparity"
head -c 4 "$work/disparity.png" | grep -q PNG || fail "echo wrote no PNG"
expect 0 "" "$takt" echo stereo.cloud --ply "$work/cloud.ply" --run $first
expect 0 "" "$takt" cloud "$work/cloud.ply" --reduce 0.1
grep -q "coloured" "$work/stdout" || fail "echo wrote no coloured cloud"
expect 0 "" "$takt" echo ego_motion.motion --count 3 --run $first
expect 2 "did you mean \`stereo.disparity\`" "$takt" echo stereo.disparty --run $first
expect 2 "is no picture" "$takt" echo ego_motion.motion --png "$work/x.png" --run $first
expect 2 "is no point cloud" "$takt" echo ego_motion.motion --ply "$work/x.ply" --run $first
expect 2 "must lie in" "$takt" set mapping_3d.n_abs 100000000 --run $first
expect 2 "without a unit" "$takt" set mapping_3d.z_floor 0.3 --run $first
expect 2 "is fixed while the graph runs (sizes memory)" "$takt" set mapping_3d.voxel 0.1m --run $first
expect 2 "did you mean \`stereo\`" "$takt" set stere.disparities 6 --run $first
expect 3 "no running graph" "$takt" top --once --run 1

# Another one beside it; nothing they use has a fixed place.
start_run second --isolate subsystem --for 0s
expect 3 "several graphs are running" "$takt" top --once
expect 0 "" "$takt" stop --run $run
ended second 0 1
expect 0 "" "$takt" echo stereo.disparity --run $first
expect 0 "" "$takt" stop --run $first
run=$first
ended first 0 1
grep -q "CPU" "$work/first.out" || fail "no summary after stop"
unchanged "a stopped run"

# The same processes over iceoryx, whose daemon has a fixed place.
start_run iceoryx --isolate subsystem --transport iceoryx --for 0s --report "$work/iceoryx.json"
first=$run
expect 0 "" "$takt" echo stereo.disparity --run $first
# A second one: with a /tmp and /dev/shm of its own where that is permitted, else refused with the reason.
if unshare -m true 2>/dev/null; then
  report=/tmp/takt-report-$$.json
  start_run second --isolate subsystem --transport iceoryx --for 0s --report "$report"
  grep -q "another iceoryx daemon is running" "$work/second.err" || fail "the second run does not say what it did"
  expect 0 "" "$takt" stop --run $run
  ended second 0 1
  grep -q '"isolation": "subsystem"' "$report" || fail "the report of the second run is not where it was asked for"
  rm -f "$report"
else
  expect 3 "another iceoryx daemon" "$takt" run --isolate subsystem --transport iceoryx --for 1s --output "$work/out"
fi
expect 0 "" "$takt" stop --run $first
run=$first
ended iceoryx 0 1
grep -q '"transport": "iceoryx"' "$work/iceoryx.json" || fail "the report does not name the transport"
unchanged "a run over iceoryx"

# One process can be spoken to as well.
start_run alone --isolate none --for 0s
expect 0 "" "$takt" echo stereo.disparity --run $run
expect 0 "" "$takt" stop --run $run
ended alone 0 1
unchanged "a stopped run in one process"

# Without the supervisor nobody goes on, and nothing is left.
start_run killed --isolate subsystem --for 0s
members=$(pgrep -P $run)
kill -KILL $run
wait $run 2>/dev/null
for ((i = 0; i < 50; ++i)); do
  alive=$(for member in $members; do kill -0 "$member" 2>/dev/null && echo "$member"; done)
  [ -z "$alive" ] && break
  sleep 0.1
done
[ -z "$alive" ] || fail "processes outlive their supervisor: $alive"
rm -f "$XDG_RUNTIME_DIR/takt/$run.sock"  # the next run removes it, too
unchanged "a run whose supervisor was killed"
for signal in INT TERM; do
  start_run signal --isolate subsystem --for 0s
  start=$(date +%s%N)
  kill -$signal $run
  ended signal 0 1
  echo "SIG$signal ended it in $((($(date +%s%N) - start) / 1000000)) ms"
done
unchanged "a run ended by a signal"
finish
