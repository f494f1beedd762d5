# SPDX-License-Identifier: Apache-2.0
# Another robot by graph edit alone: without a laser, with odometry in place of ego-motion, with one camera for both
# roles, with a pose joined from wheels, ego-motion and laser scans, with a laser's cloud, with a pose from scan matching. Each
# still maps. In virtual time, where no deadline depends on this machine.
source "$(dirname "$0")/lib.sh" "$@"
command -v python3 >/dev/null || echo "NOT RUN: what the maps show needs python3; only that they are written is tested"

edit() { # edit GRAPH-SED SCHEDULE-SED: the example and its schedule, each expression of which must change something
  rm -rf "$work/graph" "$work/schedules"
  mkdir -p "$work/graph" "$work/schedules"
  cp -r "$source"/graph/{worlds,rigs,objects,objects_3d.txt,signs,skeletons} "$work/graph/"
  cp "$source/graph/ace.yaml" "$work/graph/edited.yaml"
  cp "$source/schedules/thesis.yaml" "$work/schedules/"
  apply "$work/graph/edited.yaml" "$1"
  apply "$work/schedules/thesis.yaml" "$2"
}
apply() { # apply FILE EXPRESSIONS, one a line
  while read -r expression; do
    [ -n "$expression" ] || continue
    cp "$1" "$work/before"
    sed -i -E "$expression" "$1"
    cmp -s "$1" "$work/before" && fail "the edit $expression changed nothing"
  done <<<"$2"
}

