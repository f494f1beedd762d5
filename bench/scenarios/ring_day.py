#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A long day in a small ring: ring_day.py [HOURS] [MEGABYTES].

As many loads as the main graph has nodes, at their rates, each with a message of 1 kB a job, run for HOURS (24) of
virtual time with a ring of MEGABYTES (2000) on disk. The ring's folder must never be larger, nothing may be lost that is
not counted, and all jobs between the first and the last one that it holds must be there. Exit 1 if one is not so.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from ring_sizes import Sizes, jobs_in

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
hours, megabytes = float((sys.argv[1:] or ["24"])[0]), int((sys.argv[2:] or ["2000"])[0])


def write_graph(folder):
    checked = json.loads(subprocess.run([takt, "check", str(root / "graph/ace.yaml"), "--json"], capture_output=True,
                                        text=True).stdout)
    nodes = [node for node in checked["nodes"] if node["rate_hz"]]
    loads = "".join(f"    {node['name']}: {{type: load, params: {{message_size: 1000, flood: true}}}}\n" for node in nodes)
    rows = "".join(f"  {node['name']}: {{rate: {node['rate_hz']:g}, budget: 0.2ms}}\n" for node in nodes)
    (folder / "day.yaml").write_text(f"takt: 1\nname: day\nschedule: day_schedule.yaml\n"
                                     f"record: {{disk: {megabytes}MB, keep: 100h}}\nsubsystems:\n  all:\n{loads}")
    (folder / "day_schedule.yaml").write_text(f"takt: 1\nname: day\npolicy: deadline\ncores: [0, 1]\nnodes:\n{rows}")
    return nodes


def main(work):
    nodes = write_graph(work)
    ring = work / "out/flight/ring"
    sizes = Sizes(ring, {"disk": megabytes})
    began = time.monotonic()
    run = subprocess.run([takt, "run", str(work / "day.yaml"), "--clock", "virtual", "--ring", "on", "--for", f"{hours * 3600:.0f}s",
                          "--isolate", "none", "--output", str(work / "out"), "--report", str(work / "report.json")],
                         capture_output=True, text=True)
    took = time.monotonic() - began
    good = sizes.kept_within()
    if not (work / "report.json").exists():
        print(run.stdout[-2000:], run.stderr[-2000:])
        return 1
    report = json.loads((work / "report.json").read_text())
    disk = report["flight"]["disk"]
    jobs = {node["name"]: node["completed"] for node in report["nodes"]}
    print(f"{hours:g} h in {took:.0f} s; {len(nodes)} loads, {sum(jobs.values())} jobs; {json.dumps(disk)}")
    kept, missing = jobs_in(ring)
    print(f"{kept} jobs are in the ring, {missing} missing; lost and counted: {disk['lost']}")
    return 0 if good and disk["lost"] == 0 and missing == 0 and kept > 0 else 1


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="ring_day") as folder:
        sys.exit(main(pathlib.Path(folder)))
