#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The main job beside stress-ng: stress.sh [ROUNDS] [SECONDS] [POLICY...]. Each round runs it under the policies named, or
# under deadline and fixed and, the first time, under cooperative (for contrast), beside four CPU and one memory stressor.
# One line a run, below it why each job missed (takt explain), the worst at the end; exit 1 if a high-criticality node
# missed a deadline or a rate was not kept under deadline or fixed. Beside each run stands how late cyclictest was woken on
# the same CPUs: what no program could help.
set -u
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
rounds=${1:-10} seconds=${2:-60} policies=${*:3}
command -v stress-ng >/dev/null || { echo "stress-ng is not installed: apt install stress-ng"; exit 3; }
work=$(mktemp -d)
trap 'rm -rf "$work"; kill $stress 2>/dev/null' EXIT
stress-ng --cpu 4 --vm 1 --vm-bytes 256M --quiet &
stress=$!
for ((round = 1; round <= rounds; ++round)); do
  for policy in ${policies:-deadline fixed $([ $round -eq 1 ] && echo cooperative)}; do
    rm -f "$work/probe.json"
    python3 "$root/bench/scenarios/host_probe.py" "$seconds" "$work/probe.json" &
    "$root/takt" run --for "${seconds}s" --policy $policy --output "$work/out" --report "$work/$round.$policy.json" --trace "$work/trace.json" >"$work/log" 2>&1
    [ -e "$work/$round.$policy.json" ] || { echo "round $round, $policy: no report: $(tail -n 1 "$work/log")"; exit 3; }
    wait $!  # for the probe
    kill -0 $stress 2>/dev/null || { echo "stress-ng has ended"; exit 3; }
    python3 - "$work/$round.$policy.json" "$round" "$work/probe.json" <<'PY'
import host_probe, json, sys
report = json.load(open(sys.argv[1]))
missed = {n["name"]: n["deadline_misses"] for n in report["nodes"] if n["deadline_misses"]}
behind = {n["name"]: n["released"] - n["completed"] for n in report["nodes"] if n["completed"] < n["released"] - 1}
late = max(n["lateness_us"]["max"] or 0 for n in report["nodes"] if n["criticality"] == "high")
print(f"round {sys.argv[2]}: {report['policy_granted']:<11} missed {missed or 'none'}, behind {behind or 'none'}, "
      f"latest start of a high node {late / 1000:.1f} ms, host stall {report['host_stall_ms']} ms; "
      f"{host_probe.text(sys.argv[3], 14)}", flush=True)
PY
    [ $policy = cooperative ] || "$root/takt" explain "$work/trace.json" | grep -v '^no job missed$' | sed 's/^/    /'
  done
done
python3 - "$work" <<'PY'
import glob, json, sys
bad = False
for policy in ("deadline", "fixed", "cooperative"):
    reports = [json.load(open(f)) for f in glob.glob(f"{sys.argv[1]}/*.{policy}.json")]
    if not reports: continue
    high = [sum(n["deadline_misses"] for n in r["nodes"] if n["criticality"] == "high") for r in reports]
    low = [sum(n["deadline_misses"] for n in r["nodes"] if n["criticality"] == "low") for r in reports]
    behind = [sum(n["completed"] < n["released"] - 1 for n in r["nodes"]) for r in reports]
    granted = {r["policy_granted"] for r in reports}
    print(f"{policy} (granted {', '.join(granted)}): {len(reports)} runs, high-criticality misses {sum(high)} (worst run {max(high)}), "
          f"low {sum(low)} (worst {max(low)}), runs with a rate not kept {sum(b > 0 for b in behind)}")
    bad = bad or (policy != "cooperative" and (sum(high) > 0 or any(behind) or granted != {policy}))
sys.exit(bad)
PY
