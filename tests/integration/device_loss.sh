#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Simulated devices that fail in virtual time: the run changes its mode by the graph's rules and comes back by itself.
. "$(dirname "$0")/lib.sh"

virtual() { # NAME EXIT OPTIONS...
  local name=$1 code=$2
  shift 2
  timeout 240 "$takt" run --clock virtual --output "$work/out" --report "$work/$name.json" "$@" >"$work/$name.out" 2>"$work/$name.err"
  local got=$?
  echo "--- $name"
  grep -E '^(mode|device|fault|ok|NOT)' "$work/$name.out"
  [ $got -eq "$code" ] || { tail -n 5 "$work/$name.err"; fail "$name: exit $got instead of $code"; }
}

judge() { # NAME WHAT 'EXPRESSION OF modes, devices, nodes, faults'
  python3 - "$work/$1.json" "$3" <<'PY' || fail "$1: $2"
import json, sys
report = json.load(open(sys.argv[1]))
modes = [(m["name"], m["from_s"], m["to_s"], m["reason"]) for m in report["modes"]]
names = [m[0] for m in modes]
devices = {d["name"]: d for d in report["devices"]}
nodes = {n["name"]: n for n in report["nodes"]}
faults = [(f["kind"], f["node"], f["what"]) for f in report["faults"]]
sys.exit(0 if eval(sys.argv[2]) else 1)
PY
}

# The head camera's plug is out from 2 s to 4 s. It is tried 0.1, 0.2, 0.4 ... s after one another, at its jobs: 1.6 s after the
# plug is back at the latest; 0.5 s of images make it well again.
virtual unplugged 0 --for 8s --set "head_camera.failures=unplugged 2s..4s" --record "$work/unplugged.mcap"
judge unplugged "modes" 'names == ["full", "no_stereo", "full"]'
judge unplugged "entered at once" '2.0 <= modes[1][1] < 2.1 and modes[1][3] == "head_camera lost: disconnected"'
judge unplugged "left once it works" '4.5 <= modes[2][1] < 4 + 1.7 + 0.5 + 0.2 and modes[2][3] == "head_camera is back"'
judge unplugged "stereo paused meanwhile" \
  'all(abs(8 - nodes[n]["active_s"] - (modes[1][2] - modes[1][1])) < 0.6 for n in ("stereo", "ego_motion", "mapping_3d"))'
judge unplugged "stereo works before and after" 'nodes["stereo"]["completed"] >= nodes["stereo"]["released"] - 1 > 50'
judge unplugged "obstacle_stop undisturbed" 'nodes["obstacle_stop"]["deadline_misses"] == 0 and nodes["obstacle_stop"]["completed"] == 120'
judge unplugged "the device in the report" \
  'devices["head_camera"]["losses"] == 1 and devices["head_camera"]["state"] == "ok" and 3 <= devices["head_camera"]["reopen_tries"] <= 6'
judge unplugged "how long it was lost" 'abs(devices["head_camera"]["lost_s"] - (modes[1][2] - modes[1][1])) < 0.1'
judge unplugged "the others" 'all(d["losses"] == 0 and d["lost_s"] == 0 for n, d in devices.items() if n != "head_camera")'
judge unplugged "faults" '[f[:2] for f in faults] == [("lost", "head_camera"), ("back", "head_camera")]'
grep -qE '^device head_camera: lost 1 time, [0-9.]+ s; [0-9]+ tries to reopen it; now ok$' "$work/unplugged.out" || fail "no line in the summary"

# The same again gives the same, and the record of it replays to the bit.
virtual again 0 --for 8s --set "head_camera.failures=unplugged 2s..4s"
python3 -c 'import json, sys; a, b = (json.load(open(f)) for f in sys.argv[1:]); sys.exit(a["modes"] != b["modes"] or a["devices"] != b["devices"])' \
  "$work/unplugged.json" "$work/again.json" || fail "two runs of one seed differ"
