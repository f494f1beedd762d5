# SPDX-License-Identifier: Apache-2.0
# takt ros2: two network namespaces; in one a run and takt ros2, in the other a reader by another vendor's DDS (Fast DDS, as it
# is by default). What that decodes is compared with takt echo. As root; without the right to make namespaces it says so.
source "$(dirname "$0")/lib.sh" "$@"
build=$(dirname "$takt")/../..
[ -x "${takt%/*}/takt-ros2" ] || not_run "takt-ros2 is not built, since cyclonedds-dev or libssl-dev is missing"

echo "=== what it refuses"
expect 2 "not a number from 0 to 232" env ROS_DOMAIN_ID=x "$takt" ros2
expect 2 "is none of ROS 2" "$takt" ros2 --namespace robot
expect 3 "is that address one of this machine?" "$takt" ros2 --address 10.94.0.77
expect 1 "no run is there" "$takt" ros2 --list

reader=$build/tests/ros2/takt-fastdds-reader
[ -x "$reader" ] || not_run "no reader of another vendor: libfastrtps-dev was missing when this was built"
two_machines 10.94.0 'kill $run $ros2 2>/dev/null; rm -f "$heard"'
domain=$((60 + $$ % 40))
publish() { # publish OPTIONS...: takt ros2 in the background, its process in $ros2
  beside ros2 ip netns exec $one "$takt" ros2 --address 10.94.0.1 --domain $domain "$@"
  ros2=$!
  said "follows ace" "$work/ros2.err"
}
listen() { ip netns exec $two "$reader" $domain "$@"; }
echoes() { # echoes PORT FILE: what the run has of it, whole arrays
  python3 - "$1" "$XDG_RUNTIME_DIR/takt/$run.sock" >"$2" <<'PY'
import json, socket, sys
with socket.socket(socket.AF_UNIX) as connection:
    connection.connect(sys.argv[2])
    lines = connection.makefile("rwb")
    lines.write(json.dumps({"do": "echo", "port": sys.argv[1], "items": 400000, "count": 60}).encode() + b"\n")
    lines.flush()
    for _ in range(60): print(lines.readline().decode(), end="")
PY
}

echo "=== what is there"
start_run main --isolate subsystem --for 0s
expect 0 "" "$takt" ros2 --list --run $run
prints "/takt/head_camera/pair/left/image_raw/compressed  sensor_msgs/msg/CompressedImage  best effort, volatile, keep last 1"
prints "/takt/front_laser/scan  sensor_msgs/msg/LaserScan"
prints "/takt/base/odometry  nav_msgs/msg/Odometry  reliable, volatile, keep last 10"
prints "/tf_static  tf2_msgs/msg/TFMessage  reliable, transient local, keep last 1"
expect 2 'did you mean `front_laser.scan`' "$takt" ros2 --list --run $run --port front_laser.scam

echo "=== nobody reads: nothing is asked of the run"
publish --pictures both
kill -INT $ros2; wait $ros2
grep -q "^written: 1," "$work/ros2.out" || fail "something was published without a reader: $(cat "$work/ros2.out")"  # /tf_static

echo "=== Fast DDS in the other namespace"
publish --pictures both
for output in front_laser.scan base.odometry; do echoes $output "$work/$output" & echoing="$echoing $!"; done
types=sensor_msgs::msg::dds_
listen 6 "rt/takt/front_laser/scan=$types::LaserScan_" "rt/takt/base/odometry=nav_msgs::msg::dds_::Odometry_:r" \
  "rt/takt/head_camera/pair/left/image_raw/compressed=$types::CompressedImage_" \
  "rt/takt/mapping_3d/obstacles=nav_msgs::msg::dds_::OccupancyGrid_:t" "rt/tf=tf2_msgs::msg::dds_::TFMessage_:r" \
  "rt/tf_static=tf2_msgs::msg::dds_::TFMessage_:t" "rt/diagnostics=diagnostic_msgs::msg::dds_::DiagnosticArray_:r" \
  "ros_discovery_info=rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_:t" >"$work/heard" || fail "the reader"
wait $echoing
python3 "$source/tests/ros2/compare.py" "$work" || fail "what Fast DDS decodes"
listen 4 "rt/takt/head_camera/pair/left/image_raw=$types::Image_" >"$work/heard_raw"
python3 - "$work/heard_raw" <<'PY' || fail "the raw picture"
import json, sys
images = [line["message"] for line in map(json.loads, open(sys.argv[1])) if line.get("topic", "").endswith("image_raw")]
assert images, "none came"  # how many do depends on the reader's receive buffer
for image in images:
    assert image["data"]["size"] == image["height"] * image["step"] and image["encoding"] in ("mono8", "bgr8"), image
PY

echo "=== takt ros2 is killed, and comes back; the run does not notice"
kill -KILL $ros2
wait $ros2 2>/dev/null
publish
listen 5 "rt/takt/front_laser/scan=$types::LaserScan_:q" >"$work/heard_again"
[ "$(grep -c '"topic"' "$work/heard_again")" -ge 20 ] || fail "after a kill: $(wc -l <"$work/heard_again") lines"
end_run 0 1
said "the run has ended" "$work/ros2.err"
start_run again --for 0s
said "follows ace" "$work/ros2.err" 2
kill -INT $ros2; wait $ros2
end_run 0 1

echo "=== driver ros2: the scans of one run in another, over loopback"
heard=$source/graph/.ros2_$$.yaml
sed 's#^  sim: .*#  sim: {default: {driver: sim, world: worlds/lab.xml}, front_laser: {driver: ros2, domain: '$domain', topic: /takt/front_laser/scan, beams: 181, fov: 180deg, range: 8m, latency: 100ms}}#' \
  "$source/graph/lasers.yaml" >"$heard"
start_run makes "$source/graph/lasers.yaml" --for 0s
beside ros2 ip netns exec $one "$takt" ros2 --domain $domain --run $run
ros2=$!
said "follows lasers" "$work/ros2.err"
expect 0 "" ip netns exec $one "$takt" run "$heard" --policy cooperative --for 8s --ring off --output "$work/hears" --report "$work/hears.json"
python3 - "$work/hears.json" <<'PY' || fail "what driver ros2 heard"
import json, sys
report = json.load(open(sys.argv[1]))
device = next(d for d in report["devices"] if d["name"] == "front_laser")
assert device["state"] == "ok" and device["received"] >= 60 and device["damaged"] == 0, device
stop = next(n for n in report["nodes"] if n["name"] == "obstacle_stop")
assert stop["completed"] > 60, stop
PY
kill -INT $ros2; wait $ros2
end_run 0 1
finish
