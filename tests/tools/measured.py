#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes docs/measured.md from the figures in tests/quality/measured.

measured.py SOURCE            writes the page
measured.py SOURCE --check    exit 1 if the page differs from the files

Each file NN_NAME.json is a section, in the order of NN: title, machine, date, and rows of what, command (one or a list), printed,
target, met, data, and where there is one n, note, commit, date, machine. `data` says what a figure was measured on: `none` (no
data matter), `generated`, `recorded`, or `held out` (nothing was chosen on them, or on others like them). `, chosen on` behind the
first ones: parameters were chosen on the same data. 99_gate.json has the figures that tests/quality/gate.py measures again,
98_ratios.json, where it is there, what `gate.py ratios --json` wrote.
"""
import json
import pathlib
import sys

from pages import bring, code, table

NEEDED = {"what", "command", "printed", "target", "met", "data"}
ALLOWED = NEEDED | {"n", "note", "commit", "date", "machine"}
MET = ("yes", "partly", "no", "shown", "open")
DATA = ("none", "generated", "recorded", "held out", "generated, chosen on", "recorded, chosen on")


def mistakes(row):
    """What is wrong in a row."""
    if wrong := NEEDED - row.keys() | row.keys() - ALLOWED:
        return f"keys {', '.join(sorted(wrong))}: a row needs {', '.join(sorted(NEEDED))}, and may have {', '.join(sorted(ALLOWED - NEEDED))}"
    if row["met"] not in MET:
        return f"met `{row['met']}`; write {' | '.join(MET)}"
    if row["data"] not in DATA:
        return f"data `{row['data']}`; write {' | '.join(DATA)}"
    if row["met"] in ("partly", "no", "open") and "note" not in row:
        return f"met `{row['met']}`: write into note what misses, and why"
    return None


def load(folder):
    """The sections in their order; SystemExit with file and row where one is wrong."""
    sections = []
    for path in sorted(folder.glob("*.json")):
        section = json.loads(path.read_text())
        for number, row in enumerate(section.get("rows", []), 1):
            if wrong := mistakes(row):
                sys.exit(f"{path}: row {number}: {wrong}")
        sections.append(section)
    return sections


def taken(row):
    return " ".join(row[key] for key in ("date", "machine", "commit") if key in row)


def section_lines(section):
    yield from ["", f"## {section['title']}", "", f"Taken {section['date']} on {section['machine']}.", ""]
    notes, rows = [], []
    for row in section["rows"]:
        commands = row["command"] if isinstance(row["command"], list) else [row["command"]]
        met = row["met"]
        if "note" in row:
            notes.append(f"{len(notes) + 1}. {row['note']}.")
            met += f" ({len(notes)})"
        shown = ", ".join(code(command) if command != "-" else "-" for command in commands)
        rows.append((row["what"], shown, row["printed"], row["target"], met, row["data"], row.get("n", ""), taken(row)))
    yield from table(("what", "command", "printed", "target", "met", "data", "n", "commit"), rows)
    if notes:
        yield from ["", *notes]


def gate_lines(section):
    yield from ["", f"## {section['title']}", "", f"Taken {section['date']} at {section['commit']} on {section['machine']}. All data are generated.", ""]
    rows = [
        (code(f"takt eval {evaluation['eval']}"), code(f["path"]), f["better"], f"{f['stored']:g}", f"{f['tolerance']:g}")
        for evaluation in section["evaluations"]
        for f in evaluation["figures"]
    ]
    yield from table(("command", "figure in its JSON", "better is", "stored", "tolerance"), rows)


def ratio_lines(section):
    yield from ["", f"## {section['title']}", "", f"Taken {section['date']} at {section['commit']} on {section['machine']}.", ""]
    rows = [
        (code(f"takt bench {suite['command']}"), row["name"], f"{row['ratio']:.3g}", row["reference"], f"{row['sense']} {row['target']:g}",
         "-" if row["null"] is None else f"{row['null']:.3g}", row["verdict"])
        for suite in section["suites"]
        for row in suite["rows"]
    ]
    yield from table(("command", "row", "ratio", "of", "target", "null pair", "verdict"), rows)


def page(sections):
    """The lines of the page, from nothing but the sections."""
    for section in sections:
        kind = gate_lines if "evaluations" in section else ratio_lines if "suites" in section else section_lines
        yield from kind(section)


def main():
    source, check = pathlib.Path(sys.argv[1]), sys.argv[2:] == ["--check"]
    wrong = bring(source / "docs" / "measured.md", "measured.py", page(load(source / "tests" / "quality" / "measured")), check)
    print(wrong or f"measured: {'as the files say' if check else 'written'}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
