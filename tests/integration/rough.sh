# SPDX-License-Identifier: Apache-2.0
# The main graph as processes, one of them killed, while its surroundings misbehave: readers of its outputs go away, the
# outputs are closed from the start, files may not grow, processes are stopped for a while, SIGTERM comes twice. No job
# is lost that is not counted, the report is whole, the record replays.
source "$(dirname "$0")/lib.sh" "$@"
cd "$source" || exit 1

# A process of the run, which has the name of its subsystem.
member_of() { pgrep -x "$1" -P "$run" | head -n 1; }

# begins NAME REDIRECTION LIMIT: a run of 9 s with a record, in the background; in $run once it can be attached to.
begins() {
  name=$1
  mkdir -p "$work/$name"
  (
    [ -z "$3" ] || ulimit -f "$3"
    eval "exec '$takt' run --for 9s --isolate subsystem --output '$work/$name/out' --report '$work/$name/report.json' \
      --record '$work/$name/run.mcap' $2"
  ) &
  run=$!
  for ((i = 0; i < 300; ++i)); do
    "$takt" top --once --run $run >/dev/null 2>&1 && return
    kill -0 $run 2>/dev/null || break
    sleep 0.1
  done
  fail "$name: the run ended before it could be attached to"
}

# One process dies in the middle.
strikes() { sleep 3 && kill -9 "$(member_of people)"; }

# ends whole|cut: the run, with 0 or 1 (a process was lost); its report is whole, and so is its record, unless it is cut.
ends() {
  wait $run
  local code=$?
  [ $code -le 1 ] || fail "$name: exit $code"
  python3 - "$work/$name/report.json" "$name" <<'EOF' || fail "$name: its report"
import json, sys
report, name = json.load(open(sys.argv[1])), sys.argv[2]
outages = [fault for fault in report["faults"] if fault.get("kind") == "outage"]
others = [fault["what"] for fault in report["faults"] if fault.get("kind") != "outage" and "lost" in fault["what"]]
record = report["record"]
print(f"{name}: {len(outages)} outages, {record['jobs']} jobs and {record['messages']} messages in {record['mb']:.0f} MB, "
      f"lost {record['lost']}, refused {record['refused']!r}, ok {report['ok']}")
assert len(outages) >= 1 and all(outage["back_s"] is not None for outage in outages), outages
assert record["lost"]["threads"] == 0 and record["lost"]["overwritten"] == 0 and record["lost"]["no_room"] == 0, record
assert record["lost"]["jobs"] == 0, record
assert record["lost"]["not_written"] == 0 or record["refused"], record
EOF
  [ "$1" = cut ] || expect 0 "0 differ" bash -c '"$@" 2>&1 | tee /dev/stderr' replay "$takt" replay "$work/$name/run.mcap" --compare
}

begins reader_gone "2> >(sleep 1) >/dev/null" ""; strikes; ends whole
begins stdin_closed "<&- >/dev/null 2>$work/stdin.err" ""; strikes; ends whole
begins stdout_closed ">&- 2>$work/stdout.err" ""; strikes; ends whole
begins stderr_closed ">/dev/null 2>&-" ""; strikes; ends whole
begins all_closed "<&- >&- 2>&-" ""; strikes; ends whole
begins no_larger_file ">/dev/null 2>$work/size.err" 300000; strikes; ends cut
begins member_stopped ">/dev/null 2>$work/member.err" ""
sleep 1
stopped=$(member_of mapping)
kill -STOP "$stopped"; sleep 0.3; kill -CONT "$stopped"
strikes; ends whole
begins supervisor_stopped ">/dev/null 2>$work/supervisor.err" ""
sleep 1
kill -STOP $run; sleep 0.3; kill -CONT $run
strikes; ends whole
begins terminated_twice ">/dev/null 2>$work/twice.err" ""
strikes
sleep 3
kill -TERM $run; sleep 0.01; kill -TERM $run 2>/dev/null
ends whole
finish
