#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Follows the guides (docs/guides.md) to the letter: guides.py [CLONE]

Writes their files, makes their edits with the words that they give, and runs their commands, whose output it prints. Not
part of `takt test`, since it builds everything: in a clone of its own, which goes afterwards, or in CLONE, which keeps the
edits. Exit 1 if a command does not end as the guide says, or a guide has lost the words of a step."""
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
GUIDES = "docs/guides.md"


class Clone:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.failed = 0

    def said(self, document, pattern):
        """What the document says there."""
        found = re.search(pattern, (self.folder / document).read_text(), re.DOTALL)
        if not found: sys.exit(f"{document} no longer says {pattern}")
        return found[1]

    def replace(self, file, old, new):
        path = self.folder / file
        text = path.read_text()
        if text.count(old) != 1: sys.exit(f"{file} has {old!r} {text.count(old)} times, and the guide speaks of one")
        path.write_text(text.replace(old, new))

    def insert(self, file, after, text):
        self.replace(file, after, after + text)

    def run(self, command, code=0, output="", beside=None):
        """`output`: what it must print. `beside`: (seconds later, a command that must end with 0 meanwhile)."""
        begin = time.monotonic()
        print(f"$ {command}", flush=True)
        child = subprocess.Popen(command, shell=True, cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if beside:
            time.sleep(beside[0])
            self.run(beside[1])
        said = child.communicate()[0]
        lines = said.rstrip().split("\n")
        print("\n".join(f"  {line}" for line in (lines if len(lines) <= 16 else lines[:8] + ["..."] + lines[-7:])))
        good = child.returncode == code and re.search(output, said)
        print(f"  -- exit {child.returncode}, {time.monotonic() - begin:.1f} s" + ("" if good else f"; FAILED: not exit {code} with {output!r}"), flush=True)
        self.failed += not good


def follow_node(clone):
    print("\n== a node")
    (clone.folder / "nodes/brightness/CMakeLists.txt").write_text(clone.said(GUIDES, r"`(takt_room\(brightness [^`]*)`") + "\n")
    clone.insert("graph/crossing.yaml", "  street:\n", "    " + clone.said(GUIDES, r"`(brightness: \{type[^`]*)`") + "\n")
    clone.insert("schedules/crossing.yaml", "nodes:\n", "  " + clone.said(GUIDES, r"`(brightness: \{rate[^`]*)`") + "\n")
    clone.run("./takt nodes brightness", output="gain")
    echo = clone.said(GUIDES, r"`(\./takt echo brightness\.image [^`]*)`")
    # 1 is a deadline that this machine missed, which is not the guide's.
    clone.run(f"{clone.said(GUIDES, r'While `([^`]*)` goes on')} --for 12s || [ $? -eq 1 ]", output="brightness", beside=(6, echo))
    clone.run("file bright.png || ls -l bright.png", output="bright.png")


def follow_message(clone):
    print("\n== a message")
    (clone.folder / "nodes/sharpness/CMakeLists.txt").write_text(clone.said(GUIDES, r"`(takt_room\(sharpness [^`]*)`") + "\n")
    clone.run("./takt nodes sharpness", output="sharpness +sharpness")


def follow_driver(clone):
    print("\n== a driver")
    (clone.folder / "hal/laser/tube/CMakeLists.txt").write_text(clone.said(GUIDES, r"`(takt_room\(tube [^`]*)`") + "\n")
    clone.insert("graph/lasers.yaml", "\nprofiles:\n", "  " + clone.said(GUIDES, r"below `profiles:`\n\n *(tube: [^\n]*)\n") + "\n")
    clone.run(clone.said(GUIDES, r"Then `([^`]*)` runs the suite"), output="100% tests passed")
    clone.run(clone.said(GUIDES, r"`(\./takt nodes laser_scanner)`"), output="a scanner in a tube")
    clone.run(clone.said(GUIDES, r"`(\./takt run graph/lasers.yaml --profile tube [^`]*)`") + " || [ $? -eq 1 ]", output="front_laser")
    lines = (clone.folder / "graph/lasers.yaml").read_text().splitlines()
    in_the_profile, of_the_device = (rf"lasers\.yaml:{next(n for n, line in enumerate(lines, 1) if word in line)}:"
                                     for word in ("radius: 2m}", "front_laser: {kind"))
    for wrong, command, line in (("2cm3", clone.said(GUIDES, r"refused by `([^`]*)`"), in_the_profile),
                                 ("-1m", "./takt run graph/lasers.yaml --profile tube --for 1s", of_the_device)):
        clone.replace("graph/lasers.yaml", "radius: 2m}", f"radius: {wrong}}}")
        clone.run(command, 2, line)
        clone.replace("graph/lasers.yaml", f"radius: {wrong}}}", "radius: 2m}")


def follow_evaluation(clone):
    print("\n== an evaluation")
    header, source = "graph/evaluate/command_line.hpp", "graph/evaluate/command_line.cpp"
    clone.insert(header, "#pragma once\n", '#include "graph/evaluate/pair.hpp"\n')
    clone.insert(header, "struct Evaluations {\n", "  " + clone.said(GUIDES, r"add `(EvalPairOptions[^`]*)`") + "\n")
    added = re.sub(r"^   ", "", clone.said(GUIDES, r"   ```\n(   void add_pair.*?)   ```"), flags=re.MULTILINE)
    clone.replace(source, "\n}  // namespace\n\nvoid add_evaluations", f"\n{added}\n}}  // namespace\n\nvoid add_evaluations")
    clone.insert(source, "  add_mapping(eval, o.mapping, exit_code);\n", "  " + clone.said(GUIDES, r"and add `(add_pair[^`]*)`") + "\n")
    command = "./takt eval " + clone.said(GUIDES, r"then knows `([^`]*)`")
    clone.run(command, output="of the pixels are off")
    clone.run(command + " --json", output='"bad_1px_pct"')
    clone.run("./takt eval pair --noise 90", 2, "--noise")


def follow(folder):
    clone = Clone(folder)
    subprocess.run([sys.executable, ROOT / "tests/tools/code_blocks.py", folder, clone.folder / GUIDES], check=True)
    for guide in (follow_node, follow_message, follow_driver, follow_evaluation): guide(clone)
    print(f"\n{clone.failed} commands failed" if clone.failed else "\nall guides work as written")
    return clone.failed > 0


if len(sys.argv) > 1: sys.exit(follow(sys.argv[1]))
with tempfile.TemporaryDirectory(prefix="guides-") as work:
    subprocess.run(["git", "clone", "-q", ROOT, work + "/clone"], check=True)
    sys.exit(follow(work + "/clone"))
