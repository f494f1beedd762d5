#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a command and tells how long the host kept this machine's CPUs from running meanwhile.

host_holes.py FILE COMMAND...: exit code of the command; the first line of FILE then holds whole milliseconds, of all CPUs
together: the larger of what the kernel counts as stolen and of what is seen here, since some hosts report none. Each other
line is a hole that was seen: `CPU FROM_NS TO_NS` (CLOCK_MONOTONIC). On each CPU a thread of SCHED_FIFO 98 wakes every 5 ms.
Where it wakes late, either somebody of higher priority had the CPU: then its tick came meanwhile, or nobody had: then it
did not. Only the latter counts, from 12 ms on. Without the right to SCHED_FIFO only the kernel's count is told.

For scripts:  watch = host_holes.start(file)         before a run: a process of its own, which ends with its starter at the latest
              holes = host_holes.end(watch, file)    after it: [(cpu, from_ns, to_ns)]
              host_holes.taken_ns(holes, from, to)   the most that one CPU lost of that time"""
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


def watch(cpu, ended, holes):
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
            holes.append((cpu, round(due * 1e9), round((due + late) * 1e9)))
        due = time.monotonic() + STEP_S


def start(file):
    return subprocess.Popen([sys.executable, __file__, file, "cat"], stdin=subprocess.PIPE)


def end(watch, file):
    watch.communicate()  # closes what `cat` reads
    with open(file) as lines:
        return [tuple(map(int, line.split())) for line in list(lines)[1:]]


def taken_ns(holes, from_ns, to_ns):
    of_cpu = {}
    for cpu, begin, end in holes:
        of_cpu[cpu] = of_cpu.get(cpu, 0) + max(0, min(end, to_ns) - max(begin, from_ns))
    return max(of_cpu.values(), default=0)


def main():
    file, command = sys.argv[1], sys.argv[2:]
    ended, holes, stolen_before = threading.Event(), [], stolen_ms()
    threads = [threading.Thread(target=watch, args=(cpu, ended, holes)) for cpu in os.sched_getaffinity(0)]
    for thread in threads:
        thread.start()
    code = subprocess.run(command, check=False).returncode
    ended.set()
    for thread in threads:
        thread.join()
    with open(file, "w") as out:
        out.write(f"{max(stolen_ms() - stolen_before, round(sum(end - begin for _, begin, end in holes) / 1e6))}\n")
        out.writelines(f"{cpu} {begin} {end}\n" for cpu, begin, end in sorted(holes, key=lambda hole: hole[1]))
    return code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main())
