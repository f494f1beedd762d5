# SPDX-License-Identifier: Apache-2.0
# A graph on two machines: two network namespaces with a cable between them. As root; without the right to make them it says so.
source "$(dirname "$0")/lib.sh" "$@"
graph=$source/graph/two_machines.yaml

expect 0 "" "$takt" check "$graph"
expect 0 "" "$takt" check "$graph" --machine robot
expect 0 "" "$takt" check "$graph" --machine vision
for host in robot vision detection mind; do expect 0 "" "$takt" check "$source/graph/ace_four_hosts.yaml" --machine $host; done
expect 2 'no machine `arm`; machines: robot, vision' "$takt" check "$graph" --machine arm
expect 2 'has no `machines`' "$takt" check "$source/graph/lasers.yaml" --machine robot

for way in "run --clock virtual --output $work/none" "run --isolate none --output $work/none" profile; do
  # shellcheck disable=SC2086
  expect 2 "comes from machine vision: a part of a graph runs in real time" "$takt" $way "$graph" --machine robot --for 1s
done

[ -e "$(dirname "$takt")/../../rt/libtakt_dds.so" ] || not_run "built without cyclonedds-dev and cyclonedds-tools"
two_machines 10.93.0 'rm -f "$source"/graph/.*_$$.yaml'

on() { # on SPACE NAME MACHINE SECONDS GRAPH OPTIONS...: a run in the background
  beside "$2" ip netns exec "$1" "$takt" run "$5" --machine "$3" --policy cooperative --for "$4s" --ring off \
    --output "$work/$2" --report "$work/$2.json" "${@:6}"
}
on $one robot robot 18 "$graph"
robot=$!
on $two vision vision 4 "$graph" --record "$work/vision.mcap"
vision=$!
wait $vision || fail "vision: exit $?: $(tail -n 5 "$work/vision.err" "$work/vision.out")"
python3 - "$work/vision.json" <<'PY' || fail "what came of the odometry is wrong"
import json, sys
report = json.load(open(sys.argv[1]))
edge = next(e for e in report["edges"] if e["from"] == "base.odometry")
assert 30 <= edge["received"] <= 62, edge                        # 15 Hz for 4 s, once both know each other
device = next(d for d in report["devices"] if d["name"] == "base")
assert device["damaged"] == device["missing"] == 0, device
assert 10 < edge["age_ms"]["p50"] < 200, edge                    # stamps of the other clock, in this one's
PY
# What came over the network is in the record as of any device: it replays on one machine.
tells 0 " 0 differ" "$takt" replay "$work/vision.mcap" --compare --output "$work/again"
sleep 1  # it is missed
on $two vision2 vision 6 "$graph"  # again, as a new run: the first machine has it back
vision=$!
sleep 3
pkill -KILL -x link -P $vision
wait $vision
python3 - "$work/vision2.json" <<'PY' || fail "what came after the process link was lost is wrong"
import json, sys
report = json.load(open(sys.argv[1]))
assert any("process link was ended by signal 9" in fault["what"] for fault in report["faults"]), report["faults"]
device = next(d for d in report["devices"] if d["name"] == "base")
assert device["state"] == "ok" and device["losses"] >= 1, device
PY
wait $robot
python3 - "$work/robot.json" <<'PY' || fail "the loss of a machine is no mode"
import json, sys
report = json.load(open(sys.argv[1]))
modes = [mode["name"] for mode in report["modes"]]
assert modes.count("alone") >= 2 and "full" in modes, report["modes"]
edge = next(e for e in report["edges"] if e["from"] == "traversability.traversability")
assert edge["received"] >= 25 and edge["age_ms"]["p50"] < 500, edge  # 5 Hz, as long as the other one is there
stop = next(n for n in report["nodes"] if n["name"] == "obstacle_stop")
assert stop["completed"] >= stop["released"] - 1 >= 200, stop
PY

# One mode, one parameter, one stop for both, asked for on either; not where the graph does not say so.
trusted=$source/graph/.trusted_$$.yaml
sed 's/domain: 93/domain: 93, trusted: true/' "$graph" >"$trusted"
pair() { # pair GRAPH: both parts, until they run
  on $one first robot 60 "$1"
  first=$!
  on $two second vision 60 "$1"
  second=$!
  for _ in $(seq 200); do
    [ "$("$takt" top --run $first --once --json 2>/dev/null | grep -c '"running_s":[1-9]')" = 1 ] &&
      "$takt" top --run $second --once >/dev/null 2>&1 && return
    sleep 0.1
  done
  fail "the two parts do not run: $(cat "$work/first.err" "$work/second.err")"
}
pair "$trusted"
tells 0 "traversability" "$takt" top --once --run $first --machine vision
expect 0 "" "$takt" set --run $first traversability.step 8cm
tells 0 "0.08" "$takt" get --run $second traversability.step
tells 0 "0.08" "$takt" get --run $first traversability.step
expect 2 "no machine \`arm\`; valid are: robot, vision" "$takt" mode --run $first --machine arm safe_stop
expect 0 "" "$takt" mode --run $second safe_stop
expect 0 "" "$takt" stop --run $second
wait $first $second
python3 - "$work" <<'PY' || fail "the two parts are no one run"
import json, sys
for part, other in (("first", "vision"), ("second", "robot")):
    report = json.load(open(f"{sys.argv[1]}/{part}.json"))
    assert report["modes"][-1]["name"] == "safe_stop", report["modes"]
    machine, = report["machines"]
    assert machine["name"] == other and machine["told"]["mode"] == "safe_stop", machine
    assert all(output["received"] > 10 and output["missing"] == 0 for output in machine["outputs"]), machine
PY
pair "$graph"
expect 3 "machine vision takes no words from others" "$takt" mode --run $first safe_stop
expect 0 "" "$takt" stop --run $first --machine robot
expect 0 "" "$takt" stop --run $second --machine vision
wait $first $second

# Another graph is not listened to.
sed 's/max_age: 200ms/max_age: 201ms/' "$graph" >"$source/graph/.other_$$.yaml"
on $one other robot 6 "$source/graph/.other_$$.yaml"
other=$!
on $two stranger vision 2 "$graph"
stranger=$!
for _ in $(seq 100); do grep -q "machine robot runs another graph" "$work/stranger.err" && break; sleep 0.1; done
grep -q "machine robot runs another graph, schedule or other parameters: it is not listened to" "$work/stranger.err" ||
  fail "a stranger is listened to: $(cat "$work/stranger.err")"
kill -INT $stranger $other  # both wait for the other one
wait $stranger $other

# An address that is not there.
expect 3 "no domain on 10.93.0.1; is that address one of this machine?" "$takt" run "$graph" --machine robot --for 1s --policy cooperative --output "$work/none"
finish
