#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What freezes the ring is in the frozen file: frozen.py [COUNT] [SEED] [GAP_S].

The main graph runs in several processes with windows of 3 s. Every GAP_S seconds (9) one of three things happens: a mark
is set, the process of obstacle_stop is stopped until it misses, or a process is killed. Each must give a frozen file that
names it and replays without a difference, and the ring's folders, looked at ten times a second, must never be larger than they
may. Exit 1 if one does not.
"""
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

from processes import alive, family
from processes import name as process_name
from ring_sizes import Sizes, main_graph

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
count, seed, gap_s = int((sys.argv[1:] or ["200"])[0]), int((sys.argv[2:] or ["1"])[0]), float((sys.argv[3:] or ["9"])[0])
chance = random.Random(seed)
LIMITS_MB = {"disk": 2000, "memory": 700}
A_RUN = 50  # injections: their files, a quarter of a gigabyte each, are judged before the disk has no room for more


def member(run, name):
    """The process of that subsystem."""
    return next((pid for pid in family(run.pid) if process_name(pid) == name and alive(pid)), None)


def inject(kind, number, run):
    """What was done, as the frozen file should say it."""
    if kind == "mark":
        subprocess.run([takt, "mark", f"number {number}", "--run", str(run.pid)], check=True, stdout=subprocess.DEVNULL)
        return f"number {number}"
    name = "robot" if kind == "miss" else chance.choice(["people", "detection", "mapping"])
    pid = member(run, name)
    if pid is None:
        return None
    if kind == "miss":
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.3)
        os.kill(pid, signal.SIGCONT)
        return "obstacle_stop"
    os.kill(pid, signal.SIGKILL)
    return name


def main():
    bad = 0
    rules = "before: 2s, after: 1s, frozen: 60GB, disk: {disk}MB, memory: {memory}MB".format(**LIMITS_MB)
    with main_graph(rules) as graph:
        for first in range(0, count, A_RUN):
            with tempfile.TemporaryDirectory(prefix="frozen") as work:
                bad += one_run(graph, range(first, min(count, first + A_RUN)), pathlib.Path(work))
    print(f"{count - bad} of {count} frozen, named and replayed")
    return 1 if bad else 0


def one_run(graph, numbers, work):
    """How many of them are not as they should be; all, if the run ends or its ring grows too large."""
    done = []
    with open(work / "log", "w") as log:
        run = subprocess.Popen([takt, "run", str(graph), "--for", "0s", "--ring", "on", "--output", str(work / "out"),
                                "--report", str(work / "report.json")], stdout=log, stderr=log)
        time.sleep(8)
        sizes = Sizes(work / "out/flight/ring", LIMITS_MB)
        for number in numbers:
            kind = ["mark", "miss", "outage"][chance.randrange(3)]
            what = inject(kind, number, run)
            done.append((kind, what))
            time.sleep(gap_s * chance.uniform(0.8, 1.2))
            if run.poll() is not None:
                print(f"the run ended with {run.returncode}:\n{(work / 'log').read_text()[-2000:]}")
                return len(numbers)
        within = sizes.kept_within()
        run.send_signal(signal.SIGINT)
        run.wait()
    bad = judge(work, done)
    return bad if within else len(numbers)


def judge(work, done):
    report = json.loads((work / "report.json").read_text())
    frozen = report["flight"]["frozen"]
    print(f"disk lost {report['flight']['disk']['lost']}, memory lost {report['flight']['memory']['lost']}; "
          f"{len(frozen)} frozen; policy {report['policy_granted']}")
    bad = 0
    left = list(frozen)
    for kind, what in done:
        match = next((one for one in left if what is not None and any(
            cause["kind"] == kind and (what in cause["what"] or what in cause["subject"]) for cause in [one, *one["also"]])), None)
        if match is None:
            print(f"{kind} of {what}: no frozen file names it")
            bad += 1
            continue
        left.remove(match)
        file = work / "out/flight/frozen" / match["file"]
        replayed = subprocess.run([takt, "replay", str(file), "--compare", "--output", str(work / "again")],
                                  capture_output=True, text=True)
        lines = [line for line in replayed.stdout.splitlines() if "differ" in line or "not run" in line or "without" in line]
        good = replayed.returncode == 0
        bad += not good
        print(f"{kind} of {what}: {match['file']}, {match['mb']:.0f} MB: {match['sentence']}; "
              f"{'; '.join(lines)}{'' if good else ' EXIT ' + str(replayed.returncode) + ' ' + replayed.stderr[-300:]}", flush=True)
        if good:
            file.unlink()
    return bad


if __name__ == "__main__":
    sys.exit(main())
