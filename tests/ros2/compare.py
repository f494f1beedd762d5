#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What takt-fastdds-reader decoded (FOLDER/heard) against what takt echo says of the same outputs (FOLDER/NODE.PORT)."""
import json
import math
import pathlib
import sys

folder = pathlib.Path(sys.argv[1])
heard, writers = {}, {}
for line in map(json.loads, (folder / "heard").open()):
    if "writer" in line:
        writers[line["writer"]] = line
    else:
        assert "problem" not in line["message"], line
        heard.setdefault(line["topic"], []).append(line)


def echoed(port):
    return [(line["stamp_ns"], line["message"]) for line in map(json.loads, (folder / port).open())]


def messages(topic, least):
    found = [line["message"] for line in heard.get(topic, [])]
    assert len(found) >= least, f"{topic}: {len(found)} messages, not {least}"
    return found


def near(a, b):
    return math.isclose(float(a), float(b), rel_tol=1e-6, abs_tol=1e-6)


def same_as(port, topic, is_same):
    """Each that has a like in takt echo; all stamps are off by the same, the wall clock against the run's."""
    known, heard_of = echoed(port), messages(topic, 30)
    offsets = [m["header"]["stamp_ns"] - stamp for m in heard_of for stamp, told in known if is_same(m, told)]
    assert len(offsets) >= 15, f"{len(offsets)} of {len(heard_of)} on {topic} are among the {len(known)} of takt echo"
    assert offsets.count(max(set(offsets), key=offsets.count)) >= len(offsets) - 2, set(offsets)
    return heard_of


def same_scan(scan, told):
    ranges = told["range_m"]["first"]
    return len(ranges) == len(scan["ranges"]) and all(near(0 if a == "inf" else a, b) for a, b in zip(scan["ranges"], ranges))


def same_place(odometry, told):
    x, y, *_, w = odometry["pose"]
    return near(x, told["x_m"]) and near(y, told["y_m"]) and near(w, math.cos(told["theta_rad"] / 2))


for scan in same_as("front_laser.scan", "rt/takt/front_laser/scan", same_scan):
    assert scan["header"]["frame"] == "front_laser", scan["header"]
for odometry in same_as("base.odometry", "rt/takt/base/odometry", same_place):
    assert odometry["header"]["frame"] == "odom" and odometry["child"] == "base_link", odometry["header"]

for image in messages("rt/takt/head_camera/pair/left/image_raw/compressed", 30):
    assert image["format"] == "jpeg" and image["data"]["size"] > 1000 and image["data"]["some"][0] == 0xFF, image
for grid in messages("rt/takt/mapping_3d/obstacles", 3):
    assert len(grid["cells"]) == grid["width"] * grid["height"] > 0 and set(grid["cells"]) <= set(range(-1, 101)), grid["width"]
transforms = {(t["header"]["frame"], t["child"]) for m in messages("rt/tf", 30) for t in m["transforms"]}
assert ("odom", "base_link") in transforms and ("robot", "front_laser") in transforms, transforms
assert [t["child"] for t in messages("rt/tf_static", 1)[0]["transforms"]] == ["robot"]
status = {s["name"]: s for s in messages("rt/diagnostics", 3)[-1]["status"]}
assert "takt: obstacle_stop" in status and status["takt: device front_laser"]["level"] == 0, list(status)

nodes = messages("ros_discovery_info", 1)[-1]["nodes"]
assert [(node["namespace"], node["name"]) for node in nodes] == [("/", "takt")], nodes
for topic, writer in writers.items():
    if topic.startswith("rt/"):
        assert writer["guid"] in nodes[0]["writers"], topic
        assert writer["user_data"].startswith("typehash=RIHS01_") and len(writer["user_data"]) == len("typehash=RIHS01_;") + 64, writer
print(f"{sum(map(len, heard.values()))} messages of {len(heard)} topics, {len(writers)} writers")
