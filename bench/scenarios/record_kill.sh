#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What is left of a record whose run is killed: record_kill.sh [TIMES] [SEED]. Each time a recorded run, by turns in one process and in
# several, gets SIGKILL at a random instant of its first six seconds; its record must open, and a replay of what it holds
# must give the same bytes. Exit 1 if one does not.
set -u
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
times=${1:-20}
RANDOM=${2:-1}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0
for ((i = 1; i <= times; ++i)); do
  isolate=$([ $((i % 2)) -eq 0 ] && echo subsystem || echo none)
  delay=$((RANDOM % 6000))
  rm -f "$work/run.mcap"
  "$takt" run --isolate $isolate --record "$work/run.mcap" --output "$work/out" >/dev/null 2>&1 & run=$!
  until [ -s "$work/run.mcap" ]; do kill -0 $run 2>/dev/null || { echo "the run did not start"; exit 3; }; sleep 0.05; done
  sleep "$(printf '%d.%03d' $((delay / 1000)) $((delay % 1000)))"
  kill -9 $run
  wait $run 2>/dev/null
  if ! "$takt" log info "$work/run.mcap" --json >"$work/info.json" 2>"$work/error"; then
    # Killed before the first message was due: what was run, and no more.
    echo "$i: $isolate, killed after $delay ms: cannot be read: $(tail -n 1 "$work/error")"
    bad=1
    continue
  fi
  "$takt" replay "$work/run.mcap" --compare --output "$work/replayed" >"$work/replay" 2>&1
  differ=$(sed -n 's/.* \([0-9]*\) differ$/\1/p' "$work/replay" | head -n 1)
  [ "${differ:-x}" = 0 ] || bad=1
  python3 - "$work/info.json" "$i: $isolate, killed $delay ms after the file began" "${differ:-no}" "$(grep 'were not run' "$work/replay")" <<'PY'
import json, sys
info = json.load(open(sys.argv[1]))
print(f"{sys.argv[2]}: {sum(p['messages'] for p in info['ports'])} messages, {sum(n['jobs'] for n in info['nodes'])} jobs, "
      f"{info['duration_s']:.2f} s; {sys.argv[3]} differ. {sys.argv[4]}", flush=True)
PY
done
[ $bad -eq 0 ] && echo "$times of $times readable, no wrong byte"
exit $bad
