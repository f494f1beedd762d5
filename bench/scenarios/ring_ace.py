#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The main graph with its ring for long: ring_ace.py [MINUTES] [MEGABYTES].

Runs MINUTES (30) with a ring of MEGABYTES (2000) on disk. Its folders must never be larger than they may, nothing may be lost, and all
jobs between the first and the last one that it holds must be there. Exit 1 if one is not so.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from ring_sizes import Sizes, jobs_in

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
minutes, megabytes = float((sys.argv[1:] or ["30"])[0]), int((sys.argv[2:] or ["2000"])[0])
MEMORY_MB = 660


def main(work):
    graph = root / "graph" / f".ring_ace_{os.getpid()}.yaml"
    rule = f"record: {{disk: {megabytes}MB, memory: {MEMORY_MB}MB}}"
    graph.write_text("\n".join(rule if line.startswith("record:") else line for line in (root / "graph/ace.yaml").read_text().split("\n")))
    sizes = Sizes(work / "out/flight/ring", {"disk": megabytes, "memory": MEMORY_MB})
    try:
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
        print(f"{jobs} jobs are in the ring, {missing} missing")
        return 0 if within and lost == 0 and missing == 0 and jobs > 0 else 1
    finally:
        graph.unlink()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="ring_ace") as folder:
        sys.exit(main(pathlib.Path(folder)))
