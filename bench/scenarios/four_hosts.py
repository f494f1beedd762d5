#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ACE on four hosts: four_hosts.py [SECONDS] [takt run options...].

graph/ace_four_hosts.yaml in four network namespaces on one bridge, for SECONDS (60), each host with a record. A third of the way in
`mind` is killed with all its processes, and started again three seconds later. Told are, by host, rates kept, misses, ages above
their bounds, what came of each output of others, modes, and whether its record replays. Exit 1 if a node of high criticality missed
a deadline, a message was lost beside those of the killed host, an age is above its bound or proof, or a replay differs; 77 without
root or ip.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from spaces import Spaces

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
seconds, options = float((sys.argv[1:] or ["60"])[0]), sys.argv[2:]
HOSTS = {name: f"10.94.0.{n}" for n, name in enumerate(("robot", "vision", "detection", "mind"), 1)}
LEAVES, AWAY_S = "mind", 3
GRAPH = root / "graph/ace_four_hosts.yaml"


def begin(spaces, work, host, turn):
    name = f"{host}{turn}"
    return spaces.begin(host, takt, "run", GRAPH, "--machine", host, "--for", f"{seconds}s", "--output", work / name, "--ring", "off", "--report",
                        work / f"{name}.json", "--record", work / f"{name}.mcap", *options, stdout=subprocess.DEVNULL,
                        stderr=open(work / f"{name}.err", "w"), start_new_session=True)


def bridge(spaces):
    spaces.ip("bridge", "link", "add", "bridge", "type", "bridge")
    spaces.ip("bridge", "link", "set", "bridge", "up")
    for host in HOSTS:
        spaces.ip("bridge", "link", "set", host, "master", "bridge")


def run(spaces, work):
    runs = {host: begin(spaces, work, host, 1) for host in HOSTS}
    time.sleep(seconds / 3)
    os.killpg(runs[LEAVES].pid, signal.SIGKILL)
    time.sleep(AWAY_S)
    runs[f"{LEAVES} again"] = begin(spaces, work, LEAVES, 2)
    time.sleep(seconds * 2 / 3 - AWAY_S)
    for run in runs.values():
        if run.poll() is None:
            run.send_signal(signal.SIGINT)
    for run in runs.values():
        run.wait()


def judge(report, name):
    """What is wrong with a host, after its lines."""
    wrong = []
    nodes = [node for node in report["nodes"] if not node["device"]]
    misses = {node["name"]: node["deadline_misses"] for node in report["nodes"] if node["deadline_misses"]}
    high = [node["name"] for node in report["nodes"] if node["criticality"] == "high" and node["deadline_misses"]]
    done, due = sum(node["completed"] for node in nodes), sum(node["released"] for node in nodes)
    print(f"{name}: policy {report['policy_granted']}, {report['duration_s']:.0f} s, {done} of {due} jobs, misses {misses or 'none'}, "
          f"CPU {report['cpu']['utilisation']:.2f} cores; modes {' '.join(mode['name'] for mode in report['modes'])}")
    for fault in report["faults"]:
        if "process" in fault["what"]:
            wrong.append(f"{name}: {fault['what']}")
    if high:
        wrong.append(f"{name}: late of high criticality: {high}")
    for chain in report["chains"]:
        if chain["age_ms"]["max"] is not None:
            print(f"  chain {chain['name']}: at most {chain['age_ms']['max']:.0f} ms, proven {chain['proven_ms']}, bound {chain['bound_ms']:.0f}")
    wrong += [f"{name}: chain {chain['name']} is above its bound" for chain in report["chains"] if chain["within"] is False]
    wrong += [f"{name}: {row['what']} above its proof" for row in report["proofs"].get("above_proof", []) if row.get("cause") == "unexplained"]
    for machine in report.get("machines", []):
        for output in machine["outputs"]:
            ms = output["latency_ms"]
            counts = {key: value for key, value in output.items() if key not in ("port", "received", "latency_ms") and value}
            print(f"  {output['port']} from {machine['name']}: {output['received']} within {ms['p50']:.1f}, {ms['p99']:.1f}, {ms['max']:.1f} ms {counts or ''}")
            if output["missing"] and machine["name"] != LEAVES:
                wrong.append(f"{name}: {output['missing']} messages of {output['port']} missing")
    return wrong


def replays(work, name):
    again = subprocess.run([takt, "replay", work / f"{name}.mcap", "--compare", "--output", work / f"{name}_again"], capture_output=True, text=True)
    line = next((line for line in again.stdout.splitlines() if "differ" in line), again.stderr.strip()[-300:])
    print(f"  its record: {line}")
    return [] if again.returncode == 0 and re.search(r"\b0 differ", line) else [f"{name}: its record does not replay"]


def main(work):
    with Spaces(HOSTS, middle="bridge") as spaces:
        bridge(spaces)
        run(spaces, work)
    wrong = []
    for name in (*(f"{host}1" for host in HOSTS if host != LEAVES), f"{LEAVES}2"):
        file = work / f"{name}.json"
        if not file.exists():
            wrong.append(f"{name}: no report: {(work / f'{name}.err').read_text()[-800:]}")
            continue
        wrong += judge(json.loads(file.read_text()), name.rstrip("12")) + replays(work, name)
    for what in wrong:
        print("FAILED:", what)
    return bool(wrong)


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("ip"):
        print("NOT RUN: needs root and ip (iproute2)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="hosts") as folder:
        sys.exit(main(pathlib.Path(folder)))
