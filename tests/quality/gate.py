#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures again what the project says of itself, and compares.

  gate.py figures TAKT        every line of figures.txt: a `takt eval` on data that it makes itself, against the stored
                              figure; exit 1 if one is worse by more than its tolerance
  gate.py ratios TAKT_BENCH   every row of targets.txt: its ratio against its target; a ratio is printed, never a reason to
                              fail (machines are shared), a suite that fails or lacks a row is

Both say of each line what was found, and exit 2 for a line that they do not understand."""
import fnmatch
import json
import os
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))


def fail(what):
    print(f"gate: {what}", file=sys.stderr)
    sys.exit(2)


def sections(name):
    """(place, command, [(place, words)]) of each section: a line that begins at the margin, and the lines below it."""
    found = []
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            place, text = f"tests/quality/{name}:{number}", line.split("#")[0].rstrip()
            if not text:
                continue
            if not text.startswith(" "):
                found.append((place, text, []))
            elif not found:
                fail(f"{place}: a line of no command; begin the command at the margin")
            else:
                found[-1][2].append((place, text.split()))
    return found


def number(place, word):
    try:
        return float(word)
    except ValueError:
        fail(f"{place}: `{word}` is no number")


def at(document, path):
    """What is there, or None: names and indices, separated by slashes."""
    for step in path.split("/"):
        try:
            document = document[int(step)] if isinstance(document, list) else document[step]
        except (KeyError, IndexError, ValueError, TypeError):
            return None
    return document if isinstance(document, (int, float)) and not isinstance(document, bool) else None


def compare_figures(takt):
    worse = 0
    for place, command, lines in sections("figures.txt"):
        began = time.monotonic()
        run = subprocess.run([takt, "eval", *command.split(), "--json"], capture_output=True, text=True, check=False)
        if run.returncode != 0:
            print(f"{place}: takt eval {command}: exit {run.returncode}: {run.stderr.strip()}")
            worse += 1
            continue
        print(f"takt eval {command} ({time.monotonic() - began:.0f} s)")
        document = json.loads(run.stdout)
        for place, words in lines:
            if len(words) != 4 or words[1] not in ("higher", "lower"):
                fail(f"{place}: write PATH, higher or lower (which is better), the stored figure, its tolerance")
            path, better, stored, tolerance = words[0], words[1], number(place, words[2]), number(place, words[3])
            got = at(document, path.replace("~", " "))
            if got is None:
                verdict, worse = "there is no such figure", worse + 1
            else:
                gain = got - stored if better == "higher" else stored - got
                verdict = "ok" if abs(gain) <= tolerance else "BETTER: store it" if gain > 0 else "WORSE"
                worse += verdict == "WORSE"
                got = f"{got:.4g}"
            print(f"  {path:44} {got or '-':>9}  stored {stored:g} +- {tolerance:g}: {verdict}")
    print("figures: " + (f"{worse} worse" if worse else "none is worse"))
    return 1 if worse else 0


def print_ratios(bench):
    wrong = missed = 0
    for place, suite, lines in sections("targets.txt"):
        with tempfile.NamedTemporaryFile(suffix=".json") as file:
            run = subprocess.run([bench, *suite.split(), "--json", file.name], capture_output=True, text=True, check=False)
            rows = json.load(file) if run.returncode == 0 else []
        print(f"takt bench {suite}")
        if run.returncode != 0:
            print(f"  {place}: exit {run.returncode}: {run.stderr.strip()}")
            wrong += 1
            continue
        for place, words in lines:
            if len(words) != 3 or words[1] not in ("<=", ">="):
                fail(f"{place}: write ROW, <= or >=, the target")
            target = number(place, words[2])
            found = [r for r in rows if fnmatch.fnmatch(r["name"], words[0]) and not r["name"].endswith("_null")
                     and r.get("ratio") is not None]  # some rows have no reference
            for row in found:
                met = row["ratio"] <= target if words[1] == "<=" else row["ratio"] >= target
                missed += not met
                print(f"  {row['name']:44} {row['ratio']:9.3g} of {row['reference']}, {words[1]} {target:g}: "
                      + ("met" if met else "MISSED"))
            if not found:
                print(f"  {place}: there is no row {words[0]}")
                wrong += 1
    print(f"ratios: {missed} missed" + (f", {wrong} could not be had" if wrong else ""))
    return 1 if wrong else 0


def main():
    what = {"figures": compare_figures, "ratios": print_ratios}
    if len(sys.argv) != 3 or sys.argv[1] not in what:
        fail("gate.py figures TAKT | ratios TAKT_BENCH")
    sys.exit(what[sys.argv[1]](sys.argv[2]))


if __name__ == "__main__":
    main()
