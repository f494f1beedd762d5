#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What a record or the ring costs the run: record_cost.sh [PAIRS] [SECONDS] [record|ring]. Runs without and with --record (or
# with --ring off and on), A B A B ... A. Prints CPU, MB/s and what was lost for each, and lateness p50 and p99 over the high-criticality nodes, each B over the
# mean of its neighbours.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
pairs=${1:-6} seconds=${2:-20} what=${3:-record}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
one_run() { # NAME OPTIONS
  local name=$1
  shift
  "$takt" run --for "${seconds}s" --output "$work/out" --report "$work/$name.json" "$@" >"$work/log" 2>&1 || true
  [ -e "$work/$name.json" ] || { tail -n 2 "$work/log"; exit 3; }
  rm -rf "$work/run.mcap" "$work/out"
}
with=(--ring off --record "$work/run.mcap")
[ "$what" = record ] || with=(--ring on)
one_run a0 --ring off
for ((i = 1; i <= pairs; ++i)); do
  one_run "b$i" "${with[@]}"
  one_run "a$i" --ring off
done
python3 - "$work" "$pairs" <<'PY'
import json, statistics, sys
work, pairs = sys.argv[1], int(sys.argv[2])
reports = {name: json.load(open(f"{work}/{name}.json")) for i in range(pairs + 1) for name in ([f"a{i}"] if i == 0 else [f"a{i}", f"b{i}"])}
def late(name, q):
    return statistics.mean(n["lateness_us"][q] for n in reports[name]["nodes"] if n["criticality"] == "high")
def misses(name): return sum(n["deadline_misses"] for n in reports[name]["nodes"])
ratios = {"p50": [], "p99": []}
cpu = []
for i in range(1, pairs + 1):
    b = reports[f"b{i}"]
    before, after = reports[f"a{i-1}"], reports[f"a{i}"]
    cpu.append(b["cpu"]["utilisation"] - (before["cpu"]["utilisation"] + after["cpu"]["utilisation"]) / 2)
    for q in ratios: ratios[q].append(2 * late(f"b{i}", q) / (late(f"a{i-1}", q) + late(f"a{i}", q)))
    if "record" in b:
        copying, writing = (b["record"]["cpu_ms"][k] / 10 / b["duration_s"] for k in ("copying", "writing"))
        kept = f"{b['record']['mb'] / b['duration_s']:.1f} MB/s, lost {b['recorder_lost']}, copying {copying:.1f} %, writing {writing:.1f} %"
    else:
        kept = ", ".join(f"{place} {ring['cpu_ms'] / 10 / b['duration_s']:.1f} %, lost {ring['lost']}"
                         for place in ("disk", "memory") if (ring := b["flight"][place]))
    print(f"pair {i}: {kept}; CPU +{100 * cpu[-1]:.1f} % of a core; misses {misses(f'b{i}')} against {misses(f'a{i-1}')} and "
          f"{misses(f'a{i}')}; lateness p99 {late(f'b{i}', 'p99'):.0f} us against {late(f'a{i-1}', 'p99'):.0f} and {late(f'a{i}', 'p99'):.0f}; "
          f"host stall {b['host_stall_ms']} ms; policy {b['policy_granted']}")
for q in ratios:
    print(f"lateness {q}, recorded over not: median {statistics.median(ratios[q]):.3f} of {pairs} pairs ({min(ratios[q]):.2f} to {max(ratios[q]):.2f})")
print(f"CPU: median +{100 * statistics.median(cpu):.1f} % of a core")
PY
