# SPDX-License-Identifier: Apache-2.0
"""Ratios of `takt bench` against the targets of targets.txt.

A ratio fails if it misses its target by more than its null pair shows as noise. A null pair is the reference measured
against itself in the same run; its ratio r0 is 1 on a quiet machine.

  noise   max(r0, 1/r0); 1 for a row without a null pair
  <=      `met` if ratio <= target, `within its null pair` if ratio <= target * noise, else `FAILED`
  >=      `met` if ratio >= target, `within its null pair` if ratio >= target / noise, else `FAILED`

With a noise above WIDEST hardly anything could fail. A row that only such a noise would excuse is `unclear`. Of a hundred
rows that are measured once, one or two miss by chance: the suite of a row that is unclear or failed runs twice more, and
the medians of the three ratios and null pairs decide. There, noise counts as WIDEST at most."""
import datetime
import fnmatch
import json
import os
import platform
import signal
import statistics
import subprocess
import tempfile
import time
from typing import NamedTuple

WIDEST = 1.5
LONGEST_S = 900  # of a suite: several times what the longest takes on two busy CPUs
MET, WITHIN, UNCLEAR, FAILED = "met", "within its null pair", "unclear", "FAILED"


class Target(NamedTuple):
    place: str  # file and line
    pattern: str  # of row names
    sense: str  # <= or >=
    value: float

    def misses_by(self, ratio):
        """A factor: above 1 the target is missed."""
        if self.sense == "<=":
            return ratio / self.value
        return self.value / ratio if ratio > 0 else float("inf")


def is_null(row):
    return any(part.endswith("_null") for part in row["name"].split("/"))


def null_of(row, rows):
    """The ratio of the row's null pair, or None. It is the row NAME_null, or one of the same reference and the same last
    part of the name, such as graph/chain10_in_process/futex_threads_null/latency_128_fifo."""
    def belongs(other):
        if other["name"] == row["name"] + "_null":
            return True
        return (is_null(other) and not other["name"].endswith("_null") and other["reference"] == row["reference"]
                and other["name"].split("/")[-1] == row["name"].split("/")[-1])
    ratios = [other["ratio"] for other in rows if belongs(other) and (other["ratio"] or 0) > 0]
    return ratios[0] if ratios else None


def noise_of(null):
    return 1.0 if null is None else max(null, 1 / null)


def judge(target, ratio, null, last=False):
    """`last`: no other run of the suite follows."""
    excess, noise = target.misses_by(ratio), noise_of(null)
    if excess <= 1:
        return MET
    if noise > WIDEST and not last:
        return UNCLEAR if excess <= noise else FAILED
    return WITHIN if excess <= min(noise, WIDEST) else FAILED


def judge_rows(target, rows, last=False):
    """What was found for each row that the target is about; some rows have no reference, and no ratio."""
    found = []
    for row in rows:
        if not fnmatch.fnmatch(row["name"], target.pattern) or is_null(row) or row["ratio"] is None:
            continue
        null = null_of(row, rows)
        found.append({"name": row["name"], "ratio": row["ratio"], "reference": row["reference"], "sense": target.sense,
                      "target": target.value, "null": null, "verdict": judge(target, row["ratio"], null, last)})
    return found


def text_of(found):
    null = "none" if found["null"] is None else f"{found['null']:.3g}"
    runs = "".join(f" {ratio:.3g}" for ratio in found.get("runs", []))
    return (f"  {found['name']:52} {found['ratio']:8.3g} of {found['reference']}, {found['sense']} {found['target']:g}, "
            f"null {null}: {found['verdict']}" + (f" (median of{runs})" if runs else ""))


def run_suite(bench, command, limit_s=LONGEST_S):
    """(rows, error, seconds) of one run; error is empty if it went well. What hangs is ended, with its processes."""
    began = time.monotonic()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "rows.json")
        run = subprocess.Popen([bench, *command.split(), "--json", path], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True, start_new_session=True)
        try:
            said = run.communicate(timeout=limit_s)[1].strip()
            error = "" if run.returncode == 0 else f"exit {run.returncode}: {said}"
            if not error:
                with open(path) as file:
                    rows = json.load(file)
        except subprocess.TimeoutExpired:
            error = f"it did not end within {limit_s:g} s"
        finally:
            if run.poll() is None:
                os.killpg(run.pid, signal.SIGKILL)
                run.communicate()
    return rows, error, time.monotonic() - began


