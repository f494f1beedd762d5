# SPDX-License-Identifier: Apache-2.0
# A robot of doubles is brought up device by device, with a person who answers, lifts wheels, steps in the way and says what is
# wrong; what is known is kept, and lets the graph drive or not.
source "$(dirname "$0")/lib.sh" "$@"

sed '/<line index="0"/s|.*|  <line index="0" name="emergency_stop" rest="true"><pulse from="21s" until="25s"/></line>|' \
  "$source/graph/worlds/lab.xml" >"$work/lab.xml"
cp "$source"/graph/worlds/*.ppm "$source"/graph/worlds/*.pgm "$work/" 2>/dev/null
cat >"$work/robot.yaml" <<YAML
takt: 1
name: brought
schedule: schedule.yaml
default_profile: doubles
devices:
  camera: {kind: stereo_camera, rig: $source/graph/rigs/xb3.yaml, rate: 5}
  head: {kind: camera_head, rate: 15}
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {y: 0.30m, z: 0.25m}}
  base: {kind: mobile_base, rate: 15, in: {stop: {from: obstacle_stop.stop, max_age: 300ms}}}
  lines: {kind: digital_lines, rate: 15}
profiles:
  doubles:
    default: {driver: double, world: $work/lab.xml}
    front_laser: {baud: 500000}
    base: {drive: command}
  sim: {default: {driver: sim, world: $work/lab.xml}, base: {drive: command}}
  robot:
    default: {driver: sim, world: $work/lab.xml}
    front_laser: {driver: lms200, port: $work/no_line}
    base: {driver: can, interface: "unix:$work/base"}
subsystems:
  robot:
    exports: [obstacle_stop.stop]
    obstacle_stop:
      type: obstacle_stop
      in:
        scan: {from: front_laser.scan, max_age: 300ms}
        lines: {from: lines.state, depth: 4, max_age: 300ms}
        odometry: {from: base.odometry, max_age: 300ms}
YAML
cat >"$work/schedule.yaml" <<YAML
takt: 1
name: brought
policy: cooperative
nodes:
  camera: {rate: 5, deadline: 100ms}
  head: {rate: 15, deadline: 40ms}
  front_laser: {rate: 15, deadline: 40ms}
  base: {rate: 15, deadline: 40ms}
  lines: {rate: 15, deadline: 40ms}
  obstacle_stop: {rate: 15, offset: 20ms, deadline: 60ms, criticality: high}
YAML
known=$TAKT_STATE_DIR/bringup/brought.json

echo "=== what is wrong is said before anything is tried"
expect 2 "has no real device" "$takt" bringup "$work/robot.yaml" --profile sim --output "$work/out"
expect 2 "did you mean \`front_laser\`?" "$takt" bringup "$work/robot.yaml" --doubles --device front_lasr --output "$work/out"
expect 2 "excludes" "$takt" bringup "$work/robot.yaml" --doubles --device base --again
expect 1 "" "$takt" bringup "$work/robot.yaml" --doubles --list
[ "$(grep -c "not tried" "$work/stdout")" = 6 ] || fail "the list: $(cat "$work/stdout")"

# person ANSWERS... : brings the graph up; each answer is REGEX=WORD, or REGEX!SHELL for what is done at such a word.
person() {
  python3 - "$takt" "$work/robot.yaml" "$work" "$@" <<'PY'
import os, re, subprocess, sys
takt, graph, work, *rules = sys.argv[1:]
options = [rule for rule in rules if rule.startswith("--") or rule in ("base", "lines")]
rules = [re.match(r"(.*?)([=!])(.*)", rule, re.S).groups() for rule in rules if rule not in options]
run = subprocess.Popen([takt, "bringup", graph, "--doubles", "--patience", "25s", "--output", f"{work}/tried", *options],
                       stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=0)
line = ""
while byte := run.stdout.read(1):
    sys.stdout.write(byte)
    line += byte
    asked = line.endswith("[y/n] ")
    if not asked and byte != "\n": continue
    for pattern, kind, what in rules:
        if not re.search(pattern, line): continue
        if kind == "=" and asked: run.stdin.write(what + "\n"), run.stdin.flush()
        if kind == "!" and not asked: subprocess.Popen(what, shell=True, env={**os.environ, "takt": takt})
        if (kind == "=") == asked: break
    else:
        if asked: run.stdin.write("y\n"), run.stdin.flush()
    line = ""
sys.exit(run.wait())
PY
}
# A scanner that falls silent is what a person in the way is for the chain.
in_the_way='sleep 0.5; $takt fault front_laser silent on >/dev/null'
aside='$takt fault front_laser silent off >/dev/null'

echo "=== somebody says no, and nothing that moves the robot on the ground is tried"
person 'straight ahead. Is that so=n' >"$work/first"
[ $? = 1 ] || { cat "$work/first"; fail "exit"; }
grep -q "NOT PASSED.*that is not so" "$work/first" || fail "the scanner: $(cat "$work/first")"
grep -qE "^base .* passed .* 0\.1[0-9]* m/s|^base .* passed .* 0\.[01][0-9] m/s" "$work/first" || fail "the base: $(grep base "$work/first")"
grep -q "Step in its way" "$work/first" && fail "the stop was tried with a scanner that is wrong"
[ -s "$work/tried/camera.png" ] || fail "no picture of the camera"

echo "=== only what is left is tried; then the stop on the ground"
person "Step in its way!$in_the_way" "Step aside!$aside" >"$work/second"
code=$?
cat "$work/second"
[ $code = 0 ] || { tail -n 5 "$work/tried/"*.log; fail "exit $code"; }
grep -q "^camera (" "$work/second" && fail "the camera was tried again"
grep -qE "stood 0\.[0-9]+ s after it was told to; the emergency stop stopped it" "$work/second" || fail "the stop"
expect 0 "" "$takt" bringup "$work/robot.yaml" --doubles --list
[ "$(grep -c " passed " "$work/stdout")" = 6 ] || fail "the list: $(cat "$work/stdout")"

echo "=== with another setting it counts no more; a stop that nobody waits for is none"
sed -i 's/max_age: 300ms}}}$/max_age: 250ms}}}/' "$work/robot.yaml"
expect 1 "" "$takt" bringup "$work/robot.yaml" --doubles --list
grep -q "^stop of base *other settings now" "$work/stdout" || fail "the list: $(cat "$work/stdout")"
person "Step in its way=y" >"$work/third"
[ $? = 1 ] && grep -q "it did not stop for who stepped in its way" "$work/third" || { cat "$work/third"; fail "a stop that did not come"; }

echo "=== a real base drives only after that"
expect 0 "" "$takt" run "$work/robot.yaml" --profile doubles --brought-up --for 1s --output "$work/out"
expect 2 "base was tried at" "$takt" run "$work/robot.yaml" --profile robot --brought-up --for 1s --output "$work/out"
grep -q "fix: takt bringup $work/robot.yaml --profile robot --file $known" "$work/stderr" || fail "the way out"
echo '{"takt": 1}' >"$known"
expect 2 "does not say what was brought up" "$takt" run "$work/robot.yaml" --profile robot --brought-up --for 1s --output "$work/out"
rm "$known"
expect 2 "base was never tried" "$takt" run "$work/robot.yaml" --profile robot --brought-up --for 1s --output "$work/out"
finish
