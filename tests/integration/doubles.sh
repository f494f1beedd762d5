#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Every device of a graph is a double, those with a line at byte level, in one world, each with its real driver; head and base once more as
# processes of their own. They misbehave on the way, and what that cost is told. On the real clock: counts, no times.
. "$(dirname "$0")/lib.sh"

cat >"$work/graph.yaml" <<YAML
takt: 1
name: doubles
schedule: schedule.yaml
default_profile: doubles
devices:
  camera: {kind: stereo_camera, rig: $source/graph/rigs/xb3.yaml, rate: 5}
  head: {kind: camera_head, rate: 15}
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {y: 0.30m, z: 0.25m}}
  floor_laser: {kind: laser_scanner, model: lms400, rate: 15, mount: {y: 0.25m, z: 1.0m, pitch: -34deg}}
  base: {kind: mobile_base, rate: 15}
  lines: {kind: digital_lines, rate: 15}
  person: {kind: interaction, rate: 15, in: {speech: {from: client.speech, depth: 4}}}
profiles:
  doubles:
    default: {driver: double, world: $source/graph/worlds/lab.xml}
    front_laser: {baud: 500000, failures: wrong_crc 8s..9s}
    camera: {trigger_line: camera_trigger, failures: "flagged 8s..9s"}
    head: {failures: wrong_crc 8s..9s}
    base: {failures: lost_frames 8s..9s}
    person: {script: "2s tell cup_1.level=full; 9s tell cup_1.level=empty", failures: silent 8s..10s, speech: double, speech_to: $work/speech}
  apart:
    default: {driver: double, world: $source/graph/worlds/lab.xml}
    front_laser: {baud: 500000}
    head: {driver: can, interface: "unix:$work/head"}
    base: {driver: can, interface: "unix:$work/base"}
subsystems:
  mind:
    exports: [client.speech]
    client:
      type: robot_client
      in: {odometry: {from: base.odometry, max_age: 300ms}, task: person.task}
      params: {network: $source/graph/networks/kitchen.yaml}
  robot:
    obstacle_stop:
      type: obstacle_stop
      in:
        scan: {from: front_laser.scan, max_age: 300ms}
        lines: {from: lines.state, depth: 4, max_age: 300ms}
        odometry: {from: base.odometry, max_age: 300ms}
YAML
cat >"$work/schedule.yaml" <<YAML
takt: 1
name: doubles
policy: cooperative
nodes:
  camera: {rate: 5, deadline: 100ms}
  head: {rate: 15, deadline: 40ms}
  front_laser: {rate: 15, deadline: 40ms}
  floor_laser: {rate: 15, deadline: 40ms}
  base: {rate: 15, deadline: 40ms}
  lines: {rate: 15, deadline: 40ms}
  person: {rate: 15, deadline: 40ms}
  client: {rate: 15, deadline: 60ms}
  obstacle_stop: {rate: 15, offset: 20ms, deadline: 60ms, criticality: high}
YAML

expect 2 "lives in real time only" "$takt" run "$work/graph.yaml" --clock virtual --for 1s --output "$work/out"
expect 2 "one of none, silent, unplugged" "$takt" run "$work/graph.yaml" --for 1s --output "$work/out" --set "head.failures=wrong_baud 1s..2s"
expect 2 "--can INTERFACE" "$takt" double head --pty "$work/head"
expect 3 "start the double that listens there" "$takt" run "$work/graph.yaml" --profile apart --for 1s --output "$work/out"

"$takt" run "$work/graph.yaml" --for 15s --output "$work/out" --report "$work/report.json" >"$work/run.out" 2>"$work/run.err"
code=$?
grep -E '^(mode|device)' "$work/run.out"
[ $code -le 1 ] || { tail -n 5 "$work/run.err"; fail "exit $code"; }
python3 - "$work/report.json" <<'PY' || fail "the report is not as it should be"
import json, sys
report = json.load(open(sys.argv[1]))
devices = {d["name"]: d for d in report["devices"]}
sent = {n["name"]: n["completed"] - n["no_result"] for n in report["nodes"]}
print(sent)
assert all(d["state"] == "ok" and d["trouble"] == "" for d in devices.values()), devices
# Host and scanner agree on rate and mode before the first scan: no loss, so the run begins in the mode it is to have.
assert not [f for f in report["faults"] if f["at_s"] < 5], report["faults"]
assert all(d["received"] > 50 for n, d in devices.items() if n not in ("lines", "person"))
# The second answer fell into the time in which nothing that is pressed arrives.
assert devices["person"]["received"] == 1 and devices["person"]["unsent"] == 0
assert devices["front_laser"]["damaged"] > 0 and devices["front_laser"]["resyncs"] > 0
assert devices["camera"]["missing"] <= 2 and devices["camera"]["damaged"] > 0 and devices["head"]["damaged"] > 0 and devices["base"]["missing"] > 0
assert devices["floor_laser"]["damaged"] == devices["floor_laser"]["resyncs"] == 0
assert all(n["allocations"] == 0 for n in report["nodes"] if n["name"] not in ("camera", "lines", "client"))
PY
grep -qE '^2\.[0-9]+ s I believe that cup_1.level=full$' "$work/speech" || fail "the double of the loudspeaker did not say what it heard"
[ "$(wc -l <"$work/speech")" = 1 ] || fail "it said more: $(cat "$work/speech")"
grep -q "^device front_laser: [0-9]* received, [0-9]* damaged, [0-9]* resyncs" "$work/run.out" || fail "the summary does not tell what the laser lost"
compgen -G "${TMPDIR:-/tmp}/takt-doubles-*/front_laser" >/dev/null && fail "lines of doubles were left behind"

doubles=
trap 'kill $doubles 2>/dev/null; rm -rf "$work"' EXIT
for name in head base; do
  "$takt" double $name --can "unix:$work/$name" </dev/null >"$work/$name.where" 2>"$work/$name.err" &
  doubles="$doubles $!"
  for _ in $(seq 200); do [ -s "$work/$name.where" ] && break; sleep 0.05; done
done
"$takt" run "$work/graph.yaml" --profile apart --for 6s --output "$work/out" --report "$work/report.json" >"$work/run.out" 2>"$work/run.err"
code=$?
[ $code -le 1 ] || { tail -n 5 "$work/run.err"; fail "exit $code"; }
python3 - "$work/report.json" <<'PY' || fail "doubles in processes of their own were not heard"
import json, sys
devices = {d["name"]: d for d in json.load(open(sys.argv[1]))["devices"]}
print({n: devices[n] for n in ("head", "base")})
assert all(devices[n]["state"] == "ok" and devices[n]["received"] > 300 and devices[n]["damaged"] == 0 for n in ("head", "base"))
PY
finish
