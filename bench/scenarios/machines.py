#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What lies between two machines: machines.py [SECONDS] [BYTES].

Two network namespaces with a cable between them. A load on the one publishes a message of BYTES (72000) 15 times a second, one on the
other reads it, for SECONDS (60); then ddsperf of Cyclone DDS sends as many as large there and back, and half of that is told. Exit 1
if a message is lost, or above 2 ms at p99; 77 without root, ip, or ddsperf (cyclonedds-tools).
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from spaces import Spaces

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
seconds, size = int((sys.argv[1:] or ["60"])[0]), int((sys.argv[2:] or ["72000"])[0])
MACHINES = {"one": "10.93.1.1", "two": "10.93.1.2"}


def write_graph(folder):
    (folder / "pair.yaml").write_text(f"""takt: 1
name: pair
schedule: pair_schedule.yaml
machines:
  one: {{address: {MACHINES['one']}, runs: [makes], ages: {{maker.output: 70ms}}}}
  two: {{address: {MACHINES['two']}, runs: [reads]}}
network: {{latency: 20ms, clock_error: 5ms, domain: 94}}
subsystems:
  makes: {{exports: [maker.output], maker: {{type: load, params: {{work: 0.2ms, message_size: {size}, flood: true}}}}}}
  reads: {{reader: {{type: load, in: {{input: maker.output}}, params: {{work: 0.2ms}}}}}}
""")
    (folder / "pair_schedule.yaml").write_text("""takt: 1
name: pair
policy: deadline
nodes: {maker: {rate: 15, budget: 2ms}, reader: {rate: 15, budget: 2ms}}
""")


def begin(spaces, machine, *words, **how):
    return spaces.begin(machine, *words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **how)


def over_takt(spaces, work):
    write_graph(work)
    one, two = (begin(spaces, machine, takt, "run", work / "pair.yaml", "--machine", machine, "--for", f"{seconds + extra}s", "--ring", "off",
                      "--output", work / machine) for machine, extra in (("one", 2), ("two", 0)))
    said = two.communicate()[0]
    one.communicate()
    print(next((line for line in said.splitlines() if "received within" in line), said[-1500:]))
    found = re.search(r"(\d+) received within ([\d.]+) \(p50\), ([\d.]+) \(p99\), ([\d.]+) ms(.*)", said)
    if not found:
        return None
    return float(found[2]), float(found[3]), "missing" in found[5]


def over_cyclone(spaces):
    """Half of the way there and back, which is what it prints: p50 and p99 in ms, medians over its seconds."""
    pong = begin(spaces, "two", "ddsperf", "-D", seconds + 4, "pong", env={**os.environ, "CYCLONEDDS_URI": address("two")})
    ping = begin(spaces, "one", "ddsperf", "-D", seconds, "ping", "15Hz", "size", size, env={**os.environ, "CYCLONEDDS_URI": address("one")})
    said = ping.communicate()[0]
    pong.kill()
    rows = re.findall(r"mean ([\d.]+)us .*? 50% ([\d.]+)us .*? 99% ([\d.]+)us", said)
    if not rows:
        print(said[-1500:])
        return None
    middle = lambda i: sorted(float(row[i]) for row in rows)[len(rows) // 2] / 1000
    print(f"ddsperf, half of the way there and back: {middle(1):.2f} (p50), {middle(2):.2f} ms (p99)")
    return middle(1), middle(2)


def address(machine):
    return f'<General><Interfaces><NetworkInterface address="{MACHINES[machine]}"/></Interfaces></General>'


def main(work):
    with Spaces(MACHINES) as spaces:
        ours, theirs = over_takt(spaces, work), over_cyclone(spaces)
    if ours is None or theirs is None:
        return 1
    print(f"takt against ddsperf: p50 {ours[0] / theirs[0]:.2f}, p99 {ours[1] / theirs[1]:.2f}")
    return 1 if ours[2] or ours[1] > 2 else 0


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("ip") or not shutil.which("ddsperf"):
        print("NOT RUN: needs root, ip (iproute2) and ddsperf (cyclonedds-tools)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="machines") as folder:
        sys.exit(main(pathlib.Path(folder)))
