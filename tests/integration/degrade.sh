# SPDX-License-Identifier: Apache-2.0
# A node that gets too dear while it runs lowers its quality and takes it back; without `degrade` it overruns on and on.
# Judged by CPU time and planned releases. Deadlines are long, so that only a machine that lets the job wait for most of
# a period, twice in a row, changes the outcome.
source "$(dirname "$0")/lib.sh" "$@"

cat >"$work/graph.yaml" <<'YAML'
takt: 1
name: one_load
schedule: schedule.yaml
subsystems:
  work:
    load: {type: load, params: {work: 4ms}}
YAML

run_with() { # VERB: 4 ms of 10 for a while, then 25 ms for 3 s, then 4 ms again
  printf 'takt: 1\nname: %s\npolicy: deadline\nnodes:\n  load: {rate: 15, budget: 10ms, deadline: 1/15 s, criticality: high, on_overrun: %s}\n' "$1" "$1" >"$work/schedule.yaml"
  "$takt" run "$work/graph.yaml" --for 10s --output "$work/out" --report "$work/$1.json" >"$work/$1.log" 2>&1 & local run=$!
  until "$takt" top --once --run $run >/dev/null 2>&1; do sleep 0.1; kill -0 $run 2>/dev/null || break; done
  sleep 1
  "$takt" set --run $run load.work 25ms || fail "$1: work could not be raised"
  sleep 3
  "$takt" set --run $run load.work 4ms || fail "$1: work could not be lowered"
  wait $run
  [ $? -le 1 ] || { cat "$work/$1.log"; fail "$1: the run failed"; }
  grep -i quality "$work/$1.log"
}

export XDG_RUNTIME_DIR=$work  # no other run is in the way
run_with continue
run_with degrade
python3 - "$work" <<'PY' || fail "the reports do not show what they should"
import json, sys
node = {verb: json.load(open(f"{sys.argv[1]}/{verb}.json"))["nodes"][0] for verb in ("continue", "degrade")}
for verb, n in node.items():
    print(verb, n["budget_overruns"], "overruns in", n["samples"], "jobs;", n["quality"], n["quality_changes"])
    assert sum(n["quality"].values()) == n["samples"]
assert node["continue"]["budget_overruns"] > 10 and node["continue"]["quality_changes"]["count"] == 0
changes = node["degrade"]["quality_changes"]
assert node["degrade"]["budget_overruns"] <= 3, "25 ms overran a budget of 10 again and again"
assert changes["count"] >= 2 and changes["last"][-1]["level"] == 0, "quality did not come back"
lowered, back = changes["last"][0]["at_s"], changes["last"][-1]["at_s"]
assert back - lowered < 3 + 5 + 0.5, (lowered, back)
PY
finish
