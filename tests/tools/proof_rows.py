#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Rows of tests/integration/proofs.sh, and the comparison of one of them.

proof_rows.py rows [--full] [--shard K/N] GRAPH...   one row a line: GRAPH PROFILE ISOLATION POLICY. Without --full a part of
                                                     all rows in which each pair of two of these values is found.
proof_rows.py compare CHECK.json CODE RUN.json CODE RUN.stderr   what `takt check --json` and `takt run --report` say of one
                                                     row. Prints its figures; exit 1 if they differ, 77 if there is nothing
                                                     to be compared, with the reason."""
import argparse
import itertools
import json
import os
import re
import sys

ISOLATIONS, POLICIES = ("none", "subsystem"), ("deadline", "fixed", "cooperative")
WITHIN_MS = 1e-6  # figures of the same code, written as text


def profiles(graph):
    """Those that the graph names; "-" if none."""
    with open(graph) as file:
        block = re.search(r"^profiles:\n((?:(?: .*|#.*)?\n)*)", file.read(), re.MULTILINE)
    return re.findall(r"^  (\w+):", block.group(1), re.MULTILINE) if block else ["-"]


def is_new(row, seen):
    return any(pair not in seen for pair in pairs(row))


def pairs(row):
    graph, profile, isolation, policy = row
    return list(itertools.combinations((("graph", graph, profile), ("isolation", isolation), ("policy", policy)), 2))


def pairwise(rows):
    """Every pair of values stands in a row: the row that adds most pairs next, the first of equals."""
    seen, chosen, rest = set(), [], list(rows)
    while rest:
        best = max(rest, key=lambda row: len(set(pairs(row)) - seen))
        if not is_new(best, seen):
            break
        seen.update(pairs(best))
        chosen.append(best)
        rest.remove(best)
    return chosen


def print_rows(arguments):
    options = argparse.ArgumentParser()
    options.add_argument("--full", action="store_true")
    options.add_argument("--shard", default="1/1")
    options.add_argument("graphs", nargs="+")
    options = options.parse_args(arguments)
    k, n = map(int, options.shard.split("/"))
    rows = [(graph, profile, isolation, policy) for graph in options.graphs for profile in profiles(graph)
            for isolation in ISOLATIONS for policy in POLICIES]
    for row in (rows if options.full else pairwise(rows))[k - 1::n]:
        print(*row)


def bounds_of_check(check):
    """By name; None: not bounded."""
    bounds = {"response of " + node["name"]: node["response_ms"] for node in check["nodes"]}
    bounds |= {"chain " + chain["name"]: chain["bound_ms"] for chain in check["chains"]}
    return bounds | {"edge " + edge["name"]: edge["bound_ms"] for edge in check["edges"]}


def bounds_of_run(report, key):
    bounds = {"response of " + node["name"]: node["response_ms"].get(key) for node in report["nodes"]}
    bounds |= {"chain " + chain["name"]: chain["age_ms"].get(key) for chain in report["chains"]}
    return bounds | {f"edge {edge['from']} -> {edge['to']}": edge["age_ms"].get(key) for edge in report["edges"]}


def differ(a, b):
    return (a is None) != (b is None) or (a is not None and abs(a - b) > WITHIN_MS)


def compare(check_file, check_code, run_file, run_code, run_stderr):
    check_code, run_code = int(check_code), int(run_code)
    with open(run_stderr) as file:
        said = [line.strip() for line in file if "error:" in line] or ["no reason is given"]
    with open(check_file) as file:
        text = file.read()
    if check_code == run_code == 3 and not text.strip():
        print("NOT RUN: " + said[0])
        return 77
    if check_code not in (0, 1, 2) or not text.strip():
        print(f"check exits {check_code} without an answer")
        return 1
    check = json.loads(text)
    # A report is written by a run that has run, and by no other.
    if not os.path.getsize(run_file):
        if run_code == 3:
            print("NOT RUN: " + said[0])
            return 77
        if check["admitted"] or check_code != run_code:
            print(f"check exits {check_code}, run refuses with {run_code}: {said[0]}")
            return 1
        print(f"refused by both, exit {check_code}")
        return 0
    with open(run_file) as file:
        report = json.load(file)
    proofs, cooperative = report["proofs"], report["policy_asked"] == "cooperative"
    stalls = f"host stall {report['host_stall_ms']} ms, longest seen {proofs['stalls']['longest_ms']:.1f} ms"
    if not check["admitted"] and not cooperative:
        print(f"check refuses ({check_code}) what run runs: {check['problems'][:1]}")
        return 1
    if report["policy_granted"] != report["policy_asked"]:
        print(f"NOT RUN: the policy {report['policy_asked']} is not granted here")
        return 77
    # Of a schedule that cooperative runs although it is not admitted, nothing is estimated.
    stated = bounds_of_check(check) if check["admitted"] else {}
    ran = bounds_of_run(report, "estimated_ms" if cooperative else "proven_ms")
    wrong = [f"{name}: check {stated.get(name)}, run {ran.get(name)}" for name in sorted(stated | ran)
             if differ(stated.get(name), ran.get(name))]
    wrong += [f"unexplained: {row}" for row in proofs["above_proof"] if row["cause"] == "unexplained"]
    causes = [row["cause"] for row in proofs["above_proof"]]
    print(f"{proofs['verdict']}, {proofs['compared']} figures, above for " +
          (", ".join(f"{cause} {causes.count(cause)}" for cause in sorted(set(causes))) or "no cause") + f"; {stalls}")
    for line in wrong[:8]:
        print("  " + line)
    return 1 if wrong else 0


if __name__ == "__main__":
    if sys.argv[1] == "rows":
        print_rows(sys.argv[2:])
    else:
        sys.exit(compare(*sys.argv[2:]))
