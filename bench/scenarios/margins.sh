#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The margins that `takt check` reports of the thesis's schedule: margins.sh. With a budget larger by one percent less than
# its margin each node alone is admitted, with one percent more it is refused; exit 1 if not.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$root/takt" check "$root/graph/ace.yaml" --json >"$work/check.json"
python3 - "$root" "$work" <<'PY'
import json, re, subprocess, sys
source, work = sys.argv[1:]
nodes = json.load(open(f"{work}/check.json"))["nodes"]
text = open(f"{source}/schedules/thesis.yaml").read()
unit = {"us": 1e-3, "ms": 1.0}
wrong = 0
for node in nodes:
    found = re.search(rf"^(  {node['name']}: .*?budget: )([0-9.]+)(us|ms)", text, re.M)
    budget_ms = float(found.group(2)) * unit[found.group(3)]
    codes = []
    for share in (0.99, 1.01):
        changed = f"{found.group(1)}{round((budget_ms + share * node['margin_ms']) * 1000)}us"
        with open(f"{work}/schedule.yaml", "w") as file:
            file.write(text[:found.start()] + changed + text[found.end():])
        codes.append(subprocess.run([f"{source}/takt", "check", f"{source}/graph/ace.yaml", "--schedule", f"{work}/schedule.yaml"],
                                    capture_output=True).returncode)
    print(f"{node['name']:18} {budget_ms:7.3f} ms + {node['margin_ms']:.3f} ms: exit {codes[0]} below, {codes[1]} above")
    wrong += codes != [0, 1]
sys.exit(wrong > 0 or len(nodes) < 20)
PY
