# SPDX-License-Identifier: Apache-2.0
# Every kind of bad input ends with the right exit code, says where and what, and leaves nothing behind.
source "$(dirname "$0")/lib.sh" "$@"

graph() { # graph SED-EXPRESSION: a copy of the example with one thing wrong
  mkdir -p "$work/graph" "$work/schedules"
  cp -r "$source"/graph/worlds "$source"/graph/rigs "$work/graph/"
  cp "$source"/schedules/*.yaml "$work/schedules/"
  sed -E "$1" "$source/graph/ace.yaml" >"$work/graph/bad.yaml"
  cmp -s "$source/graph/ace.yaml" "$work/graph/bad.yaml" && fail "the edit $1 changed nothing"
}
left_behind() { ls /dev/shm /tmp | grep -E '^(takt|iox|roudi|iceoryx)' | sort; pgrep -af "^$takt run" | cut -d' ' -f2-; }
before=$(left_behind)
run() { expect "$1" "$2" "$takt" run "$work/graph/bad.yaml" --for 1s --output "$work/out"; }

graph 's/stereo\.disparity, max_age/stereo.disparty, max_age/'; run 2 "did you mean"
graph 's/type: stereo,/type: stereoo,/';                        run 2 "stereoo"
graph 's/^    ego_motion:/    stereo:/';                         run 2 "stereo"
graph 's/max_age: 350ms/max_age: 250/';                         run 2 "max_age"
graph 's/in: \{pair: head_camera\.pair\}/in: {pair: stereo.disparity}/'; run 2 "disparity"
graph 's/disparities: 150/disparities: 5000/';                  run 2 "1..512"
graph 's/xb3\.yaml/none.yaml/';                                 run 2 "none.yaml"
graph 's/type: mapping_3d/typ: mapping_3d/';                    run 2 "typ"

# A cycle of `on` edges.
graph 's/name: ace/name: cyclic/'
sed -i -E 's/  stereo: \{rate: 15, offset: 26ms/  stereo: {on: ego_motion.motion/; s/  ego_motion: \{rate: 10, offset: 48ms/  ego_motion: {on: stereo.disparity/' "$work/schedules/thesis.yaml"
run 2 "cycle"
cp "$source"/schedules/*.yaml "$work/schedules/"

# All problems at once.
graph 's/type: stereo,/type: stereoo,/; s/max_age: 350ms/max_age: 250/'
run 2 "stereoo"
grep -q "max_age" "$work/stderr" || fail "only the first problem was reported"

# One cause is one problem: nobody complains of what a node that was refused would have given.
graph 's/disparities: 150\}/disparities: 150, calibration: none.yaml}/'
for isolate in none subsystem; do
  expect 2 "none.yaml: no such file; check parameter \`calibration\`" "$takt" run "$work/graph/bad.yaml" --for 1s --output "$work/out" --isolate $isolate
  grep -qE "traffic_signs|ego_motion" "$work/stderr" && fail "one wrong file makes more than one problem"
done

# Where stdout cannot take what is printed, whoever reads the file must learn of it.
for command in nodes "check --json" --help "eval --help"; do
  expect 3 "stdout could not take all that was printed" sh -c "'$takt' $command >/dev/full"
done
# Closed streams: no file or device of a run gets their numbers, and what is printed goes into none.
"$takt" run --for 0s --isolate none --policy cooperative --output "$work/closed" <&- >&- 2>&- &
run=$!
until "$takt" top --once --run $run >/dev/null 2>&1 || ! kill -0 $run; do sleep 0.1; done
for stream in 0 1 2; do
  [ "$(readlink /proc/$run/fd/$stream)" = /dev/null ] || fail "stream $stream, which was closed, is $(readlink /proc/$run/fd/$stream)"
done
kill -TERM $run
wait $run
code=$?
[ $code -le 1 ] || fail "a run with closed streams: exit $code"  # 1: a deadline was missed, which is not judged here

expect 2 "does-not-exist" "$takt" run "$work/does-not-exist.yaml" --output "$work/out"
expect 2 "--for" "$takt" run --for 5
expect 2 "no such directory" env TAKT_DATA="$work/nothing" "$takt" run "$source/graph/kitti.yaml" --output "$work/out"
expect 2 "poses.txt" "$takt" eval ego_motion --data "$work"
expect 2 "either --data DIR or --generated" "$takt" eval ego_motion
expect 2 "none.png" "$takt" eval stereo --left "$work/none.png" --right "$work/none.png" --gt "$work/none.png" --gt-scale 1 --disparities 16
expect 2 "no file is named like left*.jpg" "$takt" calibrate stereo "$work"
expect 2 "calib_cam_to_cam.txt: cannot be read" "$takt" eval stereo --scene "$work"
expect 2 "--scene excludes --sweep" "$takt" eval stereo --scene "$work" --sweep noise
expect 2 "xb3.yaml: the pairs are rectified already" "$takt" calibrate rig "$source/graph/rigs/xb3.yaml" --out "$work/rig.yaml"
expect 2 "none.yaml cannot be read: No such file or directory" "$takt" calibrate rig "$work/none.yaml" --out "$work/rig.yaml"

# A recording of our own, with one thing wrong at a time.
"$takt" run --clock virtual --for 1s --output "$work/pictures" >/dev/null 2>&1 || fail "the run that makes the pictures"
recording() {
  rm -rf "$work/data" && mkdir -p "$work/data/stereo_sequence/kitti06"/image_{l,r}
  for side in l r; do cp "$work/pictures/disparity.png" "$work/data/stereo_sequence/kitti06/image_$side/000000.png"; done
  printf 'P0: 500 0 320 0 0 500 240 0 0 0 1 0\nP1: 500 0 320 -60 0 500 240 0 0 0 1 0\n' >"$work/data/stereo_sequence/kitti06/calib.txt"
}
replay() { expect "$1" "$2" env TAKT_DATA="$work/data" "$takt" run "$source/graph/kitti.yaml" --output "$work/out" --policy cooperative; }
recording; expect 0 "" env TAKT_DATA="$work/data" "$takt" run "$source/graph/kitti.yaml" --output "$work/out" --clock virtual
recording; rm -r "$work/data/stereo_sequence/kitti06/image_r"; replay 2 "image_r"
recording; truncate -s 2000 "$work/data/stereo_sequence/kitti06/image_l/000000.png"; replay 2 "truncated PNG"
recording; sed -i 's/P0: 500/P0: nan/' "$work/data/stereo_sequence/kitti06/calib.txt"; replay 2 "calib.txt:1"
recording; rm "$work/data/stereo_sequence/kitti06/calib.txt"; replay 2 "calib.txt"

# Devices and daemons: exit 3.
graph 's#sim: \{default: .*#sim: {default: {driver: sim, world: worlds/lab.xml}, head_camera: {driver: v4l2, path: /dev/video99}}#'
run 3 "/dev/video99"
# A /tmp and a /dev/shm of its own, so that no daemon of the user is disturbed; what runs there is copied there, because
# the project itself may stand below /tmp.
private() {
  unshare -m sh -c 'mount -t tmpfs tmpfs /dev/shm && cp -r "$1" "$2/graph" "$2/schedules" /dev/shm/ &&
    mount -t tmpfs tmpfs /tmp && shift 2 && TAKT_HOME=/dev/shm exec "$@"' private "$takt" "$source" "$@"
}
if private true 2>/dev/null; then
  expect 3 "another iceoryx daemon is running" private sh -c '
    takt=/dev/shm/takt
    "$takt" run --for 0s --isolate none --transport iceoryx --policy cooperative --output /tmp/one >/dev/null 2>&1 & first=$!
    until [ -e /dev/shm/root ] || ! kill -0 $first; do sleep 0.1; done
    "$takt" run --for 1s --isolate none --transport iceoryx --policy cooperative --output /tmp/two; code=$?
    kill -TERM $first; wait $first
    exit $code'
else
  echo "NOT RUN: the lock of another daemon needs a private mount namespace; run as root"
fi

after=$(left_behind)
[ "$before" = "$after" ] || fail "something was left behind: $(diff <(echo "$before") <(echo "$after"))"
finish
