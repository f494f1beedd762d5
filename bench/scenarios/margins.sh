#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The margins that `takt check` reports of the thesis's schedule: margins.sh. With a budget larger by one percent less than
# its margin each node alone is admitted, with one percent more it is refused; exit 1 if not.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 - "$root" "$work/schedule.yaml" "${TAKT:-$root/takt}" <<'PY'
import json, subprocess, sys
from fractions import Fraction
from schedule_lines import Schedule, in_us, seconds
source, changed, takt = sys.argv[1:]
check = [takt, "check", f"{source}/graph/ace.yaml"]
nodes = json.loads(subprocess.run(check + ["--json"], capture_output=True, check=True).stdout)["nodes"]
wrong = 0
for node in nodes:
    schedule = Schedule(f"{source}/schedules/thesis.yaml")
    budget, margin = seconds(schedule.nodes[node["name"]]["budget"]), Fraction(node["margin_ms"]) / 1000
    codes = []
    for percent in (99, 101):
        schedule.change(node["name"], budget=in_us(budget + margin * percent / 100))
        schedule.write(changed)
        codes.append(subprocess.run(check + ["--schedule", changed], capture_output=True).returncode)
    print(f"{node['name']:18} {float(budget * 1000):7.3f} ms + {node['margin_ms']:.3f} ms: exit {codes[0]} below, {codes[1]} above")
    wrong += codes != [0, 1]
sys.exit(wrong > 0 or len(nodes) < 20)
PY
