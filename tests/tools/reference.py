#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the pages of reference from what the command says.

reference.py SOURCE TAKT            writes docs/commands.md, docs/reference/nodes.md and docs/reference/devices.md
reference.py SOURCE TAKT --check    exit 1 if one of them differs from what TAKT says

docs/commands.md: `TAKT --help` and the help of each command. The others: `TAKT nodes` and `TAKT nodes TYPE`. What stands in a
page above the line that names this script is written by hand, and stays.
"""
import pathlib
import re
import subprocess
import sys

from pages import bring, code, table

COLUMN = 30  # of a help text, where meanings begin
HIDDEN = ("-h,--help",)


def said_by(takt, *words):
    return subprocess.run([takt, *words], capture_output=True, text=True, check=True).stdout


def sentence(text):
    return text[:1].upper() + text[1:] + "."


# Commands.


class Help:
    """What the help of a command says: its sections, and what stands behind them."""

    def __init__(self, text):
        self.purpose, self.sections, self.remarks = [], {}, []
        into, section = self.purpose, None
        lines = text.splitlines()
        for line, after in zip(lines, [*lines[1:], ""]):
            heading = re.fullmatch(r"(Positionals|Options|Subcommands):", line)
            if heading:
                section = self.sections[heading.group(1)] = []
            elif line.startswith("Usage: "):
                self.usage, into = line.partition("[OPTIONS]")[2], self.remarks
            elif section is not None and line.startswith(" " * COLUMN):
                section[-1][1].append(line[COLUMN:])
            elif section is not None and line.startswith("  "):
                # What is too long to have its meaning next to it has it below; so have choices, after a colon.
                name, meaning = line[:COLUMN], line[COLUMN:]
                alone = not name.endswith(" ") or (after.startswith(" " * COLUMN) and not meaning.endswith(":"))
                section.append((line.strip(), []) if alone else (name.strip(), [meaning]))
            elif line:
                section = None
                into.append(line)

    def arguments(self):
        """(argument, value, meaning) of each."""
        for argument, meaning in self.sections.get("Positionals", []) + self.sections.get("Options", []):
            name, _, value = argument.partition(" ")
            if name in HIDDEN:
                continue
            notes = re.findall(r"(Excludes|Needs): ((?:[-\w]+ ?)+?)(?= Excludes:| Needs:|$)", value)
            value = re.sub(r" ?(Excludes|Needs):.*", "", value)
            said = [meaning[0].rstrip(" :") if meaning else ""]
            for kind, others in notes:
                said.append(("not with " if kind == "Excludes" else "only with ") + ", ".join(map(code, sorted(others.split()))))
            yield code(name), value_text(value, said[0]), "; ".join(said)

    def choices(self):
        """(argument, [(choice, meaning)]) of those whose help lists choices line by line."""
        for argument, meaning in self.sections.get("Positionals", []) + self.sections.get("Options", []):
            if len(meaning) > 1:
                yield argument.split()[0], [(code(name), what) for name, _, what in (line.strip().partition(": ") for line in meaning[1:])]

    def subcommands(self):
        return [(name.split(",")[0], " ".join(meaning)) for name, meaning in self.sections.get("Subcommands", [])]


def value_text(value, meaning):
    """`TEXT:{a,b}` and `INT:INT in [1 - 9] ... REQUIRED` as a reader wants them; words that the meaning has are not listed again."""
    several, required = " ..." in value, "REQUIRED" in value
    value = re.sub(r" ?\.\.\.| ?REQUIRED", "", value).strip()
    sort, _, valid = value.partition(":")
    among = re.fullmatch(r"\{(.*)\}", valid)
    within = re.fullmatch(r"\w+ in \[(.*) - (.*)\]( x \d+)?", valid)
    if among:
        words = among.group(1).split(",")
        text = "word" if all(re.search(rf"\b{re.escape(word)}\b", meaning) for word in words) else " | ".join(words)
    else:
        text = {"TEXT": "text", "INT": "whole number", "UINT": "whole number", "FLOAT": "number"}.get(sort, sort.replace("FLOAT", "number"))
        if within:
            text += f" {within.group(1)}..{within.group(2)}{within.group(3) or ''}"
        elif valid:
            text = {"POSITIVE": f"{text} > 0", "DURATION": "time", "DIR": "folder"}.get(valid, f"{text} ({valid})")
    return text + (", several" if several else "") + (", required" if required else "")


def command_lines(takt, path, level):
    """The section of a command, and those of its own commands."""
    told = Help(said_by(takt, *path, "--help"))
    yield from ["", f"{'#' * level} takt {' '.join(path)}", "", sentence("; ".join(told.purpose))]
    examples = [line.removeprefix("Example: ") for line in told.remarks if line.startswith("Example: ")]
    remarks = [line for line in told.remarks if not line.startswith("Example: ")]
    if not told.subcommands():
        yield from ["", f"    takt {' '.join(path)} [OPTIONS]{told.usage}"]
    if examples:
        yield from ["", "For example:" if len(examples) == 1 else "Examples:", ""]
        yield from (f"    {example}" for example in examples)
    if remarks:
        yield from ["", *remarks]
    if rows := list(told.arguments()):
        yield from ["", *table(("argument", "value", "meaning"), rows)]
    for argument, rows in told.choices():
        yield from ["", *table((argument, "meaning"), rows)]
    for name, _ in told.subcommands():
        yield from command_lines(takt, (*path, name), level + 1)


def commands(takt, _):
    listed = Help(said_by(takt, "--help")).subcommands()
    yield from ["", *table(("command", "what it does"), [(f"[{name}](#takt-{name})", purpose) for name, purpose in listed])]
    for name, _ in listed:
        yield from command_lines(takt, (name,), 2)


# Node types and device kinds.


def listed_types(takt, heading):
    """Names below the heading `node types` or `device kinds` of `takt nodes`."""
    section = re.search(rf"^{heading}\n((?:  .*\n)+)", said_by(takt, "nodes"), flags=re.M).group(1)
    return [line.split()[0] for line in section.splitlines()]


def below(lines, first):
    """The rows below the heading that begins with that word, cut at the columns of the heading."""
    number = next((n for n, line in enumerate(lines) if line.split()[0] == first), None)
    if number is None:
        return [], []
    starts = [m.start() for m in re.finditer(r"(?<=  )\S", lines[number])]
    cut = [[line[a:b].strip() for a, b in zip(starts, [*starts[1:], None])] for line in lines[number:]]
    return cut[0], cut[1:]


def room_of(source, folder, pattern):
    """The README of the folder whose sources match the pattern; else none."""
    for path in sorted((source / folder).rglob("*.cpp")):
        if re.search(pattern, path.read_text()):
            for above in path.relative_to(source).parents:
                if len(above.parts) > 1 and (source / above / "README.md").exists():
                    return f"[{above}](../../{above}/README.md)"
    return None


def type_lines(takt, name, first, room):
    """Yields the beginning of a section; returns heading and rows of the table of `takt nodes NAME`, and what stands above it."""
    title, *lines = said_by(takt, "nodes", name).splitlines()
    layer, doc = re.fullmatch(r"\w+ \((\w+) layer\): (.*)", title).groups()
    head, rows = below(lines, first)
    yield from ["", f"## {name}", "", sentence(doc), ""]
    if first == "parameter":
        yield f"Layer: {layer}." + (f" How it works, how well: {room}." if room else "")
    elif room:
        yield f"More: {room}."
    upper = [(re.split(r" {2,}", line.strip()) + [""])[:4] for line in lines[: len(lines) - len(rows) - bool(head)]]
    return head, rows, upper


def nodes(takt, source):
    for name in listed_types(takt, "node types"):
        room = room_of(source, "nodes", rf'"{name}",\s*Layer::')
        head, rows, upper = yield from type_lines(takt, name, "parameter", room)
        ports = [row for row in upper if row[0] in ("in", "out")]
        levels = [row for row in upper if row[0].startswith("level")]
        yield from ["", *table(("port", "", "message", "meaning"), [(code(p[1]), p[0], p[2], p[3]) for p in ports])]
        if levels:
            yield from ["", *table(("level", "name", "cost", "meaning"), [(row[0].split()[1], code(row[1]), *row[2:]) for row in levels])]
        if rows:
            yield from ["", *table(head, [(code(row[0]), *row[1:]) for row in rows])]


def devices(takt, source):
    for name in listed_types(takt, "device kinds"):
        room = room_of(source, "hal", rf'\{{"{name}",')
        head, rows, upper = yield from type_lines(takt, name, "setting", room)
        yield from ["", *table(("driver", "what it is"), [(code(row[1]), row[2]) for row in upper])]
        yield from ["", *table(head, [(code(row[0]), *row[1:]) for row in rows])]


PAGES = {"docs/commands.md": commands, "docs/reference/nodes.md": nodes, "docs/reference/devices.md": devices}


def main():
    source, takt, check = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:] == ["--check"]
    wrong = [bring(source / name, "reference.py", make(takt, source), check) for name, make in PAGES.items()]
    print("\n".join(filter(None, wrong)) or f"reference: {'as takt says' if check else 'written'}")
    return any(wrong)


sys.exit(main())
