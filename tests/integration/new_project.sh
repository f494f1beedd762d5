#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# new_project.sh TAKT SOURCE BUILD: `takt new`, from an installed Takt to a project that runs, records and replays.
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
unset TAKT_HOME  # what was installed finds its own
export CMAKE_PREFIX_PATH=$work/prefix
cmake --install "$3" --prefix "$work/prefix" >"$work/install.log" || fail "cannot install: $(tail -n 3 "$work/install.log")"
takt=$work/prefix/bin/takt
cd "$work" || exit 1

# A name that contains one of the templates' own words.
expect 0 "" "$takt" new my_robot
[ "$(find my_robot -mindepth 1 | wc -l)" -le 7 ] || fail "more than seven files: $(ls my_robot)"
! grep -r @NAME@ my_robot || fail "a name is not filled in"
expect 2 "my_robot is there already" "$takt" new my_robot
expect 2 "\`2robot\` is no name of a project" "$takt" new 2robot
expect 2 "\`class\` is a word of C++" "$takt" new class
expect 2 "name is required" "$takt" new
expect 3 "/proc/robot cannot be made" env -C /proc "$takt" new robot

cd my_robot || exit 1
expect 0 "" cmake -S . -B build
began=$(date +%s%N)
expect 0 "" cmake --build build -j2
echo "built in $((($(date +%s%N) - began) / 1000000)) ms"
expect 0 "" ctest --test-dir build --no-tests=error
takt=build/my_robot
libraries=$(ldd "$takt" | grep -vc linux-vdso)
[ "$libraries" -le 12 ] || fail "it needs $libraries shared libraries, more than 12: $(ldd "$takt")"

expect 0 "" "$takt" check my_robot.yaml
expect 0 "" "$takt" check my_robot.yaml --profile robot  # the hardware need not be there
expect 2 "must lie in 0.01..1" "$takt" check my_robot.yaml --set smoother.gain=2
expect 2 "noise" "$takt" run my_robot.yaml --clock virtual --set front.noise=-1m
expect 0 "" "$takt" nodes smoother
expect 0 "" "$takt" show my_robot.yaml

# In virtual time each run is the same, and a replay of it gives the same messages.
for copy in a b; do expect 0 "" "$takt" run my_robot.yaml --clock virtual --for 3s --record $copy.mcap; done
grep -q "s smoother: info: begins at" "$work/stderr" || fail "the run does not print what a node says: $(cat "$work/stderr")"
expect 0 "" "$takt" log diff a.mcap b.mcap
expect 0 "" "$takt" replay a.mcap --compare
grep -q "compared 60 of" "$work/stdout" "$work/stderr" || fail "replay compared: $(cat "$work/stdout")"
expect 0 "" "$takt" log info a.mcap
grep -q "1 log" "$work/stdout" || fail "log info does not count what nodes said: $(cat "$work/stdout")"
grep -q my_robot_distance "$work/stdout" || fail "log info does not show the project's message"

# In real time, another terminal looks on. On a machine with other work a deadline may be missed: exit 1.
start_run real my_robot.yaml --for 0s --record real.mcap
expect 0 "" "$takt" echo smoother.smooth --run $run --count 2
grep -q distance_m "$work/stdout" || fail "echo shows no distance: $(cat "$work/stdout")"
expect 0 "" "$takt" set smoother.gain 0.5 --run $run
expect 0 "" "$takt" top --once --run $run
grep -q front "$work/stdout" || fail "top shows no device: $(cat "$work/stdout")"
expect 0 "" "$takt" stop --run $run
wait $run
[ $? -le 1 ] || fail "the run in real time: $(tail -n 3 "$work/real.err")"
expect 0 "" "$takt" replay real.mcap --compare

cat >silent.yaml <<'EOF'
takt: 1
name: silent
faults:
  - {kind: silent, target: front, from: 1s, to: 2s}
  - {kind: drop, target: front.distance, from: 2500ms, to: 3s}
expect:
  rates: {smoother: {at_least: 13, at_most: 14}}
  recovery: 200ms
EOF
expect 0 "" "$takt" run my_robot.yaml --clock virtual --for 3s --faults silent.yaml
finish
