#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Is a replay really the run? record.sh [SECONDS]. The main job beside stress-ng, its stereo node slowed in the middle third
# (`takt set stereo.search`) so that it degrades, is recorded; then every job runs again, alone and beside stress-ng, and
# every message is compared. Exit 1 if a byte differs or the record lacks something.
# `record.sh inputs` only makes the schedule and has it read.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
seconds=${1:-60}
work=$(mktemp -d)
trap 'rm -rf "$work"; kill $(jobs -p) 2>/dev/null || true' EXIT
# A budget that the usual search fits into and the long one exceeds (as in degrade.sh).
sed -E '/^ *stereo:/s/budget: [0-9]+ms/budget: 10ms/' "$root/schedules/thesis.yaml" >"$work/schedule.yaml"
grep -q '^ *stereo: .*budget: 10ms.*degrade' "$work/schedule.yaml" || { echo "schedules/thesis.yaml has changed: mend this script"; exit 1; }
if [ "$seconds" = inputs ]; then
  code=0
  "$takt" check "$root/graph/ace.yaml" --schedule "$work/schedule.yaml" >/dev/null || code=$?
  exit $((code > 1))
fi
command -v stress-ng >/dev/null || { echo "stress-ng is not installed: apt install stress-ng"; exit 3; }

stress-ng --cpu 2 --quiet & stress=$!
"$takt" run --for "${seconds}s" --schedule "$work/schedule.yaml" --set stereo.disparities=512 --set stereo.search=64 \
  --record "$work/run.mcap" --output "$work/out" --report "$work/run.json" >"$work/run.log" 2>&1 & run=$!
running() { kill -0 $run 2>/dev/null || { tail -n 2 "$work/run.log"; exit 3; }; }
wait_until() { # until the run is that old, s
  until "$takt" top --json --once 2>/dev/null |
    awk -v t="$1" 'match($0, /"running_s":[0-9.]+/) && substr($0, RSTART + 12, RLENGTH - 12) + 0 >= t { found = 1 } END { exit !found }'
  do
    running
    sleep 0.2
  done
}
wait_until $((seconds / 3))
"$takt" set stereo.search 512
wait_until $((2 * seconds / 3))
"$takt" set stereo.search 64
wait $run || true
kill $stress
wait $stress 2>/dev/null || true
python3 - "$work/run.json" <<'PY'
import json, sys
report = json.load(open(sys.argv[1]))
stereo = next(n for n in report["nodes"] if n["name"] == "stereo")
record = report["record"]
print(f"recorded {report['duration_s']:.0f} s beside stress-ng --cpu 2, policy {report['policy_granted']}: {record['messages']} messages, "
      f"{record['jobs']} jobs, {record['mb']:.0f} MB, lost {record['lost']}; stereo jobs by level {stereo['quality']}; "
      f"misses {sum(n['deadline_misses'] for n in report['nodes'])}, host stall {report['host_stall_ms']} ms")
PY
code=0
replay() {
  echo "--- replayed $1"
  "$takt" replay "$work/run.mcap" --compare "${@:2}" --output "$work/replayed" || code=1
}
replay alone
replay "in processes as the run" --isolate subsystem
stress-ng --cpu 4 --quiet & stress=$!
replay "beside stress-ng --cpu 4"
kill $stress
exit $code
