#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# From scan stamp to stop command while every other node asks for more than there is: overload.sh [SECONDS]. The other
# nodes run at several times their rate and cost; the check is told to let that pass. Prints the chain `stop` of a quiet run and
# of overloaded ones under each policy.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
seconds=${1:-20}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed -E -e 's/(head_camera: \{rate: )15, budget: 8ms, deadline: 25ms/\130, budget: 5ms, deadline: 30ms/' \
  -e 's/(ground_camera: \{rate: )5, offset: 5ms, budget: 8ms, deadline: 60ms/\115, offset: 5ms, budget: 5ms, deadline: 60ms/' \
  -e 's/(stereo: \{rate: )15, offset: 26ms, budget: 20ms/\150, offset: 26ms, budget: 20ms/' \
  -e 's/(ego_motion: \{rate: )10/\150/; s/(object_detection: \{rate: )7/\140/; s/(ground_map: \{rate: )5/\150/' \
  -e 's/(mapping_3d: \{rate: )2/\140/; s/deadline: (1\/15 s|80ms|1\/7 s|100ms|400ms|450ms)/deadline: 20ms/' \
  -e 's/budget: ([0-9]{2}|6)ms, deadline: 20ms/budget: 3ms, deadline: 20ms/' "$root/schedules/thesis.yaml" >"$work/overload.yaml"
for row in 'head_camera: {rate: 30' 'ground_camera: {rate: 15' 'stereo: {rate: 50' 'ego_motion: {rate: 50' 'object_detection: {rate: 40' \
  'ground_map: {rate: 50' 'mapping_3d: {rate: 40'; do
  grep -qF "$row" "$work/overload.yaml" || { echo "schedules/thesis.yaml has changed: no row \`$row\`; mend this script"; exit 1; }
done

show() { # NAME
  python3 - "$work/$1.json" "$1" <<'PY'
import json, sys
report = json.load(open(sys.argv[1]))
chain = next(c for c in report["chains"] if c["name"] == "stop")["age_ms"]
stop = next(n for n in report["nodes"] if n["name"] == "obstacle_stop")
others = [n for n in report["nodes"] if n["name"] not in ("obstacle_stop", "front_laser", "lines", "base", "head")]
behind = sum(n["released"] - n["completed"] for n in others)
print(f"{sys.argv[2]:<22} scan to stop p50 {chain['p50']:.1f} ms, p99 {chain['p99']:.1f}, max {chain['max']:.1f}; obstacle_stop "
      f"{stop['completed']} of {stop['released']} jobs, {stop['deadline_misses']} misses; the others fell {behind} jobs behind; "
      f"CPU {report['cpu']['utilisation']:.2f} cores, policy {report['policy_granted']}, host stall {report['host_stall_ms']} ms")
PY
}

"$root/takt" run --for "${seconds}s" --output "$work/out" --report "$work/quiet.json" >/dev/null 2>&1 || true
show quiet
for policy in deadline fixed cooperative; do
  "$root/takt" run --for "${seconds}s" --policy $policy --schedule "$work/overload.yaml" --unchecked --set stereo.disparities=500 \
    --output "$work/out" --report "$work/$policy.json" >"$work/log" 2>&1 || true
  if [ -e "$work/$policy.json" ]; then show $policy; else tail -n 2 "$work/log"; fi
done
