#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures again what the project says of itself, and compares.

  gate.py figures TAKT        every line of figures.txt: a `takt eval` on data that it makes itself, against the stored
                              figure; exit 1 if one is worse by more than its tolerance
  gate.py ratios TAKT_BENCH [--suite NAME]... [--shard K/N] [--json FILE]
                              every row of targets.txt: its ratio against its target; exit 1 if one misses it by more than
                              its null pair shows as noise (the rule stands in ratios.py), or a suite or row is missing

Both say of each line what was found, and exit 2 for a line that they do not understand."""
import argparse
import json
import os
import subprocess
import sys
import time

import ratios

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


def compare_ratios(bench, wanted, shard, json_file):
    suites = []
    for _, command, lines in sections("targets.txt"):
        targets = []
        for place, words in lines:
            if len(words) != 3 or words[1] not in ("<=", ">="):
                fail(f"{place}: write ROW, <= or >=, the target")
            targets.append(ratios.Target(place, words[0], words[1], number(place, words[2])))
        suites.append((command, targets))
    names = [command.split()[0] for command, _ in suites]
    for name in wanted:
        if name not in names:
            fail(f"targets.txt has no suite `{name}`; there are: {' '.join(names)}")
    suites = [suite for suite, name in zip(suites, names) if not wanted or name in wanted]
    if shard:
        suites = ratios.share(suites, shard)
        if suites is None:
            fail(f"--shard {shard}: write K/N, such as 1/4")
    return 0 if ratios.judge_all(bench, suites, json_file) else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="what", required=True)
    figures = commands.add_parser("figures")
    figures.add_argument("takt")
    ratio = commands.add_parser("ratios")
    ratio.add_argument("bench")
    ratio.add_argument("--suite", action="append", default=[], metavar="NAME", help="only this suite; repeatable")
    ratio.add_argument("--shard", metavar="K/N", help="only the K-th of N parts of the suites")
    ratio.add_argument("--json", metavar="FILE", help="write what was found")
    given = parser.parse_args()
    if given.what == "figures":
        sys.exit(compare_figures(given.takt))
    sys.exit(compare_ratios(given.bench, given.suite, given.shard, given.json))


if __name__ == "__main__":
    main()
