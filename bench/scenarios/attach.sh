#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What it costs a running graph to be looked at: attach.sh [PAIRS] [SECONDS]. Runs alone, then with `takt top` every half second,
# `takt echo` of a picture and of small messages, and `takt set`; A B A B ... A. Prints lateness p50 and p99 over all
# jobs of high-criticality nodes, each B over the mean of its neighbours, and the median ratio.
set -eu
takt=$(readlink -f "$(dirname "$0")/../../takt")
pairs=${1:-6} seconds=${2:-20}
work=$(mktemp -d)
trap 'rm -rf "$work"; kill $(jobs -p) 2>/dev/null || true' EXIT

one_run() { # NAME ATTENDED
  "$takt" run --for "${seconds}s" --output "$work/out" --report "$work/$1.json" >/dev/null 2>&1 & local run=$!
  if [ "$2" = yes ]; then
    until "$takt" top --once >/dev/null 2>&1; do kill -0 $run 2>/dev/null || { echo "the run $1 did not start"; exit 3; }; sleep 0.1; done
    "$takt" top --json >/dev/null 2>&1 & local top=$!
    (while "$takt" echo stereo.disparity --png "$work/d.png" --count 5 &&
      "$takt" echo ego_motion.motion --count 20 && "$takt" set obstacle_stop.scan_age_max 200ms; do :; done) >/dev/null 2>&1 & local echoes=$!
  fi
  wait $run || true
  [ "$2" = yes ] && { kill $top $echoes 2>/dev/null || true; wait $top $echoes 2>/dev/null || true; }
  return 0
}

one_run a0 no
for ((i = 1; i <= pairs; ++i)); do
  one_run "b$i" yes
  one_run "a$i" no
done
python3 - "$work" "$pairs" <<'PY'
import json, statistics, sys
work, pairs = sys.argv[1], int(sys.argv[2])
def figures(name):
    report = json.load(open(f"{work}/{name}.json"))
    nodes = [n for n in report["nodes"] if n["criticality"] == "high"]
    late = {q: statistics.mean(n["lateness_us"][q] for n in nodes) for q in ("p50", "p99")}
    return late, report["policy_granted"], sum(n["deadline_misses"] for n in nodes), report["host_stall_ms"]
ratios = {"p50": [], "p99": []}
for i in range(1, pairs + 1):
    before, after, attended = figures(f"a{i-1}"), figures(f"a{i}"), figures(f"b{i}")
    for q in ratios:
        ratios[q].append(attended[0][q] / ((before[0][q] + after[0][q]) / 2))
    print(f"pair {i}: attended p50 {attended[0]['p50']:.0f} us, p99 {attended[0]['p99']:.0f} us, alone p99 {before[0]['p99']:.0f} and "
          f"{after[0]['p99']:.0f} us; misses {attended[2]} against {before[2]} and {after[2]}; host stall {attended[3]} ms; policy {attended[1]}")
for q in ratios:
    print(f"lateness {q}, attended over alone: median {statistics.median(ratios[q]):.3f} of {pairs} pairs "
          f"({min(ratios[q]):.2f} to {max(ratios[q]):.2f})")
PY
