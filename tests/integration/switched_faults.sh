# SPDX-License-Identifier: Apache-2.0
# Faults of simulated devices and doubles that are switched while the graph runs: the run loses the device and gets it
# back, a restarted process goes on with the fault, and the record replays. Times are not judged.
source "$(dirname "$0")/lib.sh" "$@"

cat >"$work/graph.yaml" <<YAML
takt: 1
name: switched
schedule: schedule.yaml
default_profile: rig
devices:
  front_laser: {kind: laser_scanner, rate: 15, mount: {y: 0.30m, z: 0.25m}}
  base: {kind: mobile_base, rate: 15}
profiles:
  rig: {default: {driver: sim, world: $source/graph/worlds/lab.xml}, base: {driver: double}}
subsystems:
  robot:
    obstacle_stop:
      type: obstacle_stop
      in:
        scan: {from: front_laser.scan, max_age: 300ms}
        odometry: {from: base.odometry, max_age: 300ms}
modes:
  safe_stop: {lost: [front_laser, base]}
YAML
cat >"$work/schedule.yaml" <<YAML
takt: 1
name: switched
policy: cooperative
nodes:
  front_laser: {rate: 15, deadline: 40ms}
  base: {rate: 15, deadline: 40ms}
  obstacle_stop: {rate: 15, offset: 20ms, deadline: 60ms, criticality: high}
YAML

switch() { expect 0 "" "$takt" fault "$@" --run $run; }
# is DEVICE STATE: waits until the run says so of the device
is() {
  for ((i = 0; i < 100; ++i)); do
    "$takt" top --once --json --run $run >"$work/top" || { cat "$work/$name.err"; fail "the run is gone"; return; }
    state=$(python3 -c 'import json, sys; print(*[n["device"]["state"] for n in json.load(open(sys.argv[1]))["nodes"] if n["name"] == sys.argv[2]])' "$work/top" "$1")
    [ "$state" = "$2" ] && return
    sleep 0.1
  done
  fail "$1 is $state, never $2"
}

echo "=== nothing runs"
expect 3 "no graph of this user is running" "$takt" fault front_laser silent on

echo "=== in processes of their own"
name=isolated
start_run $name "$work/graph.yaml" --isolate subsystem --for 0s --record "$work/$name.mcap" --report "$work/$name.json"
is front_laser ok
is base ok
expect 0 "" "$takt" fault --run $run
prints "front_laser        none           silent, unplugged, garbage, frozen"
prints "base               none           silent, unplugged"
expect 0 "" "$takt" fault base --json --run $run
prints '"lost_frames"'
expect 2 'there is no device `front_lazer`; did you mean `front_laser`?' "$takt" fault front_lazer silent on --run $run
expect 2 'there is no device `obstacle_stop`' "$takt" fault obstacle_stop --run $run
expect 2 'device front_laser has no fault `slient`; did you mean `silent`?' "$takt" fault front_laser slient on --run $run
expect 2 'has no fault `bus_off`' "$takt" fault front_laser bus_off on --run $run
expect 2 "on or off" "$takt" fault front_laser silent --run $run
expect 2 "" "$takt" fault front_laser silent maybe --run $run

switch front_laser silent on
is front_laser silent
expect 0 "" "$takt" fault front_laser --run $run
prints "front_laser        silent "
kill -KILL "$(member devices)"
said "process devices is back" "$work/$name.err"
expect 0 "" "$takt" get front_laser.fault --run $run
prints "front_laser.fault silent (set at "
prints ", taken up after 1 restart)"
is front_laser silent
switch front_laser frozen off # another one: the silence goes on
expect 0 "" "$takt" fault front_laser --run $run
prints "front_laser        silent "
switch front_laser silent off
is front_laser ok
switch base unplugged on
is base disconnected
switch base lost_frames on # takes its place
sleep 1
switch base lost_frames off
is base ok
end_run 0 1
python3 - "$work/$name.json" <<'PY' || fail "the report does not tell of the faults"
import json, os, sys
report = json.load(open(sys.argv[1]))
parameters = {p["node"]: p for p in report["parameters"]}
assert sorted(parameters) == ["base", "front_laser"], parameters
assert all((p["param"], p["value"], p["from"], p["by_user"]) == ("fault", "none", "set", os.getuid()) for p in parameters.values()), parameters
devices = {d["name"]: d for d in report["devices"]}
assert all(d["losses"] >= 1 and d["state"] == "ok" for d in devices.values()), devices
assert devices["base"]["missing"] > 0, devices["base"]
modes = [m["name"] for m in report["modes"]]
assert "safe_stop" in modes and modes[-1] == modes[0] != "safe_stop", modes
PY

echo "=== replayed"
for isolate in none subsystem; do
  expect 0 "" "$takt" replay "$work/$name.mcap" --compare --isolate $isolate --output "$work/out"
  prints " 0 differ"
done
expect 0 "" "$takt" log info "$work/$name.mcap"
prints " parameter, " # events

echo "=== in one process"
name=single
start_run $name "$work/graph.yaml" --isolate none --for 0s --record "$work/$name.mcap"
is front_laser ok
switch front_laser unplugged on
is front_laser disconnected
switch front_laser garbage on
is front_laser garbage
switch front_laser garbage off
is front_laser ok
end_run 0 1
expect 0 "" "$takt" replay "$work/$name.mcap" --compare --output "$work/out"
prints " 0 differ"
finish
