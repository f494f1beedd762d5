# SPDX-License-Identifier: Apache-2.0
# A process is killed, and before it is back a stranger has taken the bandwidth of its reservations: it comes back all the
# same, its jobs run beside a reservation under SCHED_FIFO, and once the stranger has gone it has its reservations again.
# All of that is counted and told.
source "$(dirname "$0")/lib.sh" "$@"

cat >"$work/graph.yaml" <<YAML
takt: 1
name: takeover
schedule: schedule.yaml
isolation: subsystem
subsystems:
  guard: {guard: {type: load, params: {work: 1ms}}}
  other: {other: {type: load, params: {work: 1ms}}}
YAML
cat >"$work/schedule.yaml" <<'YAML'
takt: 1
name: takeover
policy: deadline
nodes:
  guard: {rate: 10, budget: 8ms, deadline: 90ms, criticality: high}
  other: {rate: 10, budget: 8ms, deadline: 90ms}
YAML

completed() { "$takt" top --json --once --run $run | python3 -c 'import json, sys; print(sum(n["completed"] for n in json.load(sys.stdin)["nodes"] if n["name"] == "guard"))'; }

policy=deadline
start_run run "$work/graph.yaml" --for 0s --report "$work/report.json"
grep -q "policy deadline -> cooperative" "$work/run.err" && { kill $run; wait $run; echo "NOT RUN: SCHED_DEADLINE is refused"; exit 77; }
coproc stranger { exec python3 "$source/tests/tools/bandwidth_stranger.py" >"$work/stranger" 2>&1; }
said taken "$work/stranger"
sleep 1
kill -KILL "$(pgrep -x guard -P $run)"
said "process guard is back" "$work/run.err"
sleep 1.5  # longer than its own bandwidth could have been under way
before=$(completed)
sleep 1
[ "$(completed)" -gt $((before + 5)) ] || fail "without a reservation its jobs do not run: $before, then $(completed)"
eval "exec ${stranger[1]}>&-"
wait $stranger_PID 2>/dev/null
cat "$work/stranger"
sleep 1
expect 0 "" "$takt" stop --run $run
wait $run
[ "$(grep -c "is started again" "$work/run.err")" -eq 1 ] || { cat "$work/run.err"; fail "it was started more than once"; }
python3 - "$work/report.json" <<'PY' || { cat "$work/run.err"; fail "the report is wrong"; }
import json, re, sys
report = json.load(open(sys.argv[1]))
told = [f["what"] for f in report["faults"] if f.get("kind") == "bandwidth"]
print(*told, sep="\n")
assert len(told) == 2 and "guard: its reservation is not free" in told[0], told
refused = re.search(r"guard: it has its reservation after \d+ ms; it was refused (\d+) times", told[1])
assert refused and int(refused[1]) >= 10, told
granted = next(n for n in report["nodes"] if n["name"] == "guard")["granted"]
assert granted["policy"] == "deadline" and granted["verified"], granted
outages = [f for f in report["faults"] if f.get("kind") == "outage"]
assert len(outages) == 1 and outages[0]["back_s"] is not None, outages
PY
finish
