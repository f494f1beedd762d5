#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Four low-criticality saboteurs beside three high-criticality nodes: saboteur.sh [SECONDS]. Prints, per policy, what the
# high nodes noticed and what the report says of each saboteur; then how late after its budget a spinning job was
# stopped. Needs the right to real-time policies.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
seconds=${1:-20}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for policy in deadline fixed cooperative; do
  "$root/takt" run "$root/bench/scenarios/saboteur.yaml" --unchecked --for "${seconds}s" --policy $policy --set spinner.stuck_every=3s \
    --set spinner.stuck_for=2s --output "$work/out" --report "$work/report.json" >"$work/log" 2>&1 || true
  if [ ! -e "$work/report.json" ]; then
    tail -n 2 "$work/log"
    continue
  fi
  python3 - "$work/report.json" $policy <<'PY'
import json, sys
report = json.load(open(sys.argv[1]))
print(f"{sys.argv[2]}: granted {report['policy_granted']}, {report['duration_s']:.1f} s, host stall {report['host_stall_ms']} ms")
for node in report["nodes"]:
    text = f"  {node['name']:<8} {node['criticality']:<4} {node['completed']:>5} of {node['released']:>5} jobs, {node['deadline_misses']:>3} misses"
    if node["criticality"] == "high":
        text += f", response p99 {node['response_ms']['p99']:.2f} ms, max {node['response_ms']['max']:.2f}"
    for key in ("budget_overruns", "demoted"):
        if node[key]:
            text += f", {key} {node[key]}"
    if node["enforcement_error_us"] is not None:
        text += f" at most {node['enforcement_error_us']:.0f} us late"
    if node["rt_violations"]:
        text += f", calls in jobs {node['rt_violations']}"
    print(text)
for fault in report["faults"]:
    print("  fault:", fault["what"])
PY
  rm "$work/report.json"
done
