# SPDX-License-Identifier: Apache-2.0
# What no other script runs: every other command that the README shows, once and small, as a user starts it. How good its
# figures are, the tests of its room know.
source "$(dirname "$0")/lib.sh" "$@"
unset TAKT_DATA  # what is recorded is another test's

# answers COMMAND...: exit 0, and something on stdout.
answers() {
  expect 0 "" "$@"
  [ -s "$work/stdout" ] || fail "nothing on stdout: $*"
}
# tells TEXT COMMAND...: exit 0, and TEXT on stdout.
tells() {
  local text=$1
  shift
  expect 0 "" "$@"
  grep -qF -- "$text" "$work/stdout" || fail "stdout lacks '$text': $*"
}
# writes FILE COMMAND...: exit 0, and FILE holds something.
writes() {
  local file=$1
  shift
  expect 0 "" "$@"
  [ -s "$file" ] || fail "$file is empty or absent: $*"
}

tells robot_client "$takt" nodes
tells disparities "$takt" nodes stereo
expect 0 "" "$takt" devices --json
python3 -m json.tool "$work/stdout" >/dev/null || fail "devices: no JSON"

"$takt" double base --can "unix:$work/can" </dev/null >"$work/double.out" 2>&1 &
double=$!
for _ in $(seq 100); do [ -S "$work/can" ] && break; sleep 0.1; done
expect 0 "" "$takt" capture "unix:$work/can" "$work/frames.log" --for 1s
kill $double
wait $double

writes "$work/sweeps.txt" "$takt" calibrate lasers --generate "$work/sweeps.txt"
writes "$work/mounts.yaml" "$takt" calibrate lasers "$work/sweeps.txt" --out "$work/mounts.yaml"

writes "$work/stop.png" "$takt" train picture stop "$work/stop.png"
mkdir "$work/signs"
writes "$work/signs/stop.xml" "$takt" train cascade --sign stop --out "$work/signs" --stages 1 --positives 50 --images 2

cp -r "$source/graph/objects" "$work/objects"
view=$(ls "$work"/objects/*/*.png | head -n 1)
tells red_box "$takt" objects list "$work/objects"
answers "$takt" objects add "$work/objects" copy "$view"
tells copy "$takt" objects list "$work/objects"
sed -i '/^object green_box/{n;s/.*/threshold auto auto auto 0.4/}' "$work/objects/objects.txt"
answers "$takt" objects tune "$work/objects" --object green_box --scenes 1 --write
grep -A 1 '^object green_box' "$work/objects/objects.txt" | grep -qE '^threshold( 0[.0-9]+| 1){3} 0\.4$' || fail "tune --write: not its three thresholds before the one of the layout"
expect 0 "" "$takt" run --clock virtual --for 1s --output "$work/out"
answers "$takt" objects test "$work/objects" "$work/out/left.png"
answers "$takt" objects publish "$work/objects"

mkdir "$work/views"
# The forms that recordings have. One crop and one photograph of a sign, named by a CSV beside them; a row of another folder is left out.
"$takt" train picture stop "$work/signs/00001_00000.png" --size 96 >/dev/null 2>&1 || fail "no picture of a sign"
printf 'file,gtsrb_class,name\nsigns/00001_00000.png,14,stop\n' >"$work/labels.csv"
printf 'file,class,x,y,w,h\nsigns/00001_00000.png,stop,0,0,96,96\nstop.png,stop,0,0,9,9\n' >"$work/boxes.csv"
rates() { # IMAGES COMMAND...: one flat object with both rates and those of a baseline
  local images=$1
  shift
  expect 0 "" "$takt" eval signs "$@" --json
  python3 -c 'import json, sys; o = json.load(open(sys.argv[1]))
for one in (o, o["baseline"]): assert 0 <= one["hits_pct"] <= 100 and 0 <= one["false_pct"] <= 100, one
assert o["images"] == int(sys.argv[2]), o' "$work/stdout" "$images" || fail "eval signs $*: not the figures that design.md names"
}
rates 1 --crops "$work/signs" --labels "$work/labels.csv"
rates 1 --scenes "$work/signs" --boxes "$work/boxes.csv"
rates 4 --count 4 --passages 1
printf 'file,class,x,y,w,h\nsigns/00001_00000.png,stop,0,none,96,96\n' >"$work/wrong.csv"
expect 2 "wrong.csv:2: \`y\` is \`none\`" "$takt" eval signs --scenes "$work/signs" --boxes "$work/wrong.csv"
expect 2 "labels.csv:1: has no column \`x\`" "$takt" eval signs --scenes "$work/signs" --boxes "$work/labels.csv"
expect 2 "names no image in" "$takt" eval signs --crops "$work/views" --labels "$work/labels.csv"
mkdir "$work/photographs"
for i in 0 1 2; do cp "$work/out/left.png" "$work/photographs/$i.png"; done
angle=0
for view in "$source"/graph/objects/red_box/*.png; do
  cp "$view" "$work/views/obj1__$angle.png"
  angle=$((angle + 30))
done
expect 0 "" "$takt" eval objects --views "$work/views" --scenes "$work/photographs" --frames 1 --images 2 --empty 1 --seed 3 --json
python3 -c 'import json, sys; o = json.load(open(sys.argv[1]))
for one in (o, o["baseline"]): assert 0 <= one["detected_pct"] <= 100 and one["missed"] <= 2 and one["false_positives"] >= 0, one
assert o["seed"] == 3 and o["cascade"]["photographs"] == 2 and o["cascade"]["photographs_learnt_from"] == 1, o' "$work/stdout" ||
  fail "eval objects --views --scenes: not its figures"
expect 2 "holds no photograph obj" "$takt" eval objects --views "$work/photographs"

for graph in crossing people remote_robot yard; do
  expect 0 "" "$takt" run "$source/graph/$graph.yaml" --clock virtual --for 1s --output "$work/out"
done
port=$((20000 + RANDOM % 10000))
expect 0 "" "$takt" run "$source/graph/simulator.yaml" --clock virtual --for 1s --set "service.address=127.0.0.1:$port" --output "$work/out"
expect 0 "" "$takt" run --profile replay --clock virtual --for 1s --output "$work/out"

# What the scenarios run is made from schedules and graphs that change: it must still be read.
for scenario in overload degrade saboteur; do
  expect 0 "" env TAKT="$takt" bash "$source/bench/scenarios/$scenario.sh" inputs
done

answers "$takt" eval objects --frames 1 --images 1 --empty 1 --budget 12 --automatic --size 1 1.2
answers "$takt" eval objects3d --samples 2
answers "$takt" eval sift --frames 1
answers "$takt" eval body_pose --people 1 --budget 60 --tilt -25 --noise 0.2 --step 1
answers "$takt" eval person_tracking --walks 1 --frames 5
answers "$takt" eval mapping --minutes 0 --runs 1 --clouds 3
answers "$takt" eval registration --sweep population --runs 1 --generations 20 --points 50
answers "$takt" eval obstacle_stop --trials 1 --vision absent
answers "$takt" eval semantic --rooms 1 --objects 5 --looks 10
answers "$takt" eval semantic --network "$source/graph/networks/kitchen.yaml" --goal cup_1.level=full --at 0 0
finish
