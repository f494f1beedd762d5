#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A graph in a folder of its user: default assets of node types are those of the share folder, and a record of it replays
# where that folder is another one.
source "$(dirname "$0")/lib.sh" "$@"
mkdir "$work/user"
cat >"$work/user/user.yaml" <<END
takt: 1
name: user
schedule: schedule.yaml
devices:
  head_camera: {kind: stereo_camera, rig: $source/graph/rigs/xb3.yaml, rate: 5}
profiles:
  sim: {default: {driver: sim, world: $source/graph/worlds/crossing.xml}}
subsystems:
  eyes:
    stereo: {type: stereo, in: {pair: head_camera.pair}, params: {disparities: 128}}
    traffic_signs: {type: traffic_signs, in: {pair: stereo.rectified, disparity: stereo.disparity}, join: [pair, disparity]}
END
cat >"$work/user/schedule.yaml" <<END
takt: 1
name: user
policy: cooperative
nodes:
  head_camera: {rate: 5, budget: 8ms, criticality: high}
  stereo: {rate: 5, offset: 26ms, budget: 20ms}
  traffic_signs: {rate: 5, offset: 90ms, budget: 40ms}
END
user=$work/user/user.yaml
output=(--output "$work/out")

echo "=== defaults of the share folder"
expect 0 "" "$takt" run "$user" --clock virtual --for 1s --record "$work/run.mcap" "${output[@]}"
expect 0 "" env -u TAKT_HOME "$takt" run "$user" --clock virtual --for 1s --record "$work/again.mcap" "${output[@]}"
expect 0 "" "$takt" log diff "$work/run.mcap" "$work/again.mcap"
expect 0 "" "$takt" nodes traffic_signs
grep -q " signs  *signs " "$work/stdout" || fail "the default of \`signs\` is not shown as \`signs\`"

echo "=== the record replays with another share folder"
mkdir -p "$work/other/graph"
cp -r "$source/graph/signs" "$work/other/graph/"
TAKT_HOME=$work/other expect 0 "" "$takt" replay "$work/run.mcap" --compare "${output[@]}"
grep -q " 0 differ" "$work/stdout" || fail "the replay: $(cat "$work/stdout")"
! grep -q "signs" "$work/stderr" || fail "the place of the share folder counts as a change"
echo "# changed" >>"$work/other/graph/signs/signs.txt"
TAKT_HOME=$work/other expect 2 "other/graph/signs is not what it was" "$takt" replay "$work/run.mcap" "${output[@]}"

echo "=== a path in the graph file starts at that file"
sed -i 's/join: \[pair, disparity\]/&, params: {signs: signs}/' "$user"
expect 2 "user/signs/signs.txt" "$takt" check "$user"
cp -r "$source/graph/signs" "$work/user/"
expect 0 "" "$takt" run "$user" --clock virtual --for 1s "${output[@]}"
finish
