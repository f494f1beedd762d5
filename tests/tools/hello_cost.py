#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a small program costs: shared libraries, resident memory, time from its start to its first message.

    hello_cost.py PROGRAM          a program on `core` that prints a line for each message: examples/hello_core
    hello_cost.py PROGRAM GRAPH    a program with Takt's commands, such as one that `takt new` made: its `run GRAPH`

Prints one line of JSON; exit 1 if a limit is exceeded. Time is counted from the start of the process, which is before main:
the best of ten starts. The first message of a graph is the first one in a record of it. Memory is the peak of all processes; of a
graph, without a record."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "packaging/python"))
import takt  # noqa: E402: from this tree

STARTS = 10
LIMITS = {"shared_libraries": 12, "resident_mb": 20, "first_message_ms": 10}
LIMITS_GRAPH = LIMITS | {"first_message_ms": 100}


def shared_libraries(program):
    lines = subprocess.run(["ldd", program], check=True, capture_output=True, text=True).stdout.splitlines()
    missing = [line.strip() for line in lines if "not found" in line]
    if missing:
        sys.exit(f"hello_cost: {program}: {missing[0]}")
    return sum("linux-vdso" not in line for line in lines)  # a page of the kernel, no file


def resident_mb(pid):
    """Of a process and all below it, at most until now."""
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
        children = [child for task in pathlib.Path(f"/proc/{pid}/task").iterdir() for child in (task / "children").read_text().split()]
    except OSError:  # it has ended meanwhile
        return 0
    own = [int(line.split()[1]) * 1.024e-3 for line in status.splitlines() if line.startswith("VmHWM:")]
    return sum(own) + sum(resident_mb(child) for child in children)


def watch(process):
    """Peak of its memory, until it ends well."""
    peak = 0
    while process.poll() is None:
        peak = max(peak, resident_mb(process.pid))
        time.sleep(0.02)
    return peak


def start_program(program):
    """ms to the first line, MB resident at most"""
    begin = time.monotonic()
    with subprocess.Popen([program], stdout=subprocess.PIPE, text=True) as process:
        first = process.stdout.readline()
        took = (time.monotonic() - begin) * 1e3
        peak = watch(process)
    if process.returncode != 0 or not first:
        sys.exit(f"hello_cost: {program} ended with {process.returncode} and printed {first!r}")
    return took, peak


def run_graph(program, graph, *options):
    """MB resident at most"""
    with tempfile.TemporaryDirectory() as folder, open(f"{folder}/said", "w+") as said:
        process = subprocess.Popen([program, "run", graph, "--output", folder, *options], stdout=said, stderr=said)
        peak = watch(process)
        if process.returncode not in (0, 1):  # 1: a deadline was missed, which is another test's
            said.seek(0)
            sys.exit(f"hello_cost: {program} run {graph} ended with {process.returncode}:\n{said.read()}")
    return peak


def start_graph(program, graph):
    """ms to the first message, MB resident at most: of a run of its own, as a recorder keeps memory for what its disk is too slow for"""
    with tempfile.TemporaryDirectory() as folder:
        begin_ns = time.monotonic_ns()
        run_graph(program, graph, "--for", "200ms", "--record", f"{folder}/run.mcap")
        ports = takt.read_record(f"{folder}/run.mcap").ports.values()
        first_ns = min(port.published_ns[0] for port in ports if len(port))
    return (first_ns - begin_ns) * 1e-6, run_graph(program, graph, "--for", "200ms")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    program, graph = os.path.abspath(sys.argv[1]), sys.argv[2:]
    starts = [start_graph(program, *graph) if graph else start_program(program) for _ in range(STARTS)]
    cost = {
        "shared_libraries": shared_libraries(program),
        "resident_mb": round(max(start[1] for start in starts), 1),
        "first_message_ms": round(min(start[0] for start in starts), 1),
    }
    print(json.dumps(cost))
    limits = LIMITS_GRAPH if graph else LIMITS
    over = [f"{name} is {cost[name]}, at most {limit} wanted" for name, limit in limits.items() if cost[name] > limit]
    if over:
        sys.exit("hello_cost: " + "; ".join(over))


if __name__ == "__main__":
    main()
