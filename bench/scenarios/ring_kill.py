#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a killed run leaves in its ring: ring_kill.py [TIMES] [SEED].

Each time (50) all processes of a run get SIGKILL at a random instant of its first eight seconds, by turns in one process and in
several. What takt log rescue makes of the ring must lack at most the last second and replay without a wrong byte. Then its
newest file is cut at a random place, as a disk may leave it, and must again. Exit 1 if one does not.
"""
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

from processes import family
from rescued import is_good, rescued

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
times, seed = int((sys.argv[1:] or ["50"])[0]), int((sys.argv[2:] or ["1"])[0])
chance = random.Random(seed)
HEAD = 40_000  # bytes in front of the first chunk, about


def killed_run(out, isolate, after_s):
    """The instant at which it was killed, that long after its ring began."""
    run = subprocess.Popen([takt, "run", "--isolate", isolate, "--ring", "on", "--output", str(out)],
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not list((out / "flight/ring").glob("*.mcap")):
        if run.poll() is not None:
            sys.exit(f"the run did not start: exit {run.returncode}")
        time.sleep(0.05)
    time.sleep(after_s)
    members = family(run.pid)
    at_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
    for pid in members:
        os.kill(pid, signal.SIGKILL)
    run.wait()
    return at_ns


def cut_newest(ring):
    """Its new length."""
    newest = max(ring.glob("*.mcap"), key=lambda file: file.stat().st_mtime)
    os.truncate(newest, chance.randrange(newest.stat().st_size))
    return newest.stat().st_size


def main():
    bad = short = 0
    for number in range(1, times + 1):
        with tempfile.TemporaryDirectory(prefix="ring_kill") as folder:
            work = pathlib.Path(folder)
            ring, record = work / "out/flight/ring", work / "rescued.mcap"
            isolate, after_s = ("subsystem", "none")[number % 2], chance.uniform(1.5, 8)
            at_ns = killed_run(work / "out", isolate, after_s)
            what = f"{number}: {isolate}, killed {after_s:.2f} s after the ring began"
            if not rescued(takt, ring, record) or not is_good(takt, record, what, at_ns):
                bad += 1
                continue
            length = cut_newest(ring)
            # Cut near its head, the only file of a short run holds little or nothing.
            if rescued(takt, ring, record):
                good = is_good(takt, record, f"{number}, cut to {length} bytes")
                bad += good is False
                short += good is None
            else:
                bad += length > HEAD
                short += 1
    print(f"{times - bad} of {times} readable, no wrong byte; {short} of the cut ones too short to compare")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
