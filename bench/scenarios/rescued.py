# SPDX-License-Identifier: Apache-2.0
"""What `takt log rescue` makes of a ring that a run could not close: for scenarios that kill one or cut its disk."""
import json
import subprocess


def rescued(takt, ring, record):
    """Writes the record; false, with the reason printed, if nothing of the ring can be read."""
    record.unlink(missing_ok=True)
    done = subprocess.run([takt, "log", "rescue", str(ring), "-o", str(record)], capture_output=True, text=True)
    if done.returncode != 0:
        print(f"nothing left: {done.stderr.strip().splitlines()[-1:]}", flush=True)
    return done.returncode == 0


A_SECOND = 200  # jobs of the main graph, about


def is_good(takt, record, what, ended_ns=None):
    """Prints a line; whether the record replays without a differing byte and, with the instant (CLOCK_MONOTONIC) of the end,
    lacks at most the last second before it. Without that instant it may hold less than a second, too little to compare: None."""
    replayed = subprocess.run([takt, "replay", str(record), "--compare", "--allow-damage", "--output", str(record.parent / "replayed")],
                              capture_output=True, text=True)
    compared = [line for line in replayed.stdout.splitlines() if line.endswith(" differ")]
    differ = compared[-1].split()[-2] if compared else "none compared,"
    info = json.loads(subprocess.run([takt, "log", "info", str(record), "--json"], capture_output=True, text=True).stdout)
    lines = subprocess.run([takt, "log", "echo", str(record), "base.odometry"], capture_output=True, text=True).stdout.splitlines()
    missing_s = (ended_ns - json.loads(lines[-1])["stamp_ns"]) / 1e9 if ended_ns and lines else 0
    jobs = sum(node["jobs"] for node in info["nodes"])
    if not ended_ns and not compared and jobs < A_SECOND:
        print(f"{what}: {jobs} jobs, too few to compare", flush=True)
        return None
    good = differ == "0" and missing_s <= 1 and bool(lines)
    missing = f"the last {missing_s:.2f} s are missing; " if ended_ns else ""
    print(f"{what}: {len(lines)} odometries, {jobs} jobs, {missing}{differ} differ"
          f"{'' if good else ' WRONG ' + replayed.stderr[-200:]}", flush=True)
    return good
