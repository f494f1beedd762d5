# SPDX-License-Identifier: Apache-2.0
# A replay begins, stops and looks anywhere in a record.
source "$(dirname "$0")/lib.sh" "$@"
cd "$source" || exit 1
record=$work/run.mcap
expect 0 "" "$takt" run graph/ace.yaml --clock virtual --for 8s --record "$record" --output "$work/out"

replays() { # CODE TEXT ARGUMENT...
  expect "$1" "$2" "$takt" replay "$record" --output "$work/again" "${@:3}"
}

# Each part makes what the run made, and runs little more than itself.
for from in 2.5 6.1; do
  replays 0 "" --from $from --until "$(python3 -c "print($from + 1)")" --compare
  prints "went on from a snapshot"
  prints " 0 differ"
  ! grep "began without what they remember" "$work/stdout" || fail "a node began without what it remembers"
done

replays 1 "" --break 'port: obstacle_stop.stop, field: reasons, at_least: 1000'
prints "no job made a message with obstacle_stop.stop reasons at least 1000"
replays 0 "" --from 3 --break '{port: scan_matching.pose, field: transform.x, at_least: -1000m}'
prints "scan_matching job"
replays 2 'there is no node or device `nobody`' --break 'port: nobody.stop, field: reasons, is: 1'
replays 2 "is a device, which a replay does not run" --break 'port: base.odometry, field: speed_m_s, at_least: 0m/s'
replays 2 "this is no condition on a port" --break 'world: ace, within: 1m, of: [0m, 0m]'

printf 'at 5 ego_motion\nstate\nback ego_motion\nnext ego_motion\nparams\nnext\n' >"$work/asked"
expect 0 "" "$takt" replay "$record" --output "$work/again" --from 4 --inspect <"$work/asked"
prints "ego_motion job 50"
prints "ego_motion job 49"
prints "  in pair (stereo.rectified"
prints "  state "
prints "  param "
echo 'go nobody 3' >"$work/asked"
expect 1 "" "$takt" replay "$record" --output "$work/again" --until 3 --inspect <"$work/asked"
prints 'there is no node `nobody`'

# A laser falls silent for good: the first job that asks for the stop is found with few replays.
cat >"$work/silent.yaml" <<'YAML'
takt: 1
name: silent
faults: [{kind: silent, target: front_laser, from: 7s, to: 1000s}]
expect: {}
YAML
"$takt" run graph/lasers.yaml --clock virtual --for 20s --record "$work/silent.mcap" --faults "$work/silent.yaml" --output "$work/out" \
  >"$work/stdout" 2>&1
expect 0 "" "$takt" bisect "$work/silent.mcap" 'port: obstacle_stop.stop, field: reasons, at_most: 0'
prints "first broken: obstacle_stop job 10"
expect 1 "" "$takt" bisect "$work/silent.mcap" 'port: obstacle_stop.stop, field: reasons, at_least: 0'
prints "it holds at the end"
finish
