#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the examples as their READMEs say: examples.py PREFIX [EXAMPLE...]

    examples.py /opt/takt                  all of them, against the Takt that is installed there
    examples.py --install build hello_node installs what stands in build/ into a scratch prefix first
    examples.py --check                    only whether each README has commands and output; and whether this program sees a mistake

Every ```sh block of examples/NAME/README.md is run by bash in a copy of the example's folder, which goes afterwards. The
```text block that follows it is what must be printed, line by line: `...` in a line stands for any text, a line of `...` alone
for any number of lines. A block must end with exit 0; `echo "exit $?"` shows another one. All blocks of a README share the
folder. PATH, CMAKE_PREFIX_PATH and PKG_CONFIG_PATH lead to the prefix. An example whose README has `<!-- needs: COMMAND -->`
is skipped where there is no such command. Exit 1: an example prints something else (the first difference is shown), or has no
block. 77: all were skipped."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import shutil
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
BLOCK = re.compile(r"^```(sh|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NEEDS = re.compile(r"^<!-- needs: (\S+) -->$", re.MULTILINE)
LIMIT_S = 300


def steps_of(text):
    """[(commands, expected output or None)]"""
    steps = []
    for kind, content in BLOCK.findall(text):
        if kind == "sh":
            steps.append((content, None))
        elif steps and steps[-1][1] is None:
            steps[-1] = (steps[-1][0], content)
    return steps


def line_fits(line, expected):
    return re.fullmatch(".*".join(re.escape(part) for part in expected.rstrip().split("...")), line.rstrip()) is not None


def first_difference(printed, expected):
    """None, or (expected line, printed line) where they part."""
    said, wanted = printed.splitlines(), expected.splitlines()
    reached = {0}  # how many lines of `said` may be used up so far
    for number, line in enumerate(wanted):
        if line.strip() == "...":
            reached = set(range(min(reached), len(said) + 1))
            continue
        after = {at + 1 for at in reached if at < len(said) and line_fits(said[at], line)}
        if not after:
            at = min(reached)
            return line, said[at] if at < len(said) else "(nothing more)"
        reached = after
    if len(said) in reached:
        return None
    return "(nothing more)", said[max(reached)]


def environment(prefix):
    def first(name, *folders):
        return os.pathsep.join([str(prefix / folder) for folder in folders] + [path for path in [os.environ.get(name)] if path])

    pkgconfig = [path.relative_to(prefix) for path in prefix.glob("lib*/**/pkgconfig")]
    python = [path.relative_to(prefix) for path in prefix.glob("lib*/python3*/*-packages")]
    return {**os.environ, "PATH": first("PATH", "bin"), "CMAKE_PREFIX_PATH": first("CMAKE_PREFIX_PATH", "."), "PKG_CONFIG_PATH": first("PKG_CONFIG_PATH", *pkgconfig),
            "PYTHONPATH": first("PYTHONPATH", *python), "TAKT_PREFIX": str(prefix), "TERM": "dumb", "LC_ALL": "C.UTF-8"}


def run_example(example, prefix):
    """How often it went wrong."""
    readme = example / "README.md"
    steps = steps_of(readme.read_text())
    with tempfile.TemporaryDirectory(prefix=f"takt_{example.name}.") as folder:
        place = pathlib.Path(folder) / example.name
        shutil.copytree(example, place)
        for commands, expected in steps:
            begin = time.monotonic()
            try:
                ended = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", commands], cwd=place, env=environment(prefix), text=True, stdin=subprocess.DEVNULL,
                                       stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LIMIT_S)
                printed, code = ended.stdout, ended.returncode
            except subprocess.TimeoutExpired as late:
                printed, code = (late.stdout or b"").decode() if isinstance(late.stdout, bytes) else late.stdout or "", f"none after {LIMIT_S} s"
            difference = first_difference(printed, expected) if expected is not None else None
            good = code == 0 and difference is None
            print(f"{'ok    ' if good else 'FAILED'} {example.name}: {commands.strip().splitlines()[0]} ({time.monotonic() - begin:.1f} s)", flush=True)
            if good: continue
            print(f"  {readme.relative_to(ROOT)}: exit {code}")
            if difference: print(f"  expected: {difference[0]}\n  printed:  {difference[1]}")
            print("  all of it:\n" + "\n".join(f"    {line}" for line in printed.splitlines()[-60:]))
            return 1
    return 0


def missing_commands(readme):
    return [command for command in NEEDS.findall(readme) if shutil.which(command) is None]


def check_itself():
    """What this program must see."""
    text = "a\n```sh\nls\n```\nb\n```text\none 1\n...\nlast\n```\n```sh\ntrue\n```\n"
    assert missing_commands(text) == [] and missing_commands("<!-- needs: sh -->\n<!-- needs: no-such-one -->\n") == ["no-such-one"]
    assert steps_of(text) == [("ls\n", "one 1\n...\nlast\n"), ("true\n", None)]
    for printed, expected, same in (("one 1\nlast\n", "one ...\n...\nlast\n", True), ("one 1\nx\ny\nlast\n", "one ...\n...\nlast\n", True), ("one\n", "two\n", False),
                                    ("one\ntwo\n", "one\n", False), ("one\n", "one\ntwo\n", False), ("a.b\n", "a+b\n", False), ("x\nx\ny\n", "...\nx\ny\n", True), ("", "", True)):
        assert (first_difference(printed, expected) is None) == same, (printed, expected)


def check_readmes(examples):
    failed = 0
    for example in examples:
        steps = steps_of((example / "README.md").read_text()) if (example / "README.md").exists() else []
        if not any(expected is not None for _, expected in steps):
            print(f"examples/{example.name}/README.md shows no command with its output (a ```sh block and a ```text block)")
            failed += 1
    return failed


def main(arguments):
    check_itself()
    every = sorted(path for path in EXAMPLES.iterdir() if path.is_dir())
    if arguments == ["--check"]: return 1 if check_readmes(every) or not every else 0
    if not arguments or arguments[0].startswith("--") and (arguments[0] != "--install" or len(arguments) < 2):
        sys.exit(__doc__)
    install = arguments[0] == "--install"
    names = arguments[2 if install else 1:]
    unknown = [name for name in names if name not in [path.name for path in every]]
    if unknown: sys.exit(f"no example {', '.join(unknown)}; there are {', '.join(path.name for path in every)}")
    chosen = [path for path in every if not names or path.name in names]
    failed = check_readmes(chosen)
    for example in list(chosen):
        if missing := missing_commands((example / "README.md").read_text()):
            print(f"SKIPPED {example.name}: this machine has no {', '.join(missing)}")
            chosen.remove(example)
    if not chosen: return 1 if failed else 77
    if install:
        with tempfile.TemporaryDirectory(prefix="takt_prefix.") as prefix:
            subprocess.run(["cmake", "--install", arguments[1], "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
            failed += sum(run_example(example, pathlib.Path(prefix)) for example in chosen)
    else:
        failed += sum(run_example(example, pathlib.Path(arguments[0]).resolve()) for example in chosen)
    return 1 if failed else 0


sys.exit(main(sys.argv[1:]))