shows() { # shows PICTURE: free and occupied cells, in numbers that a map without content does not have
  python3 - "$1" <<'PY' || fail "$1 shows no map"
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
at, packed = 8, b""
while at < len(data):
    length, kind = struct.unpack(">I4s", data[at:at + 8])
    body = data[at + 8:at + 8 + length]
    if kind == b"IHDR":
        width, height, bits, colour = struct.unpack(">IIBB", body[:10])
        assert bits == 8 and colour in (0, 2), "8-bit grey or colour expected"
        step = 1 if colour == 0 else 3
    packed += body if kind == b"IDAT" else b""
    at += 12 + length
raw, stride = zlib.decompress(packed), width * step
row = bytearray(stride)
levels = [0] * 256
for y in range(height):
    how, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
    for x in range(stride if how else 0):  # the filters of the PNG standard: none, left, above, mean, Paeth
        a, b, c = line[x - step] if x >= step else 0, row[x], row[x - step] if x >= step else 0
        p = [abs(b - c), abs(a - c), abs(a + b - 2 * c)]
        line[x] = line[x] + [0, a, b, (a + b) // 2, [a, b, c][p.index(min(p))]][how] & 255
    row = line
    for level in row[::step]: levels[level] += 1
free, occupied = sum(levels[192:]) / width / height, sum(levels[:64]) / width / height
print(f"{sys.argv[1].rsplit('/', 1)[1]}: {100 * free:.1f} % free, {100 * occupied:.1f} % occupied")
sys.exit(not (free > 0.02 and occupied > 0.002))
PY
}

maps() { # maps NAME: the edited graph runs, keeps every promise and yields its maps
  echo "=== $1"
  expect 0 "" "$takt" run "$work/graph/edited.yaml" --clock virtual --isolate none --for 5s --output "$work/$1"
  for picture in left disparity ground; do
    [ -s "$work/$1/$picture.png" ] || fail "$1: no $picture.png"
  done
  for picture in obstacles ground_map; do
    [ -s "$work/$1/$picture.png" ] || fail "$1: no $picture.png"
    command -v python3 >/dev/null && shows "$work/$1/$picture.png"
  done
}

edit '' ''
maps unchanged

edit '
  /^  front_laser: /d
  s/^(  base: \{kind: mobile_base, rate: 15).*/\1}/
  /^  robot:$/,/^  detection:$/{/^  detection:$/!d}
  /^        scan: \{from: front_laser/d
  /^        stop: \{from: obstacle_stop/d
  /^  stop: \{from: front_laser/d
  s/lost: \[front_laser, /lost: [/
' '
  /^  front_laser: /d
  /^  obstacle_stop: /d
'
grep -qE 'laser\.|obstacle_stop' "$work/graph/edited.yaml" && fail "something still reads the laser"
maps no_laser

edit '
  /^      - ego_motion\.motion$/d
  /^    ego_motion:$/,/^      join:/d
  /^    mapping_3d:$/,/^    picture:$/s/motion: \{from: ego_motion\.motion, depth: 16\}/odometry: {from: base.odometry, depth: 16}/
  /^        motion: \{from: ego_motion/d
  s/without: \[(.*)ego_motion, /without: [\1/
' '
  /^  ego_motion: /d
'
grep -q 'ego_motion' "$work/graph/edited.yaml" && fail "ego_motion is still in the graph"
maps odometry
[ -e "$work/odometry/track.png" ] && fail "odometry: a track without ego-motion"

edit '
  /^  ground_camera: /d
  s/ground_camera\.pair/head_camera.pair/
  s/head_camera, ground_camera, /head_camera, /
  s/lost: \[head_camera, ground_camera\]/lost: [head_camera]/
' '
  /^  ground_camera: /d
'
grep -q 'ground_camera' "$work/graph/edited.yaml" && fail "ground_camera is still in the graph"
maps one_camera

edit '
  /^    ground_map:$/i\    scan_matching: {type: scan_matching, in: {scan: {from: front_laser.scan, depth: 4}, odometry: {from: base.odometry, depth: 16}}}
  /^    ground_map:$/i\    robot_pose: {type: robot_pose, in: {odometry: {from: base.odometry, depth: 16}, motion: {from: ego_motion.motion, depth: 16}, robot_motion: {from: ego_motion.robot_motion, depth: 16}, scan_pose: {from: scan_matching.pose, depth: 16}}}
  /^    ground_map:$/,/^    mapping_3d:$/s/from: base\.odometry/from: robot_pose.odometry/
  /^    mapping_3d:$/,/^    picture:$/s/motion: \{from: ego_motion\.motion/odometry: {from: robot_pose.odometry/
' '
  $a\  scan_matching: {rate: 5, offset: 22ms, budget: 8ms, deadline: 200ms}
  $a\  robot_pose: {rate: 10, offset: 40ms, budget: 1ms, deadline: 100ms}
  s/^(  body_pose: .*budget: )25ms/\110ms/
'
maps joined_pose

# A laser's cloud in place of the stereo camera's: the robot drives on, and obstacles are mapped, without the head camera's depth.
edit '
  /^    ground_map:$/i\    laser_cloud: {type: laser_cloud, in: {scan: {from: front_laser.scan, depth: 8}, odometry: {from: base.odometry, depth: 32}}}
  /^    mapping_3d:$/,/^    picture:$/s/cloud: \{from: stereo\.cloud/cloud: {from: laser_cloud.cloud/
  /^    mapping_3d:$/,/^    picture:$/s/motion: \{from: ego_motion\.motion/odometry: {from: base.odometry/
  s/obstacle: \{from: head_camera\.pair/obstacle: {from: front_laser.scan/
' '
  $a\  laser_cloud: {rate: 5, offset: 22ms, budget: 1ms, deadline: 200ms}
'
maps laser_cloud

# A pose from outside, here that of scan matching, in place of ego-motion.
edit '
  /^    ground_map:$/i\    scan_matching: {type: scan_matching, in: {scan: {from: front_laser.scan, depth: 4}, odometry: {from: base.odometry, depth: 16}}}
  /^    mapping_3d:$/,/^    picture:$/s/motion: \{from: ego_motion\.motion/pose: {from: scan_matching.pose/
' '
  $a\  scan_matching: {rate: 5, offset: 22ms, budget: 8ms, deadline: 200ms}
  s/^(  body_pose: .*budget: )25ms/\110ms/
'
maps external_pose
finish