def medians(runs):
    """The rows that all runs have, each with the median of its ratios; those that miss in one of them are left out."""
    by_name = [{row["name"]: row for row in rows} for rows in runs]
    joined = []
    for name, row in by_name[0].items():
        ratios = [rows[name]["ratio"] for rows in by_name if name in rows]
        if len(ratios) == len(runs) and all(ratio is not None for ratio in ratios):
            joined.append({**row, "ratio": statistics.median(ratios)})
    return joined


def judge_suite(bench, command, targets, measure=run_suite):
    """Runs a suite, three times where a row fails or stays unclear; prints and returns what was found."""
    rows, error, seconds = measure(bench, command)
    print(f"takt bench {command} ({seconds:.0f} s)", flush=True)
    outcome = {"command": command, "seconds": seconds, "runs": 1, "rows": [], "errors": [error] if error else []}
    if not error:
        for target in targets:
            found = judge_rows(target, rows)
            outcome["rows"] += found
            if not found:
                outcome["errors"].append(f"{target.place}: there is no row {target.pattern}")
    for found in outcome["rows"]:
        print(text_of(found))
    open_ones = {found["name"] for found in outcome["rows"] if found["verdict"] in (UNCLEAR, FAILED)}
    if open_ones:
        judge_by_three(bench, command, targets, rows, open_ones, outcome, measure)
    for error in outcome["errors"]:
        print(f"  {error}", flush=True)
    return outcome


def judge_by_three(bench, command, targets, first, names, outcome, measure):
    """Two more runs decide about the rows `names`, with the first."""
    print(f"takt bench {command}: twice more, for {', '.join(sorted(names))}", flush=True)
    runs = [first]
    for _ in range(2):
        rows, error, seconds = measure(bench, command)
        runs.append(rows)
        outcome["runs"], outcome["seconds"] = outcome["runs"] + 1, outcome["seconds"] + seconds
        if error:
            outcome["errors"].append(error)
            return
    joined = medians(runs)
    again = [found for target in targets for found in judge_rows(target, joined, last=True) if found["name"] in names]
    for found in again:
        found["runs"] = [row["ratio"] for rows in runs for row in rows if row["name"] == found["name"]]
    outcome["rows"] = [found for found in outcome["rows"] if found["name"] not in names] + again
    missing = sorted(names - {found["name"] for found in again})
    if missing:
        outcome["errors"].append(f"not every run has {', '.join(missing)}")
    for found in again:
        print(text_of(found))


def share(suites, shard):
    """The k-th of n parts of a list, for a text `k/n`; None for a text that is none."""
    part, slash, parts = shard.partition("/")
    if not (slash and part.isdigit() and parts.isdigit() and 1 <= int(part) <= int(parts)):
        return None
    return suites[int(part) - 1::int(parts)]


def taken():
    """What belongs to each figure: machine, date, commit of this checkout."""
    commit = subprocess.run(["git", "-C", os.path.dirname(os.path.abspath(__file__)), "rev-parse", "--short=8", "HEAD"],
                            capture_output=True, text=True, check=False).stdout.strip()
    return {"machine": f"{os.cpu_count()} CPUs, {platform.machine()}", "date": str(datetime.date.today()), "commit": commit or "unknown"}


def judge_all(bench, suites, json_file=None):
    """suites: [(command, [Target])]. True if no ratio failed, and no suite or row is missing."""
    outcomes = [judge_suite(bench, command, targets) for command, targets in suites]
    rows = [found for outcome in outcomes for found in outcome["rows"]]
    errors = sum(len(outcome["errors"]) for outcome in outcomes)
    count = {verdict: sum(found["verdict"] == verdict for found in rows) for verdict in (MET, WITHIN, FAILED)}
    print(f"ratios: {count[MET]} met, {count[WITHIN]} within their null pair, {count[FAILED]} failed"
          + (f", {errors} could not be had" if errors else ""))
    for found in rows:
        if found["verdict"] == FAILED:
            print(text_of(found))
    if json_file:
        with open(json_file, "w", encoding="utf-8") as file:
            json.dump({"title": "Ratios of the benchmarks against their targets", **taken(), "suites": outcomes}, file, indent=1)
    return count[FAILED] == 0 and errors == 0
