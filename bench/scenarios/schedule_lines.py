# SPDX-License-Identifier: Apache-2.0
"""A schedule file by its lines `  NODE: {key: value, ...}`, to be written again with some of it changed. Whoever names a node or
key that is not there is told so and ends: a scenario that changed nothing would say nothing.

    schedule = schedule_lines.Schedule(file)
    schedule.nodes["stereo"]["budget"]                    "16ms"
    schedule.change("stereo", budget="12ms")              None takes a key away
    schedule.write(other_file)
"""
import re
import sys
from fractions import Fraction

UNITS = {"us": Fraction(1, 1_000_000), "ms": Fraction(1, 1000), "s": Fraction(1)}
LINE = re.compile(r"^  (\w+): *\{(.*)\} *(?:#.*)?$")


def seconds(text):
    """"16ms", "1/15 s" -> a fraction of seconds."""
    number, unit = re.fullmatch(r"([\d./]+) *(us|ms|s)", text).groups()
    return Fraction(number) * UNITS[unit]


def in_us(duration):
    """The reverse, to the nearest microsecond."""
    return f"{round(duration * 1_000_000)}us"


class Schedule:
    def __init__(self, file):
        self.file, self.nodes = file, {}
        self.lines = open(file).read().splitlines()
        for line in self.lines:
            if match := LINE.match(line):
                self.nodes[match[1]] = dict(pair.split(": ", 1) for pair in match[2].split(", "))
        if not self.nodes:
            sys.exit(f"{file}: no line of the form `  NODE: {{key: value}}`; mend bench/scenarios")

    def change(self, node, **values):
        if missing := [what for what in (node, *values) if what not in {node: 0, **self.nodes.get(node, {})} or node not in self.nodes]:
            sys.exit(f"{self.file}: no `{missing[0]}` of `{node}`, there are {', '.join(self.nodes.get(node, self.nodes))}; mend bench/scenarios")
        for key, value in values.items():
            if value is None: del self.nodes[node][key]
            else: self.nodes[node][key] = value

    def write(self, file):
        def text(line):
            match = LINE.match(line)
            return f"  {match[1]}: {{{', '.join(f'{k}: {v}' for k, v in self.nodes[match[1]].items())}}}" if match else line
        with open(file, "w") as out:
            out.write("\n".join(map(text, self.lines)) + "\n")
