#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The main graph with its ring for long: ring_ace.py [MINUTES] [MEGABYTES].

Runs MINUTES (30) with a ring of MEGABYTES (2000) on disk. Its folders must never be larger than they may, nothing may be lost, all jobs
between the first and the last one that it holds must be there, and a replay from its middle must equal it. Exit 1 if one is not so.
Of its images there are the hashes, so nodes that need them do not run there.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from ring_sizes import Sizes, jobs_in, main_graph

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
minutes, megabytes = float((sys.argv[1:] or ["30"])[0]), int((sys.argv[2:] or ["2000"])[0])
MEMORY_MB = 660


def from_the_middle(work):
    """What a replay of 20 s from the middle says of how many messages it compared, and how many differ; nothing: none was."""
    record = work / "all.mcap"
    subprocess.run([takt, "log", "rescue", str(work / "out/flight/ring"), "-o", str(record)], check=True, capture_output=True)
    at_s = minutes * 60 * 0.6
    again = subprocess.run([takt, "replay", str(record), "--from", f"{at_s}", "--until", f"{at_s + 20}", "--compare",
                            "--output", str(work / "again")], capture_output=True, text=True).stdout
    return next((line for line in again.splitlines() if line.endswith(" differ") and line.startswith("compared")), "")


def main(work):
    sizes = Sizes(work / "out/flight/ring", {"disk": megabytes, "memory": MEMORY_MB})
    with main_graph(f"disk: {megabytes}MB, memory: {MEMORY_MB}MB") as graph:
        done = subprocess.run([takt, "run", str(graph), "--for", f"{minutes * 60:.0f}s", "--output", str(work / "out"),
                               "--report", str(work / "report.json")], capture_output=True, text=True)
        within = sizes.kept_within()
        report = json.loads((work / "report.json").read_text())
        rings = {place: report["flight"][place] for place in ("disk", "memory")}
        lost = sum(ring["lost"] for ring in rings.values())
        misses = sum(node["deadline_misses"] for node in report["nodes"])
        print(f"run exit {done.returncode}, policy {report['policy_granted']}, {misses} misses, {len(report['flight']['frozen'])} frozen; "
              + ", ".join(f"{place}: lost {ring['lost']}, refused {ring['refused']!r}" for place, ring in rings.items()))
        jobs, missing = jobs_in(work / "out/flight/ring")
        replayed = from_the_middle(work)
        print(f"{jobs} jobs are in the ring, {missing} missing; from its middle: {replayed or 'nothing compared'}")
        return 0 if within and lost == 0 and missing == 0 and jobs > 0 and replayed.endswith(" 0 differ") else 1


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="ring_ace") as folder:
        sys.exit(main(pathlib.Path(folder)))
