#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A run whose ring's disk is full, slow, much too slow or gone: ring_disk.py [SECONDS].

The main graph, SECONDS (25) each: without a ring, with one on a good disk, and on these four. It must miss no deadline that it keeps
without a ring, and the report must say what was not written. Exit 1 if one is not so, 77 without root or python3-fusepy.
"""
import contextlib
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
seconds = float((sys.argv[1:] or ["25"])[0])


@contextlib.contextmanager
def full_disk(place):
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "none", str(place)], check=True)
    try:
        yield None
    finally:
        subprocess.run(["umount", str(place)], check=True)


@contextlib.contextmanager
def slow_disk(place, kb_s, latency_s):
    """With the process that is the disk."""
    behind = place.with_name(place.name + "_behind")
    behind.mkdir()
    server = subprocess.Popen([sys.executable, str(root / "bench/scenarios/slow_disk.py"), str(behind), str(place), str(kb_s),
                               str(latency_s)])
    while not os.path.ismount(place):
        assert server.poll() is None, "slow_disk.py cannot mount"
        time.sleep(0.05)
    try:
        yield server
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)
        server.wait()


def run(name, output, ring="on", meanwhile=None):
    """The report of a run, with its exit code."""
    file = output.parent / f"{name}.json"
    running = subprocess.Popen([takt, "run", "--for", f"{seconds:.0f}s", "--ring", ring, "--output", str(output), "--report", str(file)],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if meanwhile:
        time.sleep(seconds / 2)
        meanwhile()
    code = running.wait()
    report = json.loads(file.read_text())
    disk = report.get("flight", {}).get("disk") or {"lost": None, "mb": None, "refused": None}
    misses = sum(node["deadline_misses"] for node in report["nodes"])
    late = [node["lateness_us"]["p99"] or 0 for node in report["nodes"] if node["criticality"] == "high"]
    print(f"{name}: exit {code}, {misses} misses, lateness p99 of high nodes {sum(late) / len(late):.0f} us; ring lost {disk['lost']}, "
          f"{disk['mb']} MB, refused: {disk['refused']!r}; policy {report['policy_granted']}", flush=True)
    return {"code": code, "misses": misses, "told": bool(disk["lost"] or disk["refused"])}


def main(work):
    places = {name: work / name for name in ("off", "well", "full", "slow", "slower", "gone")}
    places["ring alone"] = places["slower"] / "flight"  # there is no bound on how long maps take to be saved
    for place in places.values():
        place.mkdir()
    off = run("off", places["off"], ring="off")
    done = {"well": run("well", places["well"])}
    with full_disk(places["full"]):
        done["full"] = run("full", places["full"])
    with slow_disk(places["slow"], kb_s=2000, latency_s=0.05):
        done["slow"] = run("slow", places["slow"])
    with slow_disk(places["ring alone"], kb_s=100, latency_s=0.4):
        done["slower"] = run("slower", places["slower"])
    with slow_disk(places["gone"], kb_s=2000, latency_s=0.05) as disk:
        done["gone"] = run("gone", places["gone"], meanwhile=disk.kill)
    harmed = [name for name, one in done.items() if one["code"] != off["code"] or one["misses"] > off["misses"]]
    untold = [name for name in ("full", "slower", "gone") if not done[name]["told"]]
    print(f"harmed: {', '.join(harmed) or 'none'}; what is missing is not told: {', '.join(untold) or 'none'}")
    return 1 if harmed or untold else 0


if __name__ == "__main__":
    if os.geteuid() != 0 or importlib.util.find_spec("fusepy") is None:
        print("NOT RUN: mounting needs root, and a slow disk python3-fusepy (apt-get install python3-fusepy)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="ring_disk") as folder:
        sys.exit(main(pathlib.Path(folder)))
