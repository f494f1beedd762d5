#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two machines over a bad network, and whether Takt counts what was lost: machines_relay.py [SECONDS] [CASE...].

graph/two_machines.yaml in two network namespaces; a third one between them has the relay (tests/tools/relay.py), which is bad for
SECONDS (20): loss of 1, 5 and 30 %, jitter of 50 ms, reordering, doubling, a partition of 3 s. For each output that goes over the
network: messages that the relay lost, and those that Takt says are missing. Exit 1 if they differ by one, if a node of high
criticality missed a deadline, or if a mode did not come back; 77 without root or ip.
"""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from spaces import Spaces

root = pathlib.Path(__file__).resolve().parents[2]
takt = os.environ.get("TAKT", str(root / "takt"))
seconds = float((sys.argv[1:] or ["20"])[0])
CASES = {
    "good": "",
    "loss 1 %": "--loss 1",
    "loss 5 %": "--loss 5",
    "loss 30 %": "--loss 30",
    "jitter 50 ms": "--jitter 50",
    "reordering 10 %": "--reorder 10",
    "doubling 10 %": "--double 10 --jitter 2",
    "partition 3 s": f"--partition {seconds / 3},3",
    "72 kB, loss 5 %": "--loss 5 --talking 1",
    "72 kB, reordering 10 %": "--reorder 10 --talking 1",
}
SIZE = 72_000  # 54 pieces of RTPS, in two datagrams
wanted = sys.argv[2:] or list(CASES)
ADDRESSES = {"robot": "10.93.0.1", "vision": "10.93.0.2"}
BACK_S, ENDS_S = 3 + 3, 3  # a partition and the way back; the other machine may end so much earlier
MTU = 65535  # nothing is cut into pieces of IP, which nobody could account for


def buffer_errors(spaces, machine):
    """Datagrams that the kernel had no room for: lost behind the relay."""
    text = subprocess.run(["ip", "netns", "exec", spaces.names[machine], "cat", "/proc/net/snmp"], stdout=subprocess.PIPE, text=True, check=True).stdout
    names, values = (line.split()[1:] for line in text.splitlines() if line.startswith("Udp:"))
    return int(values[names.index("RcvbufErrors")])


def graph_of(case, work):
    """That of the project; or a load on the one machine that sends large messages to one on the other."""
    if not case.startswith("72 kB"):
        return root / "graph/two_machines.yaml"
    (work / "pair_schedule.yaml").write_text("""takt: 1
name: pair
policy: deadline
nodes: {maker: {rate: 15, budget: 2ms}, reader: {rate: 15, budget: 2ms}}
""")
    (work / "pair.yaml").write_text(f"""takt: 1
name: pair
schedule: pair_schedule.yaml
machines:
  robot: {{address: {ADDRESSES['robot']}, runs: [makes], ages: {{maker.output: 70ms}}}}
  vision: {{address: {ADDRESSES['vision']}, runs: [reads]}}
network: {{latency: 20ms, clock_error: 5ms, domain: 93}}
subsystems:
  makes: {{exports: [maker.output], maker: {{type: load, params: {{work: 0.2ms, message_size: {SIZE}, flood: true}}}}}}
  reads: {{reader: {{type: load, in: {{input: maker.output}}, params: {{work: 0.2ms}}}}}}
""")
    return work / "pair.yaml"


def run(spaces, work, graph, how):
    relay = spaces.begin("between", sys.executable, root / "tests/tools/relay.py", "robot", "vision", "--for", seconds, *how.split(), stdout=subprocess.PIPE,
                         stderr=subprocess.DEVNULL)
    time.sleep(0.5)
    runs, reports = {}, {}
    for machine in ADDRESSES:
        reports[machine] = work / f"{machine}.json"
        runs[machine] = spaces.begin(machine, takt, "run", graph, "--machine", machine, "--for", f"{seconds + 12}s", "--ring", "off",
                                     "--output", work / machine, "--report", reports[machine], stdout=subprocess.DEVNULL, stderr=open(work / f"{machine}.err", "w"))
    for one in runs.values():
        one.wait()
    relay.send_signal(signal.SIGTERM)
    account = json.loads(relay.communicate()[0])
    return account, {machine: json.loads(file.read_text()) for machine, file in reports.items()}


def compare(account, reports):
    """Rows (output, sent, lost by the relay, missing by Takt, overtaken)."""
    rows = []
    for topic, counts in sorted(account["writers"].items()):
        _, _, maker, node, port = topic.split("/")
        reader = next(machine for machine in ADDRESSES if machine != maker)
        device = next(device for device in reports[reader]["devices"] if device["name"] == node)
        rows.append((f"{node}.{port}", counts["sent"], counts["lost"], device["missing"], counts["overtaken"]))
    return rows


def misses(report):
    return sum(node["deadline_misses"] for node in report["nodes"] if node["criticality"] == "high")


def stayed_away(report):
    """Whether a mode without the other machine lasted longer than any partition and the way back, while that was there."""
    end = report["duration_s"] - ENDS_S
    return any(mode["name"] != "full" and min(mode["to_s"], end) - mode["from_s"] > BACK_S for mode in report["modes"])


def kept(report):
    done = sum(node["completed"] for node in report["nodes"])
    return done / max(1, sum(node["released"] for node in report["nodes"]))


def main(work):
    wrong = 0
    with Spaces(ADDRESSES, middle="between", mtu=MTU) as spaces:
        for case in wanted:
            account, reports = run(spaces, work, graph_of(case, work), CASES[case])
            rows = compare(account, reports)
            print(f"{case}: {account['dropped']} of {account['frames']} frames dropped in {account['bad_s']:.0f} s")
            for output, sent, lost, missing, overtaken in rows:
                equal = lost == missing
                wrong += not equal
                print(f"  {output}: {sent} sent, {lost} lost ({overtaken} overtaken), Takt says {missing}{'' if equal else '  DIFFERENT'}")
            wrong += len(rows) != (1 if "--talking 1" in CASES[case] else 2) or account["bad_s"] < seconds
            for machine, report in reports.items():
                changes = ", ".join(f"{mode['name']} {mode['from_s']:.1f} to {mode['to_s']:.1f} s" for mode in report["modes"])
                print(f"  {machine}: {100 * kept(report):.1f} % of the jobs done, {misses(report)} misses of high nodes, host stall {report['host_stall_ms']} ms, "
                      f"{buffer_errors(spaces, machine)} datagrams without room; {changes}")
                wrong += misses(report) + buffer_errors(spaces, machine)
                wrong += stayed_away(report)
            sys.stdout.flush()
    return 1 if wrong else 0


if __name__ == "__main__":
    if os.geteuid() != 0 or not shutil.which("ip"):
        print("NOT RUN: needs root and ip (iproute2)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="relay") as folder:
        sys.exit(main(pathlib.Path(folder)))
