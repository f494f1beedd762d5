#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a ring's disk holds when the power goes: ring_cut.py [TIMES] [SEED].

The ring of a run lies in an ext4 disk image. TIMES (50) times, at random instants, the image is copied at one instant while the
run writes on (a reflink on XFS: what the disk was given until then, and no more). Each copy is mounted, as after a power cut,
so that the file system repairs itself. What takt log rescue makes of it must lack at most the last second and replay without a
wrong byte. Exit 1 if one does not, 77 without root or xfsprogs.
"""
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from rescued import is_good, rescued
from ring_sizes import main_graph

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
times, seed = int((sys.argv[1:] or ["50"])[0]), int((sys.argv[2:] or ["1"])[0])
chance = random.Random(seed)
HOST_MB, DISK_MB, RING_MB = 12000, 600, 400


def do(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def mounted(image, at):
    at.mkdir(exist_ok=True)
    do("mount", "-o", "loop", image, at)
    return at


def unmounted(place):
    """Waits for that: the loop device of an image within it goes a little later."""
    for _ in range(100):
        if not os.path.ismount(place) or subprocess.run(["umount", str(place)], stderr=subprocess.DEVNULL).returncode == 0: return
        time.sleep(0.1)


def make_disk(work):
    """An ext4 image on an XFS that lies in a file itself; where both are mounted."""
    host = work / "host.img"
    do("truncate", "-s", f"{HOST_MB}M", host)
    do("mkfs.xfs", "-q", "-m", "reflink=1", host)
    mounted(host, work / "host")
    image = work / "host/disk.img"
    do("truncate", "-s", f"{DISK_MB}M", image)
    do("mkfs.ext4", "-q", image)
    return image, mounted(image, work / "disk")


def cut_while_running(graph, image, disk, work):
    """Copies of the image, each with the instant just before it was made."""
    cuts = []
    with open(work / "log", "w") as log:
        run = subprocess.Popen([takt, "run", str(graph), "--for", "0s", "--ring", "on", "--output", str(disk / "out")], stdout=log, stderr=log)
        while not list(disk.glob("out/flight/ring/*.mcap")):
            if run.poll() is not None:
                sys.exit(f"the run did not start:\n{(work / 'log').read_text()[-2000:]}")
            time.sleep(0.05)
        time.sleep(3)
        for number in range(times):
            time.sleep(chance.uniform(0.5, 2.5))
            copy = image.parent / f"cut_{number}.img"
            at_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
            do("cp", "--reflink=always", image, copy)
            cuts.append((copy, at_ns))
        run.send_signal(signal.SIGINT)
        print(f"the run ended with {run.wait()}", flush=True)
    return cuts


def main():
    if os.geteuid() != 0 or not shutil.which("mkfs.xfs"):
        print("NOT RUN: needs root (it mounts disk images) and xfsprogs")
        return 77
    work = pathlib.Path(tempfile.mkdtemp(prefix="ring_cut"))
    bad = 0
    try:
        image, disk = make_disk(work)
        with main_graph(f"disk: {RING_MB}MB, memory: 64MB, before: 1s, after: 0s, frozen: 50MB") as graph:
            for number, (copy, at_ns) in enumerate(cut_while_running(graph, image, disk, work), 1):
                after = mounted(copy, work / "after")
                record = work / "rescued.mcap"
                good = rescued(takt, after / "out/flight/ring", record) and is_good(takt, record, f"cut {number}", at_ns)
                bad += not good
                unmounted(after)
                copy.unlink()
    finally:
        for place in ("after", "disk", "host"):
            unmounted(work / place)
        shutil.rmtree(work)
    print(f"{times - bad} of {times} readable, no wrong byte")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
