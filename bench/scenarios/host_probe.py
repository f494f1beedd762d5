# SPDX-License-Identifier: Apache-2.0
"""What the machine itself does to anybody meanwhile: cyclictest (rt-tests) on each CPU, above every SCHED_FIFO thread of a run and awake
every 5 ms for microseconds. A deadline that is missed by less than cyclictest was late in the same minutes is the machine's.

    probe = host_probe.start(seconds, file)   beside a run; None where cyclictest is not installed or SCHED_FIFO is refused
    host_probe.text(file, slack_ms)           afterwards: the latest wake-up, and how many were later than that
"""
import json, os, shutil, subprocess, sys


def start(seconds, file):
    if not shutil.which("cyclictest"): return None
    return subprocess.Popen(["cyclictest", "--smp", "--priority=95", "--interval=5000", f"--duration={seconds}", "--quiet", "--default-system",
                             "--histogram=1000000", f"--json={file}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def text(file, slack_ms):
    if not os.path.exists(file): return "no cyclictest beside it (apt install rt-tests; needs SCHED_FIFO)"
    threads = json.load(open(file))["thread"].values()
    late = {}
    for thread in threads:
        for us, count in thread["histogram"].items(): late[int(us)] = late.get(int(us), 0) + count
    over = sum(count for us, count in late.items() if us > 1000 * slack_ms)
    # What is later than the histogram reaches is in the maximum only.
    latest_ms = max(thread["max"] for thread in threads) / 1000
    return f"cyclictest beside it: latest {latest_ms:.1f} ms, {over} of {sum(late.values())} later than {slack_ms} ms"


if __name__ == "__main__":
    probe = start(sys.argv[1], sys.argv[2])
    sys.exit(probe.wait() if probe else 0)
