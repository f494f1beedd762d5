#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# From scan stamp to stop command while every other node asks for more than there is: overload.sh [SECONDS]. The others
# get four times their rate, a fourth of their budgets and deadlines, and low criticality: they reserve what they did before and
# want four times that; both stereo nodes match in adaptive windows, which takes all that is left of two CPUs. Prints the chain
# `stop` of a quiet run and of overloaded ones under each policy; exit 1 if under `deadline` or `fixed` the chain exceeded its
# bound, obstacle_stop missed a deadline, or there was no overload.
# `overload.sh inputs` only makes the schedule and has it read.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
takt=${TAKT:-$root/takt}
seconds=${1:-20}
dear=(--set stereo.aggregation=adaptive_window --set stereo_wide.aggregation=adaptive_window)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 - "$root/schedules/thesis.yaml" "$work/overload.yaml" <<'PY'
import sys
from schedule_lines import Schedule, in_us, seconds
FACTOR = 4
schedule = Schedule(sys.argv[1])
schedule.change("obstacle_stop", criticality="high")
for node, says in schedule.nodes.items():
    if node in ("obstacle_stop", "front_laser", "lines", "base", "head"): continue
    changed = {key: in_us(seconds(says[key]) / FACTOR) for key in ("offset", "budget", "deadline") if key in says}
    if "rate" in says: changed["rate"] = str(FACTOR * int(says["rate"]))
    if "criticality" in says: changed["criticality"] = "low"
    schedule.change(node, **changed)
schedule.write(sys.argv[2])
PY
if [ "${1:-}" = inputs ]; then
  "$takt" check "$root/graph/ace.yaml" --schedule "$work/overload.yaml" "${dear[@]}" >"$work/check" || [ $? -eq 1 ]
  exit
fi

run() { # NAME OPTIONS...
  "$takt" run "$root/graph/ace.yaml" --for "${seconds}s" --output "$work/out" --report "$work/$1.json" "${@:2}" >"$work/log" 2>&1 ||
    [ -e "$work/$1.json" ] || tail -n 2 "$work/log"
}
run quiet
for policy in deadline fixed cooperative; do
  run $policy --policy $policy --schedule "$work/overload.yaml" --unchecked "${dear[@]}"
done
python3 - "$work" <<'PY'
import json, os, sys
wrong = []
for name in ("quiet", "deadline", "fixed", "cooperative"):
    file = f"{sys.argv[1]}/{name}.json"
    if not os.path.exists(file):
        if name != "cooperative": wrong.append(f"{name} did not run")
        continue
    report = json.load(open(file))
    chain = next(c for c in report["chains"] if c["name"] == "stop")
    stop = next(n for n in report["nodes"] if n["name"] == "obstacle_stop")
    others = [n for n in report["nodes"] if n["name"] not in ("obstacle_stop", "front_laser", "lines", "base", "head")]
    behind = sum(n["released"] - n["completed"] for n in others)
    age = chain["age_ms"]
    print(f"{name:<12} scan to stop p50 {age['p50']:.1f} ms, p99 {age['p99']:.1f}, max {age['max']:.1f} of {chain['bound_ms']:.0f}; obstacle_stop "
          f"{stop['completed']} of {stop['released']} jobs, {stop['deadline_misses']} misses; the others fell {behind} jobs behind; "
          f"CPU {report['cpu']['utilisation']:.2f} cores, policy {report['policy_granted']}, host stall {report['host_stall_ms']} ms")
    if name not in ("deadline", "fixed"): continue
    if not chain["within"] or stop["deadline_misses"] or stop["completed"] < stop["released"] - 1: wrong.append(f"{name}: the stop was touched")
    if behind < sum(n["released"] for n in others) / 10: wrong.append(f"{name}: no overload")
print("\n".join(wrong) or "the stop was not touched")
sys.exit(len(wrong) > 0)
PY
