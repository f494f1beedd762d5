# SPDX-License-Identifier: Apache-2.0
# Processes of a run that die or hang: the others go on, the dead one comes back with what it knew, and the report says
# so. Deadlines are not judged here: a shared machine would make that a coin toss.
source "$(dirname "$0")/lib.sh" "$@"

told() { said "$1" "$work/$name.err"; }

for transport in local iceoryx; do
  name=$transport
  start_run $name --isolate subsystem --transport $transport --for 0s --report "$work/$name.json"
  others=$(for p in devices robot detection people mind; do member $p; done)
  kill -KILL "$(member mapping)"
  told "process mapping is back"
  [ "$others" = "$(for p in devices robot detection people mind; do member $p; done)" ] || fail "$name: another process changed"
  expect 0 "" "$takt" echo mapping_3d.obstacles --run $run
  kill -STOP "$(member detection)"
  told "gave no sign of life"
  told "process detection is back"
  end_run 1
  pgrep -P $run >/dev/null && fail "$name: processes are left behind"
  command -v python3 >/dev/null && { python3 - "$work/$name.json" <<'PY' || fail "$name: the report is wrong"; }
import json, sys
report = json.load(open(sys.argv[1]))
outages = [f for f in report["faults"] if f.get("kind") == "outage"]
assert [f["process"] for f in outages] == ["mapping", "detection"], outages
assert all(f["back_s"] is not None and f["down_s"] > 0 for f in outages), outages
down = {n["name"]: n["down"] for n in report["nodes"]}
assert down["stereo"] > 0 and down["object_detection"] > 0 and down["obstacle_stop"] == 0 and down["semantic"] == 0, down
for n in report["nodes"]:
    lost = n["released"] - n["completed"] - n["skipped"] - n["reused"]
    # One under way at the kill; those that waited then or at the end, if jobs of it were late by whole periods.
    waiting = 1 + 2 * int((n["response_ms"]["max"] or 0) * 1e-3 * (n["rate_hz"] or 0))
    assert 0 <= lost <= n["down"] + waiting, n
for e in report["edges"]:  # a restarted reader sees nothing twice, a restarted writer begins no new count
    assert e["received"] + e["dropped"] <= e["sent"], e
assert not report["ok"]
PY
done

# The daemon of iceoryx lives in the supervisor: all of it is started anew, and the run goes on.
name=daemon
start_run $name --isolate subsystem --transport iceoryx --for 0s --report "$work/$name.json"
kill -KILL "$(pgrep -P $run)"
told "all processes are started again"
for p in devices robot detection people mapping mind; do told "process $p is back"; done
expect 0 "" "$takt" echo mapping_3d.obstacles --run $run
end_run 1
ls /dev/shm /tmp | grep -E "^(roudi|iceoryx|takt-[0-9])" | grep -v '\.lock$' && fail "$name: files are left behind"

# What cannot live is given up in the end; the others go on, in safe_stop, since mapping has nodes of high criticality.
name=doomed
start_run $name --isolate subsystem --for 0s --report "$work/$name.json"
until grep -q "given up" "$work/$name.err"; do
  kill -KILL "$(member mapping)" 2>/dev/null
  sleep 0.1
done
sleep 0.5
expect 0 "" "$takt" echo obstacle_stop.stop --run $run
end_run 3
grep -q '"name": "safe_stop"' "$work/$name.json" || fail "no safe_stop after mapping was given up"
finish