expect 0 "" timeout 240 "$takt" replay "$work/unplugged.mcap" --compare --output "$work/out"

# Frozen and damaged images, and a short gap that is none.
virtual camera 0 --for 7s --set "head_camera.failures=silent 1s..1.2s, frozen 2s..3s, garbage 4s..5s"
judge camera "modes" 'names == ["full", "no_stereo", "full", "no_stereo", "full"]'
judge camera "why" '[m[3] for m in modes[1::2]] == ["head_camera lost: frozen", "head_camera lost: garbage"]'
judge camera "not before its time" '2.2 < modes[1][1] < 2.5 and 3.5 <= modes[2][1] < 3.7'
judge camera "no try to reopen what is there" 'devices["head_camera"]["reopen_tries"] == 0'

# Both cameras: laser_only, whose list of paused devices does not keep them from coming back.
virtual cameras 0 --for 8s --set "head_camera.failures=silent 1s..4s" --set "ground_camera.failures=silent 2s..3s"
judge cameras "modes" 'names == ["full", "no_stereo", "laser_only", "no_stereo", "full"]'

# A scanner, a line or the base is a safe stop; a scanner besides a camera, too.
for device in front_laser lines base; do
  virtual $device 0 --for 3s --set "$device.failures=silent 1s..1.5s"
  judge $device "modes" 'names == ["full", "safe_stop", "full"]'
  judge $device "obstacle_stop goes on" 'nodes["obstacle_stop"]["deadline_misses"] == 0 and nodes["obstacle_stop"]["completed"] == 45'
  judge $device "the base goes on" 'nodes["base"]["completed"] == 45'
done
virtual both 0 --for 3s --set "front_laser.failures=silent 1s..9s" --set "head_camera.failures=silent 0.5s..9s"
judge both "modes" 'names == ["full", "no_stereo", "safe_stop"]'
judge both "still lost" 'devices["front_laser"]["state"] == "silent" and devices["front_laser"]["lost_s"] > 1.5'

# Between processes, on the real clock: what the process of the devices sees changes the mode of the others. Times are not judged.
timeout 120 "$takt" run --policy cooperative --isolate subsystem --for 5s --output "$work/out" --report "$work/processes.json" \
  --set "front_laser.failures=unplugged 1s..2s" >"$work/processes.out" 2>"$work/processes.err"
[ $? -le 1 ] || { tail -n 5 "$work/processes.err"; fail "processes: the run failed"; }
grep -E '^(mode|device)' "$work/processes.out"
judge processes "modes" 'names == ["full", "safe_stop", "full"] and devices["front_laser"]["state"] == "ok"'
judge processes "mapping_3d, of another process, paused" 'nodes["mapping_3d"]["active_s"] < 5 and nodes["obstacle_stop"]["active_s"] == 5'

# The head is named by no rule: it is reported, and changes nothing.
virtual head 0 --for 3s --set "head.failures=unplugged 1s..2s"
judge head "no mode" 'names == ["full"] and devices["head"]["losses"] == 1'

# By default a device is silent after 300 ms; the graph may say otherwise.
virtual patient 0 --for 4s --set "front_laser.failures=silent 1s..2s" --set front_laser.silent_after=1.5s
judge patient "no loss" 'names == ["full"] and devices["front_laser"]["losses"] == 0'

expect 2 'is 3 without a unit; write 3s' "$takt" run --clock virtual --for 1s --output "$work/out" --set head_camera.recovers_after=3
expect 2 '`unpluged 2s..4s` names no failure' "$takt" run --clock virtual --for 1s --output "$work/out" --set "head_camera.failures=unpluged 2s..4s"
sed 's/lost: \[head_camera\]/lost: [head_camra]/' "$source/graph/ace.yaml" >"$work/ace.yaml"
expect 2 'did you mean `head_camera`?' "$takt" check "$work/ace.yaml" --schedule "$source/schedules/thesis.yaml"
finish
