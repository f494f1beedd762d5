#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Four low-criticality saboteurs beside three high-criticality nodes and a reader: saboteur.sh [SECONDS]. One spins for
# ever, takes 1 GB, sleeps in its jobs, or sends until it is refused. Under `deadline` and `fixed`, in one process (the spinner
# then spins once, to the end) and in one for each subsystem (which is killed for it and starts again, to spin 3 s later); under
# `cooperative` in processes, for contrast. Prints what each node noticed or did; exit 1 if under `deadline` or `fixed` anybody
# else missed a deadline or its rate, or a saboteur is not named for what it did; 3 if one of these policies is refused.
# `saboteur.sh inputs` only has the graph checked.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt} graph=$root/bench/scenarios/saboteur.yaml
seconds=${1:-20}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ "$seconds" = inputs ]; then
  for policy in deadline fixed; do "$takt" check "$graph" --policy $policy >"$work/check" || { [ $? -eq 1 ] && head -n 2 "$work/check"; }; done
  exit
fi
worst=0
for run in deadline:none deadline:subsystem fixed:none fixed:subsystem cooperative:subsystem; do
  policy=${run%:*} isolation=${run#*:}
  rm -f "$work/report.json"
  "$takt" run "$graph" --for "${seconds}s" --policy "$policy" --isolate "$isolation" --output "$work/out" --report "$work/report.json" \
    >"$work/log" 2>&1 && code=0 || code=$?
  if [ ! -e "$work/report.json" ]; then
    echo "$run: no report, exit $code: $(tail -n 1 "$work/log")"
    [ $worst -eq 1 ] || worst=$code
    continue
  fi
  python3 - "$work/report.json" "$policy" "$isolation" "$seconds" <<'PY' || worst=1
import json, sys
report, policy, isolation, seconds = json.load(open(sys.argv[1])), *sys.argv[2:]
nodes = {node["name"]: node for node in report["nodes"]}
print(f"{policy}, isolation {isolation}: granted {report['policy_granted']}, {report['duration_s']:.1f} s, {report['memory']['rss_mb']:.0f} MB "
      f"resident, host stall {report['host_stall_ms']} ms")
for name, node in nodes.items():
    text = f"  {name:<8} {node['criticality']:<4} {node['completed']:>5} of {node['released']:>5} jobs, {node['deadline_misses']:>3} misses"
    if node["criticality"] == "high" and node["samples"]:
        text += f", response p99 {node['response_ms']['p99']:.2f} ms, max {node['response_ms']['max']:.2f}"
    for key in ("budget_overruns", "demoted"):
        if node[key]: text += f", {key} {node[key]}"
    if node["enforcement_error_us"] is not None: text += f" at most {node['enforcement_error_us']:.0f} us late"
    if node["rt_violations"]: text += f", calls in jobs {node['rt_violations']}"
    print(text)
refused = {pool["port"]: pool["exhausted"] for pool in report["memory"]["pools"]}
if refused["flooder.output"]: print(f"  messages refused: flooder.output {refused['flooder.output']}")
faults = [(fault.get("node"), fault.get("kind")) for fault in report["faults"]]
for fault in report["faults"]: print("  fault:", fault["what"])
if policy == "cooperative": sys.exit()
spins = 1 if isolation == "none" else int(float(seconds) / 6)  # a process lives for 3 s, hangs for 1, and has to come back
wrong = [f"{name}: touched" for name in ("fast", "steady", "slow", "reader")
         if nodes[name]["deadline_misses"] or nodes[name]["completed"] < nodes[name]["released"] - 1]
for what, ok in ((f"policy {report['policy_granted']}", report["policy_granted"] == policy),
                 (f"spinner: named {faults.count(('spinner', 'hang'))} times of {spins}", faults.count(("spinner", "hang")) >= spins),
                 ("hoarder: not named", ("hoarder", "memory") in faults and report["memory"]["rss_mb"] < 800),
                 ("sleeper: not named", (nodes["sleeper"]["rt_violations"] or {}).get("sleep", 0) > 10),
                 # What a killed process had refused, nobody is left to tell.
                 ("flooder: not named", isolation != "none" or refused["flooder.output"] > nodes["flooder"]["completed"] / 2)):
    if not ok: wrong.append(what)
print("  " + ("; ".join(wrong) or "others untouched, saboteurs named"))
sys.exit(len(wrong) > 0)
PY
done
exit $worst
