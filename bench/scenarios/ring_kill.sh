#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What a killed run leaves in its ring: ring_kill.sh [TIMES] [SEED]. Each time all processes of a run get SIGKILL at a random
# instant of its first eight seconds, by turns in one process and in several. What takt log rescue makes of the ring must
# lack at most the last second and replay without a wrong byte. Then the files are cut at a random place, as a disk may
# leave them after a power cut, and must again. Exit 1 if one does not.
set -u
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
times=${1:-50}
RANDOM=${2:-1}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0
judge() { # WHAT KILLED_AT_NS: of $work/rescued.mcap; 0: without an instant
  "$takt" replay "$work/rescued.mcap" --compare --allow-damage --output "$work/replayed" >"$work/replay" 2>&1
  differ=$(sed -n 's/.* \([0-9]*\) differ$/\1/p' "$work/replay" | head -n 1)
  python3 - "$work/rescued.mcap" "$1" "$2" "${differ:-none compared}" "$takt" <<'PY' || bad=1
import json, subprocess, sys
file, what, killed_ns, differ, takt = sys.argv[1:]
info = json.loads(subprocess.run([takt, "log", "info", file, "--json"], capture_output=True, text=True).stdout)
lines = subprocess.run([takt, "log", "echo", file, "base.odometry"], capture_output=True, text=True).stdout.splitlines()
last_ns = json.loads(lines[-1])["stamp_ns"] if lines else 0
missing_s = (int(killed_ns) - last_ns) / 1e9 if int(killed_ns) and last_ns else 0
good = differ == "0" and missing_s <= 1
print(f"{what}: {len(lines)} odometries, {sum(n['jobs'] for n in info['nodes'])} jobs, the last {missing_s:.2f} s are missing; "
      f"{differ} differ{'' if good else ' WRONG'}", flush=True)
sys.exit(not good)
PY
}
for ((i = 1; i <= times; ++i)); do
  isolate=$([ $((i % 2)) -eq 0 ] && echo subsystem || echo none)
  delay=$((1500 + RANDOM % 6500))
  rm -rf "$work/out" "$work/rescued.mcap"
  "$takt" run --isolate $isolate --ring on --output "$work/out" >/dev/null 2>&1 & run=$!
  until ls "$work"/out/flight/ring/*.mcap >/dev/null 2>&1; do kill -0 $run 2>/dev/null || { echo "the run did not start"; exit 3; }; sleep 0.05; done
  sleep "$(printf '%d.%03d' $((delay / 1000)) $((delay % 1000)))"
  at_ns=$(python3 -c 'import time; print(time.clock_gettime_ns(time.CLOCK_MONOTONIC))')
  pkill -KILL -P $run
  kill -9 $run
  wait $run 2>/dev/null
  "$takt" log rescue "$work/out/flight/ring" -o "$work/rescued.mcap" >/dev/null 2>"$work/error" || { echo "$i: $(tail -n 1 "$work/error")"; bad=1; continue; }
  judge "$i: $isolate, killed $delay ms after the ring began" "$at_ns"
  newest=$(ls -t "$work"/out/flight/ring/*.mcap | head -n 1)
  truncate -s $((RANDOM * 32768 % $(stat -c %s "$newest"))) "$newest"
  rm -f "$work/rescued.mcap"
  "$takt" log rescue "$work/out/flight/ring" -o "$work/rescued.mcap" >/dev/null 2>"$work/error" || { echo "$i, cut: nothing left: $(tail -n 1 "$work/error")"; continue; }
  judge "$i, cut to $(stat -c %s "$newest") bytes" 0
done
[ $bad -eq 0 ] && echo "all of $times readable, no wrong byte"
exit $bad
