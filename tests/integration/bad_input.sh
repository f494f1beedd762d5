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
before=$(ls /dev/shm /tmp | sort)
run() { expect "$1" "$2" "$takt" run "$work/graph/bad.yaml" --for 1s --output "$work/out"; }

graph 's/stereo\.disparity, max_age/stereo.disparty, max_age/'; run 2 "did you mean"
graph 's/type: stereo,/type: stereoo,/';                        run 2 "stereoo"
graph 's/^    ego_motion:/    stereo:/';                         run 2 "stereo"
graph 's/max_age: 150ms/max_age: 150/';                         run 2 "max_age"
graph 's/in: \{pair: head_camera\.pair\}/in: {pair: stereo.disparity}/'; run 2 "disparity"
graph 's/disparities: 150/disparities: 5000/';                  run 2 "1..512"
graph 's/xb3\.yaml/none.yaml/';                                 run 2 "none.yaml"
graph 's/type: mapping_3d/typ: mapping_3d/';                    run 2 "typ"

# A cycle of `on` edges.
graph 's/name: ace/name: cyclic/'
sed -i -E 's/  stereo: \{rate: 15, offset: 16ms/  stereo: {on: ego_motion.motion/; s/  ego_motion: \{rate: 10, offset: 20ms/  ego_motion: {on: stereo.disparity/' "$work/schedules/thesis.yaml"
run 2 "cycle"
cp "$source"/schedules/*.yaml "$work/schedules/"

# All problems at once.
graph 's/type: stereo,/type: stereoo,/; s/max_age: 150ms/max_age: 150/'
run 2 "stereoo"
grep -q "max_age" "$work/stderr" || fail "only the first problem was reported"

expect 2 "does-not-exist" "$takt" run "$work/does-not-exist.yaml"
expect 2 "--for" "$takt" run --for 5
expect 2 "image_l" env TAKT_DATA="$work/nothing" "$takt" run "$source/graph/kitti.yaml"
expect 2 "calib" "$takt" eval ego_motion --data "$work"

[ "$before" = "$(ls /dev/shm /tmp | sort)" ] || fail "something was left in /dev/shm or /tmp: $(diff <(echo "$before") <(ls /dev/shm /tmp | sort))"
finish
