#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a command and tells how long the host kept this machine's CPUs from running meanwhile.

host_holes.py FILE COMMAND...: exit code of the command; FILE then holds whole milliseconds, of all CPUs together: the
larger of what the kernel counts as stolen and of what is seen here, since some hosts report none. On each CPU a thread of
SCHED_FIFO 98 wakes every 5 ms. Where it wakes late, either somebody of higher priority had the CPU: then its tick came
meanwhile, or nobody had: then it did not. Only the latter counts, from 12 ms on. Without the right to SCHED_FIFO only the
kernel's count is told."""
import os
import subprocess
import sys
import threading
import time

PRIORITY, STEP_S, LEAST_S = 98, 0.005, 0.012
TICK_S = 0.004  # the slowest in use: a kernel that ticks faster is judged more strictly


def stolen_ms():
    with open("/proc/stat") as stat:
        return int(stat.readline().split()[8]) * 1000 // os.sysconf("SC_CLK_TCK")


def timer_interrupts(cpu):
    with open("/proc/interrupts") as table:
        column = table.readline().split().index(f"CPU{cpu}") + 1
        return next(int(line.split()[column]) for line in table if line.lstrip().startswith("LOC:"))


def watch(cpu, ended, holes_s):
    os.sched_setaffinity(0, {cpu})
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        return
    ticks, due = timer_interrupts(cpu), time.monotonic() + STEP_S
    while not ended.is_set():
        time.sleep(max(0, due - time.monotonic()))
        late = time.monotonic() - due
        before, ticks = ticks, timer_interrupts(cpu)
        if late > LEAST_S and (ticks - before) * TICK_S < late / 2:
            holes_s.append(late)
        due = time.monotonic() + STEP_S


def main():
    file, command = sys.argv[1], sys.argv[2:]
    ended, holes_s, stolen_before = threading.Event(), [], stolen_ms()
    threads = [threading.Thread(target=watch, args=(cpu, ended, holes_s)) for cpu in os.sched_getaffinity(0)]
    for thread in threads:
        thread.start()
    code = subprocess.run(command, check=False).returncode
    ended.set()
    for thread in threads:
        thread.join()
    with open(file, "w") as out:
        out.write(f"{max(stolen_ms() - stolen_before, round(1000 * sum(holes_s)))}\n")
    return code if code >= 0 else 128 - code


sys.exit(main())
