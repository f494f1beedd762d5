#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Repeats the main job and looks for what is lost or left: runs.sh [RUNS] [SECONDS] [takt run options...]
# Not part of `takt test`: ten runs of a minute take ten minutes. Prints one line a run; exit 1 if anything was lost or
# left, chunks that are still taken when all processes are gone among it. Deadline misses, and chunks that outputs and
# queues hold at a run's end, are told and not judged.
set -u
# In a /tmp and /dev/shm of its own where that is permitted: what other programs make and remove there is not ours.
# Not where the checkout itself lies below /tmp.
if [ -z "${TAKT_OWN_TMP:-}" ] && [[ $(readlink -f "$0") != /tmp/* ]] && unshare --mount true 2>/dev/null; then
  TAKT_OWN_TMP=1 exec unshare --mount bash -c 'mount -t tmpfs none /tmp && mount -t tmpfs none /dev/shm && exec bash "$@"' - "$0" "$@"
fi
takt=$(readlink -f "$(dirname "$0")/../../takt")
runs=${1:-10} seconds=${2:-60}
shift $(($# < 2 ? $# : 2))
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0

traces() { ls -A /dev/shm /tmp /run/takt 2>/dev/null | grep -vE "^(${work##*/}|cc[A-Za-z0-9]{6}\..*)$"; }
open_things() { # descriptors and threads of every process of the run, one line a process
  for pid in $1 $(pgrep -P "$1"); do
    echo "$(cat /proc/$pid/comm 2>/dev/null): $(ls /proc/$pid/fd 2>/dev/null | wc -l) descriptors, $(ls /proc/$pid/task 2>/dev/null | wc -l) threads"
  done | sort
}

before=$(traces)
for ((run = 1; run <= runs; ++run)); do
  "$takt" run --for "${seconds}s" --output "$work/out" --report "$work/$run.json" "$@" >"$work/stdout" 2>"$work/stderr" &
  child=$!
  sleep $((seconds / 4 + 2))
  pid=$(pgrep -P $child -x takt || echo $child)
  early=$(open_things "$pid")
  sleep $((seconds / 2))
  late=$(open_things "$pid")
  wait $child
  code=$?
  [ "$early" = "$late" ] || { bad=1; echo "run $run: descriptors or threads changed: $(diff <(echo "$early") <(echo "$late"))"; }
  [ "$(traces)" = "$before" ] || { bad=1; echo "run $run: left behind: $(diff <(echo "$before") <(traces))"; }
  pgrep -x takt >/dev/null && { bad=1; echo "run $run: a process is left"; }
  python3 - "$work/$run.json" "$work/1.json" "$run" "$code" <<'PY' || bad=1
import json, sys
report, first = json.load(open(sys.argv[1])), json.load(open(sys.argv[2]))
lost = [(n["name"], n["released"] - n["completed"]) for n in report["nodes"] if n["completed"] < n["released"]]
unread = [e["to"] for e in report["edges"] if e["received"] + e["dropped"] > e["sent"]]
held = {p["port"]: p["in_use_at_end"] for p in report["memory"]["pools"]}
left = report["memory"].get("chunks_at_end", 0)  # one process alone takes its chunks with it
full = [p["port"] for p in report["memory"]["pools"] if p["exhausted"]]
more = [port for port, n in held.items() if n > {p["port"]: p["in_use_at_end"] for p in first["memory"]["pools"]}[port]]
misses = sum(n["deadline_misses"] for n in report["nodes"])
print(f"run {sys.argv[3]}: exit {sys.argv[4]}, policy {report['policy_granted']}, {sum(n['released'] for n in report['nodes'])} jobs, "
      f"lost {lost or 'none'}, misses {misses}, pools exhausted {full or 'none'}, held at the end {sum(held.values())} chunks, "
      f"more than in the first run {more or 'none'}, left when all are gone {left}, host stall {report['host_stall_ms']} ms")
sys.exit(bool(lost or unread or full or left))
PY
done
exit $bad
