# SPDX-License-Identifier: Apache-2.0
# What no other script runs: every other command that docs/commands.md shows, once and small, as a user starts it. How good its
# figures are, the tests of its room know.
source "$(dirname "$0")/lib.sh" "$@"
unset TAKT_DATA  # what is recorded is another test's

# answers COMMAND...: exit 0, and something on stdout.
answers() {
  expect 0 "" "$@"
  [ -s "$work/stdout" ] || fail "nothing on stdout: $*"
}
# shows TEXT COMMAND...: exit 0, and TEXT on stdout.
shows() {
  local text=$1
  shift
  expect 0 "" "$@"
  prints "$text"
}
# writes FILE COMMAND...: exit 0, and FILE holds something.
writes() {
  local file=$1
  shift
  expect 0 "" "$@"
  [ -s "$file" ] || fail "$file is empty or absent: $*"
}

shows robot_client "$takt" nodes
shows disparities "$takt" nodes stereo
[ ! -x "$(dirname "$takt")/takt-bench" ] || shows "what to measure" "$takt" bench --help
expect 0 "" "$takt" devices --json
python3 -m json.tool "$work/stdout" >/dev/null || fail "devices: no JSON"

"$takt" double base --can "unix:$work/can" </dev/null >"$work/double.out" 2>&1 &
double=$!
for _ in $(seq 100); do [ -S "$work/can" ] && break; sleep 0.1; done
expect 0 "" "$takt" capture "unix:$work/can" "$work/frames.log" --for 1s
kill $double
wait $double

# Every sort of frame, as candump -L writes it; a packet that is none is counted.
python3 - "$work/bus" <<'PY' &
import socket, struct, sys, time
bus = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
bus.bind(sys.argv[1])
bus.listen(1)
host, _ = bus.accept()
classic = lambda number, data: struct.pack("<IB3x8s", number, len(data), data)
for packet in (classic(0x7F, b"\1\2"), classic(0x80000000 | 0x18DA10F1, b"\3"), classic(0x40000201, b""),
               classic(0x20000010, bytes(8)), struct.pack("<IBB2x64s", 0x1F0, 12, 1, b"\xbb" * 12), b"none"):
    host.send(packet)
time.sleep(2)
PY
bus=$!
for _ in $(seq 100); do [ -S "$work/bus" ] && break; sleep 0.1; done
expect 0 "" "$takt" capture "unix:$work/bus" "$work/bus.log" --for 1s
kill $bus
wait $bus
prints "5 frames (1 extended, 1 remote, 1 error, 1 FD)"
prints "1 packets are no CAN frames"
[ "$(cut -d' ' -f3 "$work/bus.log" | tr '\n' ' ')" = \
  "07F#0102 18DA10F1#03 201#R 20000010#0000000000000000 1F0##1BBBBBBBBBBBBBBBBBBBBBBBB " ] || fail "frames: $(cat "$work/bus.log")"

writes "$work/sweeps.txt" "$takt" calibrate lasers --generate "$work/sweeps.txt"
writes "$work/mounts.yaml" "$takt" calibrate lasers "$work/sweeps.txt" --out "$work/mounts.yaml"

writes "$work/stop.png" "$takt" train picture stop "$work/stop.png"
mkdir "$work/signs"
writes "$work/signs/stop.xml" "$takt" train cascade --sign stop --out "$work/signs" --stages 1 --positives 50 --images 2

