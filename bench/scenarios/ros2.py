#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What takt ros2 costs, and what another vendor's DDS hears of it: ros2.py [SECONDS].

Two network namespaces with a cable between them. In one the main graph and takt ros2, in the other a reader by Fast DDS as it is
by default (takt-fastdds-reader of tests/ros2), of one camera as JPEG, 15 times a second, for SECONDS (600). Then the reader is
killed ten times and started again. Exit 1 if a picture is lost after the first one, above 5 ms at p99, above 2 % of a core, or if a
new reader has its first picture later than 3 s; 77 without root, ip, or the reader (libfastrtps-dev).
"""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from spaces import Spaces

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "build/release/graph/command/takt"))
reader = pathlib.Path(takt).parents[2] / "tests/ros2/takt-fastdds-reader"
seconds = int((sys.argv[1:] or ["600"])[0])
MACHINES = {"one": "10.94.1.1", "two": "10.94.1.2"}
DOMAIN = 57
TOPIC = "rt/takt/head_camera/pair/left/image_raw/compressed=sensor_msgs::msg::dds_::CompressedImage_:q"
TICKS = os.sysconf("SC_CLK_TCK")


def listen(spaces, for_s):
    return spaces.begin("two", reader, DOMAIN, for_s, TOPIC, stdout=subprocess.PIPE)


def samples(lines):
    return [line for line in map(json.loads, lines) if "topic" in line]


def cpu_s(process):
    words = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) / TICKS


def resident_mb(process):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) / 1000


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def pictures(spaces, publisher):
    used, memory, from_s = cpu_s(publisher), resident_mb(publisher), time.monotonic()
    heard = samples(listen(spaces, seconds).communicate()[0].splitlines())
    share = 100 * (cpu_s(publisher) - used) / (time.monotonic() - from_s)
    if not heard:
        print("nothing was heard")
        return False
    late = [(line["received_ns"] - line["source_ns"]) / 1e6 for line in heard]
    numbers = [line["sequence"] for line in heard]
    lost = numbers[-1] - numbers[0] + 1 - len(set(numbers))
    p99 = quantile(late, 0.99)
    print(f"{len(heard)} pictures in {seconds} s, {lost} lost after the first; {quantile(late, 0.5):.2f} (p50), {p99:.2f} (p99), "
          f"{max(late):.2f} ms at most; takt-ros2 {share:.2f} % of a core, {memory:.1f} to {resident_mb(publisher):.1f} MB resident")
    return lost == 0 and p99 <= 5 and share <= 2 and len(heard) > 14 * (seconds - 5)


def kills(spaces, times):
    longest = 0
    for _ in range(times):
        from_s = time.monotonic()
        process = listen(spaces, 30)
        for line in process.stdout:
            if '"topic"' in line:
                break
        longest = max(longest, time.monotonic() - from_s)
        process.send_signal(signal.SIGKILL)
        process.communicate()
    print(f"{times} readers killed: the next one had its first picture {longest:.2f} s after its start, at most")
    return longest <= 3


def main(spaces, work):
    run = publisher = None
    try:
        run = subprocess.Popen([takt, "run", "--for", "0s", "--ring", "off", "--output", work / "run"], stdout=subprocess.DEVNULL)
        publisher = spaces.begin("one", takt, "ros2", "--address", MACHINES["one"], "--domain", DOMAIN, "--run", run.pid,
                                 stdout=subprocess.DEVNULL)
        time.sleep(8)
        idle = cpu_s(publisher)
        time.sleep(10)
        print(f"nobody reads: takt-ros2 {10 * (cpu_s(publisher) - idle):.2f} % of a core")
        good = pictures(spaces, publisher)
        return 0 if kills(spaces, 10) and good else 1
    finally:
        for process in (publisher, run):
            if process:
                process.send_signal(signal.SIGINT)
                process.wait()


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("ip") or not reader.exists():
        print("NOT RUN: needs root, ip (iproute2) and takt-fastdds-reader (libfastrtps-dev)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="ros2") as folder, Spaces(MACHINES) as cable:
        sys.exit(main(cable, pathlib.Path(folder)))
