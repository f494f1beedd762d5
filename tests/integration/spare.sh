# SPDX-License-Identifier: Apache-2.0
# Spares: one takes the place of a process that is killed; one that is killed itself is replaced; where none is ready the
# process comes back the ordinary way. A message on which a process ends twice is passed over; where the next one ends it as
# well, the run stops safely. How soon is judged by bench/scenarios/kills.sh.
source "$(dirname "$0")/lib.sh" "$@"

cat >"$work/schedule.yaml" <<'YAML'
takt: 1
name: spare
policy: cooperative
nodes:
  slow: {rate: 1, deadline: 500ms}
  guard: {rate: 20, deadline: 50ms, criticality: high}
  other: {rate: 20, deadline: 50ms}
YAML
graph() { # NAME SPARE PARAMS OF GUARD
  cat >"$work/$1.yaml" <<YAML
takt: 1
name: $1
schedule: schedule.yaml
isolation: subsystem
subsystems:
  source: {exports: [slow.output], slow: {type: load, params: {work: 1ms}}}
  guard: {spare: $2, guard: {type: load, in: {input: slow.output}, params: {work: 1ms$3}}}
  other: {other: {type: load, params: {work: 1ms}}}
modes:
  safe_stop: {without: [other]}
YAML
}
told() { said "$1" "$work/$name.err" "${2:-1}"; }
# The process PID... whose name is $1, once there is one that waits (its threads are known by then).
pid() {
  for ((i = 0; i < 200; ++i)); do
    pgrep -x "$1" -P $run && return
    sleep 0.05
  done
  fail "there is no process $1"
}
waits() { # until the spare has composed its part: it sleeps on the board's word
  local spare
  spare=$(pid guard-spare)
  for ((i = 0; i < 200; ++i)); do
    grep -q futex "/proc/$spare/wchan" 2>/dev/null && return
    sleep 0.05
  done
  sleep 1  # where the kernel does not tell
}

name=kills
graph $name true ""
start_run $name "$work/$name.yaml" --for 0s --report "$work/$name.json"
waits
kill -KILL "$(pid guard-spare)"
told "the spare of process guard was ended by signal 9"
waits
spare=$(pid guard-spare)
kill -KILL "$(pid guard)"
told "process guard is back"
[ "$(pid guard)" = "$spare" ] || fail "the spare is not the process now"
waits
kill -STOP "$(pid guard-spare)"
kill -KILL "$(pid guard)"  # the spare is ready, and does not move: it is killed for that, and the process comes back
told "process guard is back" 2
expect 0 "" "$takt" stop --run $run
wait $run
[ $? -le 1 ] || fail "$name: exit code"
[ -z "$(pgrep -g $run)" ] || fail "$name: processes are left"

name=poison
graph $name false ", crash_from: 3, crash_to: 3"
start_run $name "$work/$name.yaml" --for 0s --report "$work/$name.json"
told "guard.input: process guard ended twice on message 4 of slow.output, which it does not get again"
told "process guard is back"
sleep 1.5
expect 0 "" "$takt" stop --run $run
wait $run
[ $? -le 1 ] || fail "$name: exit code"

name=poison_again
graph $name true ", crash_from: 3, crash_to: 4"
start_run $name "$work/$name.yaml" --for 0s --report "$work/$name.json"
told "ended twice on message 5"  # the second time in safe_stop
told "process guard is back" 2
expect 0 "" "$takt" stop --run $run
wait $run

python3 - "$work" <<'PY' || { cat "$work"/*.err; fail "a report is wrong"; }
import json, sys
kills, poison, again = (json.load(open(f"{sys.argv[1]}/{name}.json")) for name in ("kills", "poison", "poison_again"))
spare, = kills["spares"]
outages = [f for f in kills["faults"] if f.get("kind") == "outage"]
print(spare, *(o["what"] for o in outages), sep="\n")
assert spare["process"] == "guard" and spare["takeovers"] >= 1 and spare["lost"] >= 1 and spare["memory_mb"] > 0, spare
assert outages[0]["by_spare"] and outages[0]["back_s"] is not None, outages
assert all(o["process"] == "guard" for o in outages), outages
for report, passed in ((poison, 1), (again, 2)):
    fault = next(f for f in report["faults"] if f.get("kind") == "poison")
    edge = next(e for e in report["edges"] if e["to"] == "guard.input")
    print(fault["what"], edge)
    assert edge["passed_over"] == passed and fault["node"] == "guard", (fault, edge)
assert poison["spares"] == [] and len([f for f in poison["faults"] if f.get("kind") == "outage"]) == 1, poison["faults"]
assert not any(m["name"] == "safe_stop" for m in poison["modes"]), poison["modes"]
stopped = next(m for m in again["modes"] if m["name"] == "safe_stop")
print(stopped)
assert "ended on one message after the other" in json.dumps(again["modes"]), again["modes"]
PY
finish