cp -r "$source/graph/objects" "$work/objects"
view=$(ls "$work"/objects/*/*.png | head -n 1)
shows red_box "$takt" objects list "$work/objects"
answers "$takt" objects add "$work/objects" copy "$view"
shows copy "$takt" objects list "$work/objects"
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
expect 2 "is an empty folder" "$takt" eval signs --crops "$work/views" --labels "$work/labels.csv"
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
expect 0 "" "$takt" run "$source/tests/scenarios/raw_cloud.yaml" --clock virtual --output "$work/out" --report "$work/report.json"
python3 - "$work/report.json" <<'PY' || fail "raw_cloud: a job took memory"
import json, sys
nodes = {node["name"]: node for node in json.load(open(sys.argv[1]))["nodes"]}
for name in ("stereo", "ego_motion", "cloud_filter"):
    print(name, nodes[name]["samples"], "jobs,", nodes[name]["rt_violations"], nodes[name]["page_faults"], "page faults")
    assert nodes[name]["samples"] > 10 and not nodes[name]["rt_violations"] and nodes[name]["page_faults"] == 0
PY
port=$((20000 + RANDOM % 10000))
expect 0 "" "$takt" run "$source/graph/simulator.yaml" --clock virtual --for 1s --set "service.address=127.0.0.1:$port" --output "$work/out"
expect 0 "" "$takt" run --profile replay --clock virtual --for 1s --output "$work/out"

# What the scenarios run is made from schedules and graphs that change: it must still be read.
for scenario in overload degrade saboteur record; do
  expect 0 "" env TAKT="$takt" bash "$source/bench/scenarios/$scenario.sh" inputs
done

# Made data: a pair shifted by 8 px, a wall seen by a laser, pictures of a chessboard, a cloud.
python3 - "$work" <<'PY'
import math, os, random, struct, sys
work = sys.argv[1]
random.seed(1)
w, h, shift = 160, 60, 8

def write(path, header, pixels):
    with open(path, "wb") as file:
        file.write(header.encode() + bytes(pixels))

def ppm(path, rows):  # OpenCV goes by the content, not by the name
    write(path, f"P6 {len(rows[0])} {len(rows)} 255\n", [value for row in rows for pixel in row for value in (pixel,) * 3])

wide = [[random.randrange(256) for _ in range(w + shift)] for _ in range(h)]
left, right = [row[:w] for row in wide], [row[shift:] for row in wide]
ppm(f"{work}/left.ppm", left)
ppm(f"{work}/right.ppm", right)
write(f"{work}/truth.pgm", f"P5 {w} {h} 255\n", [shift] * (w * h))

scene = f"{work}/scene"  # f 100 px, baseline 0.8 m, the wall 10 m ahead
os.mkdir(scene)
ppm(f"{scene}/image_02.png", left)
ppm(f"{scene}/image_03.png", right)
with open(f"{scene}/velodyne.bin", "wb") as file:
    for i in range(-120, 121):
        for k in range(-50, 51):
            file.write(struct.pack("4f", 10, i / 20, k / 20, 0))
with open(f"{scene}/calib_cam_to_cam.txt", "w") as file:
    file.write("R_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_02: 100 0 80 0 0 100 30 0 0 0 1 0\nP_rect_03: 100 0 80 -80 0 100 30 0 0 0 1 0\n")
with open(f"{scene}/calib_velo_to_cam.txt", "w") as file:
    file.write("R: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 0\n")

def board(path, pan, tilt, centre, camera_x):  # 9 x 6 inner corners, squares of 30 mm, seen with f 260 px
    cp, sp, ct, st = math.cos(pan), math.sin(pan), math.cos(tilt), math.sin(tilt)
    x_axis, y_axis, normal = (cp, 0, -sp), (sp * st, ct, cp * st), (sp * ct, -st, cp * ct)
    c = (centre[0] - camera_x, centre[1], centre[2])
    ahead = sum(n * v for n, v in zip(normal, c))
    rows = []
    for y in range(240):
        row = []
        for x in range(320):
            ray = ((x - 159.5) / 260, (y - 119.5) / 260, 1)
            s = ahead / sum(n * v for n, v in zip(normal, ray))
            p = [s * r - v for r, v in zip(ray, c)]
            u = sum(a * v for a, v in zip(x_axis, p)) / 0.03 + 5
            v = sum(a * v for a, v in zip(y_axis, p)) / 0.03 + 3.5
            inside = 0 < u < 10 and 0 < v < 7
            margin = -1 < u < 11 and -1 < v < 8
            shade = math.tanh(4 * math.sin(math.pi * u) * math.sin(math.pi * v)) if inside else 1
            row.append(int(128 + 100 * shade) if margin else 90)
        rows.append(row)
    ppm(path, rows)

os.mkdir(f"{work}/boards")
places = [(0, 0, 0.05, 0, 0.55), (0.4, 0, 0.05, 0, 0.5), (-0.4, 0.1, 0.05, 0.02, 0.5), (0, 0.4, 0.02, 0, 0.5),
          (0.1, -0.4, 0.08, -0.02, 0.5), (0.3, 0.3, 0.05, 0.03, 0.55), (-0.3, -0.3, 0.03, -0.03, 0.55)]
for i, (pan, tilt, *centre) in enumerate(places):
    board(f"{work}/boards/left{i}.ppm", pan, tilt, centre, 0)
    board(f"{work}/boards/right{i}.ppm", pan, tilt, centre, 0.1)

with open(f"{work}/cloud.ply", "w") as file:
    points = [(i / 50, k / 50, 1) for i in range(30) for k in range(30)] + [(9, 9, 9)]
    file.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
    file.writelines("%g %g %g\n" % p for p in points)
PY
# judge 'EXPRESSION OF r': the JSON on stdout of the last command.
judge() {
  python3 -c 'import json, sys; r = json.load(open(sys.argv[1])); sys.exit(not eval(sys.argv[2]))' "$work/stdout" "$1" ||
    fail "not as it should be: $1"
}

pair=(--left "$work/left.ppm" --right "$work/right.ppm" --gt "$work/truth.pgm")
shows "level half_range" "$takt" eval stereo "${pair[@]}" --disparities 32
shows "adaptive weight" "$takt" eval stereo "${pair[@]}" --disparities 16 --variants
answers "$takt" eval stereo "${pair[@]}" --disparities 32 --set cost=rss --json
judge 'r["bad_1px_pct"] < 5 and r["known_px"] == 160 * 60 and r["confidence_right"] > 0.9'
answers "$takt" eval stereo --scene "$work/scene" --disparities 32 --json
judge 'r["bad_1px_pct"] < 5 and r["known_px"] == 121 * 51'  # the wall is 120 by 50 px
writes "$work/noise.png" "$takt" eval stereo --sweep noise --disparities 16 --picture "$work/noise.png"
shows corners "$takt" eval ego_motion --generated --frames 3
writes "$work/head.yaml" "$takt" calibrate stereo "$work/boards" --square 0.03 --left 'left*.ppm' --right 'right*.ppm' \
  --out "$work/head.yaml" --picture "$work/head.png" --json
judge 'abs(r["calibration"]["baseline"] - 0.1) < 0.002 and r["calibration"]["epipolar_px"]["median"] < 0.3 and not r["rejected"]'
writes "$work/rig.yaml" "$takt" calibrate rig "$source/graph/rigs/xb3_raw.yaml" --out "$work/rig.yaml"
writes "$work/clean.pcd" "$takt" cloud "$work/cloud.ply" --outliers 0.1:5 --reduce 0.1 --out "$work/clean.pcd" --json
judge 'r[0]["points"] == 901 and 20 < r[0]["points_out"] < 100'

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
