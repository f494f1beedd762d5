#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Replays that begin anywhere: rewind.py [INSTANTS] [SEED] [MINUTES] [GRAPH].

Records MINUTES (60) of GRAPH (lasers) in virtual time, with a parameter set at a random instant. At INSTANTS (20) random
instants a replay begins and must equal the record; prints how long its first job takes. Then 20 faults are planted, a
parameter each that is set at a random instant, and takt bisect must name the job that took it up.
"""
import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
instants, seed, minutes = (int(a) for a in (sys.argv[1:4] + ["20", "1", "60"][len(sys.argv) - 1:]))
graph = (sys.argv[4:] or ["graph/lasers.yaml"])[0]
chance = random.Random(seed)


def run(*arguments):
    return subprocess.run([takt, *arguments], capture_output=True, text=True, cwd=root)


def plant(work, out):
    """A laser that falls silent for good: takt bisect must find the first job that asks for the stop."""
    at, length = chance.uniform(5, 110), 120
    scenario, record = work / "silent.yaml", str(work / "planted.mcap")
    scenario.write_text(f"takt: 1\nname: planted\nfaults:\n  - {{kind: silent, target: front_laser, from: {at:.3f}s, to: 1000s}}\n"
                        "expect: {}\n")
    made = run("run", "graph/lasers.yaml", "--clock", "virtual", "--for", f"{length}s", "--record", record, "--output", out,
               "--faults", str(scenario))
    found = run("bisect", record, "port: obstacle_stop.stop, field: reasons, at_most: 0", "--json")
    wanted = None
    for line in run("log", "echo", record, "obstacle_stop.stop").stdout.splitlines():
        message = json.loads(line)
        if message["message"]["reasons"] == 0:
            wanted = None  # it has not broken for good: the first jobs have no scan yet
        elif wanted is None:
            wanted = message
    told = json.loads(found.stdout) if found.returncode == 0 else {}
    first = told.get("first") or {}
    good = bool(first) and wanted is not None and first["job"] + 1 == wanted["sequence"]  # each job sends one
    print(f"silent from {at:.2f} s: {first.get('node')} job {first.get('job')}, {first.get('released_s')} s, in {told.get('replays')} "
          f"replays of {told.get('replayed_s', 0):.1f} s in all{'' if good else ' WRONG ' + str(wanted)[:200] + found.stderr[-200:] + made.stderr[-200:]}", flush=True)
    return good


def main(work):
    record, out = str(work / "run.mcap"), str(work / "out")
    made = run("run", graph, "--clock", "virtual", "--for", f"{minutes * 60}s", "--record", record, "--output", out)
    print(f"{graph}: {minutes} minutes, {os.path.getsize(record) / 1e6:.0f} MB, run exit {made.returncode}", flush=True)
    bad, times = 0, []
    for _ in range(instants):
        at = chance.uniform(0.05, 0.95) * minutes * 60
        began = time.monotonic()
        first = run("replay", record, "--from", f"{at}", "--until", f"{at + 0.2}", "--output", out)
        times.append(time.monotonic() - began)
        again = run("replay", record, "--from", f"{at}", "--until", f"{at + 10}", "--compare", "--output", out)
        good = again.returncode == 0 and first.returncode == 0
        bad += not good
        print(f"from {at:.1f} s: first jobs after {times[-1]:.2f} s; {again.stdout.splitlines()[-1] if again.stdout else again.stderr[-200:]}"
              f"{'' if good else ' WRONG'}", flush=True)
    times.sort()
    print(f"first jobs: median {times[len(times) // 2]:.2f} s, longest {times[-1]:.2f} s", flush=True)
    print(f"{instants - bad} of {instants} equal", flush=True)
    found = sum(plant(work, out) for _ in range(20))
    print(f"bisect found {found} of 20")
    return 1 if bad or found < 20 else 0


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="rewind") as folder:
        sys.exit(main(pathlib.Path(folder)))
