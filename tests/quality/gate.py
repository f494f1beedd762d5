#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures again what the project says of itself, and compares.

  gate.py figures TAKT [--store]
                              every figure of measured/99_gate.json: a `takt eval` on data that it makes itself, against the
                              stored figure; exit 1 if one differs by more than its tolerance, for better or worse. With
                              --store those are stored, with machine, date and commit; then run tests/tools/measured.py
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
GATE = os.path.join(HERE, "measured", "99_gate.json")


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


def evaluated(takt, command):
    """(the JSON of that `takt eval`, nothing) or (nothing, what went wrong)."""
    run = subprocess.run([takt, "eval", *command.split(), "--json"], capture_output=True, text=True, check=False)
    return (json.loads(run.stdout), "") if run.returncode == 0 else (None, f"exit {run.returncode}: {run.stderr.strip()}")


def read_gate(path=GATE):
    """What is stored; exit 2 with the figure at fault where it is not understood."""
    with open(path, encoding="utf-8") as file:
        gate = json.load(file)
    for evaluation in gate["evaluations"]:
        for figure in evaluation["figures"]:
            numbers = [figure.get(key) for key in ("stored", "tolerance")]
            if figure.get("better") not in ("higher", "lower") or not all(type(n) in (int, float) for n in numbers):
                fail(f"{path}: takt eval {evaluation['eval']}: {figure.get('path')}: write path, better (higher or lower), "
                     "and as numbers stored and tolerance")
    return gate


def compare_figures(gate, evaluate):
    """How many figures differ; each is printed. `evaluate` takes a command, and returns as `evaluated` does."""
    differ = 0
    for evaluation in gate["evaluations"]:
        began = time.monotonic()
        document, wrong = evaluate(evaluation["eval"])
        print(f"takt eval {evaluation['eval']} ({time.monotonic() - began:.0f} s){': ' + wrong if wrong else ''}")
        for figure in evaluation["figures"]:
            stored, tolerance, got = figure["stored"], figure["tolerance"], at(document, figure["path"])
            if got is None:
                verdict = "there is no such figure"
            elif abs(got - stored) <= tolerance:
                verdict = "ok"
            else:
                verdict = "BETTER: store it" if (got > stored) == (figure["better"] == "higher") else "WORSE"
                figure["found"] = got
            differ += verdict != "ok"
            print(f"  {figure['path']:44} {'-' if got is None else f'{got:.4g}':>9}  stored {stored:g} +- {tolerance:g}: {verdict}")
    print("figures: " + (f"{differ} differ" if differ else "all as stored"))
    return differ


def write_gate(gate, path=GATE):
    """Stores what compare_figures found, a figure a line; returns the text."""
    evaluations = []
    for evaluation in gate["evaluations"]:
        figures = []
        for figure in evaluation["figures"]:
            found = figure.pop("found", None)
            figures.append(json.dumps(figure if found is None else {**figure, "stored": float(f"{found:.4g}")}))
        evaluations.append(f'  {{"eval": {json.dumps(evaluation["eval"])}, "figures": [\n   ' + ",\n   ".join(figures) + "]}")
    head = "".join(f" {json.dumps(key)}: {json.dumps(value)},\n" for key, value in {**gate, **ratios.taken()}.items() if key != "evaluations")
    with open(path, "w", encoding="utf-8") as file:
        file.write("{\n" + head + ' "evaluations": [\n' + ",\n".join(evaluations) + "]\n}\n")


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
    figures.add_argument("--store", action="store_true", help="store the figures that differ, and exit 0")
    ratio = commands.add_parser("ratios")
    ratio.add_argument("bench")
    ratio.add_argument("--suite", action="append", default=[], metavar="NAME", help="only this suite; repeatable")
    ratio.add_argument("--shard", metavar="K/N", help="only the K-th of N parts of the suites")
    ratio.add_argument("--json", metavar="FILE", help="write what was found")
    given = parser.parse_args()
    if given.what == "figures":
        gate = read_gate()
        differ = compare_figures(gate, lambda command: evaluated(given.takt, command))
        if given.store:
            write_gate(gate)
        sys.exit(1 if differ and not given.store else 0)
    sys.exit(compare_ratios(given.bench, given.suite, given.shard, given.json))


if __name__ == "__main__":
    main()
