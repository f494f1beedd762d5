#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether test cases depend on each other: on their order, or on a case that ran before them in the same process.

each_case.py shuffle [--seeds 10] [--first-seed 1] PROGRAM...
    each doctest program once per seed, its cases in random order
each_case.py alone PROGRAM...
    each case of each program in a process of its own

PROGRAM is a doctest program, or a build folder: all programs of its tests. Both commands take
--jobs N        runs at a time (default 2)
--shard K/N     every N-th run, beginning with the K-th (1 to N): for several machines

Per program the number of runs and failures; of each failure the cases and the command to repeat it. The last line is
`N passed, N failed`. Exit 1 if anything failed, 2 on bad usage. A program that exits 77 when asked for its cases has
nothing to run here (tests/recorded without recordings) and is listed as skipped.
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

KINDS = ("unit", "property", "conformance", "recorded")
SKIPPED = 77
FLAGS = ["--no-intro=true", "--no-colors=true"]


def usage(what):
    print(f"each_case.py: {what}", file=sys.stderr)
    sys.exit(2)


def positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not positive")
    return value


def shard(text):
    match = re.fullmatch(r"(\d+)/(\d+)", text)
    if not match or not 1 <= int(match[1]) <= int(match[2]):
        raise argparse.ArgumentTypeError(f"{text} is not K/N with K from 1 to N")
    return int(match[1]), int(match[2])


def programs_of(arguments):
    programs = []
    for argument in map(pathlib.Path, arguments):
        if argument.is_dir():
            found = [path for folder in (argument, argument / "tests") for path in folder.glob("*_*")
                     if path.name.split("_")[0] in KINDS and path.is_file() and os.access(path, os.X_OK)]
            if not found:
                usage(f"{argument}: holds no test programs; give a build folder, or build its tests first")
            programs += sorted(found)
        elif argument.is_file() and os.access(argument, os.X_OK):
            programs.append(argument)
        else:
            usage(f"{argument}: is neither a program nor a folder")
    return [path.absolute() for path in programs]


def call(command):
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return done.returncode, done.stdout.decode(errors="replace")


def cases_of(program):
    """Names in the order of --order-by=name; None if the program has nothing to run here."""
    code, text = call([program, "--list-test-cases", "--order-by=name", *FLAGS])
    if code == SKIPPED:
        return None
    names = text.split("=" * 79 + "\n")[1].splitlines() if code == 0 and text.count("=" * 79) == 2 else []
    count = re.search(r"test cases passing the current filters: (\d+)", text)
    if not count or len(names) != int(count[1]):
        usage(f"{program}: does not list its test cases as doctest programs do")
    return names


class Run:
    """One process: a program with a filter or an order, and the cases that it must execute."""

    def __init__(self, program, arguments, cases):
        self.program, self.arguments, self.cases = program, arguments, cases

    def problem(self):
        """What went wrong: one line, then texts of detail; empty if nothing did."""
        with tempfile.NamedTemporaryFile("r", errors="replace") as report:  # apart from what cases and their children print
            code, text = call([self.program, *self.arguments, "--duration=true", f"--out={report.name}", *FLAGS])
            told = report.read()
        executed = re.findall(r"^\d+\.\d{6} s: (.*)$", told, re.M)
        text += told
        failed = [block for block in re.split(r"^=+\n", text, flags=re.M) if re.search(r" (FATAL )?ERROR: ", block)]
        if code != 0:
            names = list(dict.fromkeys(re.findall(r"^TEST CASE:  (.*)$", "\n".join(failed), re.M)))
            if len(self.cases) == 1:
                names = self.cases
            how = f"signal {-code}" if code < 0 else f"exit {code}"
            return [f"{'; '.join(names) or 'in no case that it names'} ({how})"] + (failed or [text])
        if sorted(executed) != sorted(self.cases):
            listed, ran = collections.Counter(self.cases), collections.Counter(executed)
            differ = sorted((listed - ran) + (ran - listed))
            return [f"executed {len(executed)} cases of {len(self.cases)}; not as often as listed: {'; '.join(differ)}", text]
        return []

    def command(self):
        return shlex.join([str(self.program), *self.arguments])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("shuffle", "alone"):
        command = commands.add_parser(name)
        command.add_argument("programs", nargs="+", metavar="PROGRAM")
        command.add_argument("--jobs", type=positive, default=2)
        command.add_argument("--shard", type=shard, default=(1, 1), metavar="K/N")
        if name == "shuffle":
            command.add_argument("--seeds", type=positive, default=10)
            command.add_argument("--first-seed", type=positive, default=1)
    given = parser.parse_args()

    runs, skipped = [], []
    for program in programs_of(given.programs):
        cases = cases_of(program)
        if cases is None:
            skipped.append(program)
        elif given.command == "shuffle":
            runs += [Run(program, ["--order-by=rand", f"--rand-seed={seed}"], cases)
                     for seed in range(given.first_seed, given.first_seed + given.seeds)]
        else:
            runs += [Run(program, ["--order-by=name", f"--first={k}", f"--last={k}"], [name])
                     for k, name in enumerate(cases, 1)]
    runs = runs[given.shard[0] - 1::given.shard[1]]

    passed = failed = 0
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        results = zip(runs, pool.map(Run.problem, runs))
        counts = {}
        for run, problem in results:
            count = counts.setdefault(run.program, [0, 0])
            count[0] += 1
            if problem:
                count[1] += 1
                print(f"FAILED: {run.program.name}: {problem[0]}\n  {run.command()}")
                for detail in problem[1:]:
                    print("\n".join(f"  | {line}" for line in detail.splitlines()[-40:]), flush=True)
            if count[0] == sum(other.program == run.program for other in runs):
                print(f"{run.program.name}: {count[0]} runs, {count[1]} failed", flush=True)
            passed += not problem
            failed += bool(problem)
    for program in skipped:
        print(f"{program.name}: skipped, exit {SKIPPED}")
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
