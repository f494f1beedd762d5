#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a program on `core` costs: shared libraries, resident memory, time from main to its first message.

    hello_cost.py PROGRAM        prints one line of JSON; exit 1 if a limit is exceeded

PROGRAM is examples/hello_core or a program like it: it prints a line for each message. Time is counted from the start
of the process, which is before main: the best of ten starts. Memory is the peak of the same run.
"""
import json
import os
import subprocess
import sys
import time

LIMITS = {"shared_libraries": 12, "resident_mb": 20, "first_message_ms": 10}


def shared_libraries(program):
    lines = subprocess.run(["ldd", program], check=True, capture_output=True, text=True).stdout.splitlines()
    missing = [line.strip() for line in lines if "not found" in line]
    if missing:
        sys.exit(f"hello_cost: {program}: {missing[0]}")
    return len(lines)


def one_start(program):
    """ms to the first line, MB resident at most"""
    begin = time.monotonic()
    with subprocess.Popen([program], stdout=subprocess.PIPE) as process:
        first = process.stdout.readline()
        took = (time.monotonic() - begin) * 1e3
        process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0 or not first:
        sys.exit(f"hello_cost: {program} ended with {process.returncode} and printed {first!r}")
    return took, usage.ru_maxrss / 1e3


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program = os.path.abspath(sys.argv[1])
    starts = [one_start(program) for _ in range(10)]
    cost = {
        "shared_libraries": shared_libraries(program),
        "resident_mb": round(max(start[1] for start in starts), 1),
        "first_message_ms": round(min(start[0] for start in starts), 1),
    }
    print(json.dumps(cost))
    over = [f"{name} is {cost[name]}, at most {limit} wanted" for name, limit in LIMITS.items() if cost[name] > limit]
    if over:
        sys.exit("hello_cost: " + "; ".join(over))


if __name__ == "__main__":
    main()
