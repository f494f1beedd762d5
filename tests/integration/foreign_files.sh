# SPDX-License-Identifier: Apache-2.0
# Files of other programs through the commands that read them: what was read, what was left out, which exit code. One table.
source "$(dirname "$0")/lib.sh" "$@"
export TAKT_DATA=$work/data  # never what lies there
mkdir "$work/data"
python3 "$source/tests/tools/foreign_files.py" "$work/data" || fail "the files cannot be made"

rows=$work/rows
# row EXIT 'TEXT' NAME COMMAND...: the exit code, and a text among all that is printed
row() {
  local code=$1 text=$2 name=$3 got said
  shift 3
  said=$("$@" 2>&1)
  got=$?
  printf '%-26s exit %s  %s\n' "$name" "$got" "$(grep -F -m 1 -- "$text" <<<"$said" | sed "s#$work/data/##g" | cut -c1-110)" >>"$rows"
  [ "$got" = "$code" ] || fail "$name: exit $got instead of $code: $said"
  grep -qF -- "$text" <<<"$said" || fail "$name: lacks '$text': $said"
}
cd "$work/data" || exit 1

echo "=== clouds"
for name in big_endian.ply stream.ply bom.ply blank.ply denormal.ply compressed.pcd; do row 0 "2 points" $name "$takt" cloud $name; done
row 0 "2 points, coloured" diffuse.ply "$takt" cloud diffuse.ply
row 0 "values of 0 to 1, and scaled" floats.ply "$takt" cloud floats.ply
row 0 "columns that are not read: nx" columns.ply "$takt" cloud columns.ply
row 0 "origin 512345 5312345 0 m" utm.ply "$takt" cloud utm.ply --reduce 0.005 --out again.ply --ascii
[ "$(tail -n 2 again.ply | tr '\n' ' ')" = "512345.123 5312345.678 1.5 512345.133 5312345.678 1.5 " ] || fail "UTM: $(cat again.ply)"
row 0 '"origin": [' utm.json "$takt" cloud utm.ply --json
row 0 "2 points" pipe bash -c "cat big_endian.ply | '$takt' cloud /dev/stdin"
row 2 "expected 2 rows of 12" cut.pcd "$takt" cloud cut.pcd

# graph NAME DEVICE PARAMS: one stereo node on a replayed camera
graph() {
  printf 'takt: 1\nname: %s\nschedule: one.yaml\ndefault_profile: replay\ndevices:\n  cam: {kind: stereo_camera, rate: 5}\nprofiles:\n  replay:\n    default: {driver: replay, %s}\nsubsystems:\n  s:\n    stereo: {type: stereo, in: {pair: cam.pair}, params: {disparities: 16%s}}\n' "$1" "$2" "$3" >"$1.yaml"
}
printf 'takt: 1\nname: one\npolicy: cooperative\nnodes:\n  stereo: {rate: 5, budget: 50ms, criticality: high}\n' >one.yaml
run() { "$takt" run "$1.yaml" --clock virtual --isolate none --for 1s --output "$work/out" --report "$work/report.json"; }

echo "=== images"
graph ten_bits "directory: ten_bits" ""
row 0 "image_l: 1 files that are no images" "10 bits, PGM" run ten_bits
grep -q '"left_out": *\[' "$work/report.json" && grep -q "no images are left out" "$work/report.json" || fail "the report lacks what was left out"
graph sixteen "left: sixteen.png, right: sixteen.png, focal: 100, baseline: 0.1m" ""
row 2 'say `bits: 10`' "16-bit PNG" run sixteen
graph said "left: sixteen.png, right: sixteen.png, focal: 100, baseline: 0.1m, bits: 10" ""
row 0 "ok" "16-bit PNG, bits: 10" run said
graph huge "left: huge.pgm, right: huge.pgm, focal: 100, baseline: 0.1m" ""
row 2 "huge.pgm: is too short for what it claims" "60000 x 60000" run huge
graph kitti "directory: kitti" ""
row 0 "as KITTI odometry; not read: velodyne" "KITTI odometry" run kitti
graph euroc "directory: euroc" ", calibration: euroc/mav0/cam0/sensor.yaml"
row 0 "as EuRoC; not read: imu0" EuRoC run euroc

echo "=== calibrations"
for name in rational kalibr; do
  graph $name "directory: euroc" ", calibration: $name.cal"
  row 0 "ok" "$name calibration" run $name
done
graph millimetres "directory: euroc" ", calibration: millimetres.cal"
row 2 "120 mm is 0.12" "baseline of 120 m" run millimetres
graph cut "directory: euroc" ", calibration: cut.cal"
row 2 "was the file cut off?" "cut calibration" run cut

echo "=== CARMEN logs"
printf 'takt: 1\nname: drive\npolicy: cooperative\nnodes:\n  guard: {rate: 5, budget: 5ms, criticality: high}\n' >drive_schedule.yaml
drive() {
  printf 'takt: 1\nname: drive\nschedule: drive_schedule.yaml\ndefault_profile: replay\ndevices:\n  laser: {kind: laser_scanner, rate: 5}\n  base: {kind: mobile_base, rate: 5}\nprofiles:\n  replay:\n    default: {driver: replay, log: %s}\nsubsystems:\n  s:\n    guard: {type: obstacle_stop, in: {scan: {from: laser.scan, max_age: 2s}, odometry: {from: base.odometry, max_age: 2s}}}\n' "$1" >drive.yaml
  run drive
}
row 0 "line 7 is cut off and left out" "cut log" drive cut.log
# In processes of their own as well: the report has what each device left out.
"$takt" run drive.yaml --isolate subsystem --policy cooperative --for 500ms --output "$work/out" --report "$work/report.json" >/dev/null 2>&1
python3 - "$work/report.json" <<'PY' || fail "the report of several processes: $(grep -A4 left_out "$work/report.json")"
import json, sys
left = json.load(open(sys.argv[1]))["left_out"]
assert len(left) == 2 and all("line 7 is cut off" in line for line in left), left
PY
row 0 "2 ranges are inf or NaN" "ranges inf and nan" drive inf.log
row 0 "has no ODOM lines; the poses of its 4 ROBOTLASER1" ROBOTLASER1 drive robotlaser.log
row 2 'add `start: 1000.' "begins late" drive late.log
row 0 "messages that are not read: 3 SYNC" "other messages" drive other.log

cat "$rows"
finish
