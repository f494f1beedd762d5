# SPDX-License-Identifier: Apache-2.0
# Another robot by graph edit alone: without a low laser, without ego-motion, with one camera for both roles, with a laser's
# cloud in place of stereo, with an external pose in place of ego-motion, and with ego-motion alone as the thesis has it. Each
# still maps. In virtual time, where no deadline depends on this machine.
source "$(dirname "$0")/lib.sh" "$@"
command -v python3 >/dev/null || echo "NOT RUN: what the maps show needs python3; only that they are written is tested"

edit() { # edit GRAPH-SED SCHEDULE-SED: the example and its schedule, each expression of which must change something
  rm -rf "$work/graph" "$work/schedules"
  mkdir -p "$work/graph" "$work/schedules"
  cp -r "$source"/graph/{worlds,rigs,objects,objects_3d.txt,terrain.txt,networks,signs,skeletons} "$work/graph/"
  cp "$source/graph/ace.yaml" "$work/graph/edited.yaml"
  apply "$work/graph/edited.yaml" '/^  # ACE itself/,/^    lines: /d'  # its profile robot names every device
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
[ -s "$work/unchanged/map/map.ply" ] || fail "unchanged: no map.ply"

edit '
  /^  front_laser: /d
  s/^(  base: \{kind: mobile_base, rate: 15).*/\1}/
  /^  robot:$/,/^  detection:$/{/^  detection:$/!d}
  /^    scan_matching:$/,/^    robot_pose:$/{/^    robot_pose:$/!d}
  /^    laser_cloud:$/,/^    picture:$/{/^    picture:$/!d}
  /^        scan: \{from: front_laser/d
  /^        scan_pose: /d
  /^        grid: scan_matching\.map/d
  /: laser_fusion\./d
  /^        correction: /d
  /^        stop: \{from: obstacle_stop/d
  /^  (stop|pose): \{from: front_laser/d
  s/laser_cloud, laser_fusion, //
  /^      params: \{on_request: laser_fusion\}/d
  s/lost: \[front_laser, /lost: [/
  s/, front_laser: \{[^}]*\}//
' '
  /^  front_laser: /d
  /^  obstacle_stop: /d
  /^  scan_matching: /d
  /^  laser_cloud: /d
  /^  laser_fusion: /d
'
grep -qE 'front_laser|obstacle_stop|scan_matching' "$work/graph/edited.yaml" && fail "something still reads the low laser"
maps no_laser

edit '
  /^      - ego_motion\.motion$/d
  /^    ego_motion:$/,/^      join:/d
  /^        (robot_)?motion: \{from: ego_motion/d
  s/without: \[(.*)ego_motion, /without: [\1/
' '
  /^  ego_motion: /d
'
grep -q 'ego_motion' "$work/graph/edited.yaml" && fail "ego_motion is still in the graph"
maps no_ego_motion
[ -e "$work/no_ego_motion/track.png" ] && fail "no_ego_motion: a track without ego-motion"

# What the head camera sees now also comes to the ground map by way of ego-motion and the joined pose, which is up to 407 ms
# old even where this camera's image is made to be there sooner: the chain may be.
edit '
  /^  ground_camera: /d
  s/ground_camera\.pair/head_camera.pair/
  s/head_camera, ground_camera, /head_camera, /
  s/lost: \[head_camera, ground_camera\]/lost: [head_camera]/
  s/(to: ground_map\.grid, max_age: )400ms/\1450ms/
  s/^ +ground_camera: \{trigger.*\}\}$/  }/
' '
  /^  ground_camera: /d
  s/^(  head_camera: .*deadline: )66ms/\125ms/
  s/^(  ground_map: .*offset: )50ms/\130ms/
'
grep -q 'ground_camera' "$work/graph/edited.yaml" && fail "ground_camera is still in the graph"
maps one_camera

# A laser's cloud, twice a second, in place of the stereo camera's: obstacles are mapped without the head camera's depth.
edit '
  /^    mapping_3d:$/,/^    traversability:$/s/cloud: \{from: stereo\.cloud/cloud: {from: laser_cloud.cloud/
  s/(obstacle: \{from: )head_camera\.pair(.*max_age: )700ms/\1front_laser.scan\21300ms/
' ''
maps laser_cloud

# The cloud of full images, twice a second, in place of the small ones', beside all else: every fourth pixel, as much floor
# as 150 disparities show, and a search for bodies that leaves the reservations room. graph/fine.yaml has more of it, and less
# beside.
edit '
  s/^(  )(head_camera: \{kind: .*)/\1\2\n\1fine_camera: {kind: stereo_camera, rig: rigs\/xb3_fine.yaml, rate: 2}/
  s/^(    )(stereo: \{type: stereo, .*)/\1\2\n\1stereo_fine: {type: stereo, in: {pair: fine_camera.pair}, params: {cloud_step: 4}}/
  /^    mapping_3d:$/,/^    traversability:$/s/cloud: \{from: stereo\.cloud/cloud: {from: stereo_fine.cloud/
  s/(obstacle: \{from: )head_camera\.pair(.*max_age: )700ms/\1fine_camera.pair\21300ms/
  s/(stereo\.disparity, max_age: )350ms/\1500ms/
  s/without: \[stereo, /&stereo_fine, /
  s/(without: \[head_camera, ground_camera, )stereo, /\1fine_camera, stereo, stereo_fine, /
  s/lost: \[head_camera/lost: [fine_camera, head_camera/
' '
  s/^(  )(head_camera: .*)/\1\2\n\1fine_camera: {rate: 2, budget: 16ms, deadline: 300ms}/
  s/^(  )(stereo: .*)/\1\2\n\1stereo_fine: {rate: 2, offset: 305ms, budget: 60ms, deadline: 490ms, on_overrun: degrade}/
  s/^(  mapping_3d: .*offset: )70ms/\1300ms/
  s/^(  body_pose: .*budget: )22ms/\18ms/
'
maps stereo_fine

# A pose from outside, here that of scan matching, in place of what ego-motion has a part in.
edit '
  /^    mapping_3d:$/,/^    traversability:$/s/pose: \{from: robot_pose\.pose/pose: {from: scan_matching.pose/
' ''
maps external_pose

# The thesis's own: ego-motion alone, and wheels for the ground map.
edit '
  /^    mapping_3d:$/,/^    traversability:$/s/pose: \{from: robot_pose\.pose/motion: {from: ego_motion.motion/
  /^        correction: /d
  /^    ground_map:$/,/^    mapping_3d:$/s/from: robot_pose\.odometry/from: base.odometry/
' ''
maps thesis

# Full images for the map alone, and the switch back to small ones.
for profile in sim coarse; do
  echo "=== fine, profile $profile"
  expect 0 "" "$takt" check "$source/graph/fine.yaml" --profile $profile
  expect 0 "" "$takt" run "$source/graph/fine.yaml" --profile $profile --clock virtual --isolate none --for 5s --output "$work/fine_$profile"
  command -v python3 >/dev/null && shows "$work/fine_$profile/obstacles.png"
done
points() { sed -n 's/^element vertex //p;/^end_header/q' "$work/fine_$1/map/map.ply" | head -n 1; }
[ "$(points sim)" -gt "$(points coarse)" ] || fail "full images gave $(points sim) points of a map, small ones $(points coarse)"
finish
