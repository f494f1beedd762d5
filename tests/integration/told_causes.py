# SPDX-License-Identifier: Apache-2.0
"""told_causes.py TRACE SENTENCES CORE CAUSE... : what `takt explain` tells of injected causes, against the jobs' own clocks.

A job that burns 9 ms of CPU holds its processor longer where others interrupt it, and going to sleep costs what the
machine takes for it. So nothing is compared with the figure of the graph alone: the jobs' starts and ends, which no source
of switches had a part in, say between which two figures the truth must lie. Three of four sentences must tell one there.
"""
import json
import re
import sys

ROUNDING_MS = 0.06
trace, sentences, core, *causes = sys.argv[1:]
jobs = {}
for event in json.load(open(trace))["traceEvents"]:
    if event.get("cat") == "job":
        ms = {key.removesuffix("_ns"): value / 1e6 for key, value in event["args"].items() if key.endswith("_ns")}
        jobs[event["name"].split()[0], event["args"]["job"]] = ms


def held(job):
    return job["finish"] - job["start"]


def off_cpu(victim, _):
    return 9, held(victim) - 6


def behind(late_one, _):
    return 3, late_one["start"] - late_one["release"]


def late(late_one, blocker):
    return max(3, blocker["finish"] - late_one["release"]), late_one["start"] - late_one["release"]


# Who tells it, in which words (several figures are added), who is to blame; at least and at most. What the jobs of the
# graph burn is the least: the culprit itself may be interrupted, and not be on the processor all the while.
EXPECTED = {
    "over": ("long_one", "([0-9.]+) over its own budget", "long_one", lambda own, _: (5, held(own) - 5)),
    "asleep": ("sleeper", "asleep ([0-9.]+) in the job", "sleeper", lambda own, _: (4, held(own) - 1)),
    "preempted": ("victim", f"preempted ([0-9.]+) by culprit on cpu {core}", "culprit", off_cpu),
    "unattributed": ("victim", "([0-9.]+) unattributed", "culprit", off_cpu),
    "behind": ("late_one", f"released late ([0-9.]+) behind blocker on cpu {core}", "blocker", behind),
    "late": ("late_one", "released late ([0-9.]+)", "blocker", late),
}

failed = False
for cause in causes:
    node, words, other, bounds = EXPECTED[cause]
    told = right = 0
    for line in open(sentences):
        sentence = re.match(rf"{node} missed job (\d+) by ", line)
        if not sentence:
            continue
        told += 1
        index = int(sentence[1])
        least, most = bounds(jobs[node, index], jobs[other, index])
        figures = [float(figure) for figure in re.findall(words, line)]
        if figures and least - ROUNDING_MS <= sum(figures) <= most + ROUNDING_MS:
            right += 1
        else:
            print(f"{cause}: {least:.2f} to {most:.2f} ms, told: {line.strip()}")
    print(f"{node}: {cause} told rightly of {right} of {told} jobs")
    failed |= told == 0 or right < told * 3 // 4
sys.exit(failed)
