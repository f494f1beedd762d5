#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takt as an outsider meets it: follows docs/own_project.md to the letter, counts steps and seconds.

    outsider.py                  in a bare Debian 12 (debootstrap, chroot), made for this and removed afterwards; needs root
    outsider.py --root FOLDER    in that bare Debian, which is made if it is not there, and stays
    outsider.py --here           on this machine, in a home of its own
    outsider.py --page PAGE      another page, such as docs/start.md

Every line of the page's ```sh blocks is a step, run by one shell after the other in a folder of its own; what a step exports
and where it changes to holds for the next ones. A block with a here-document or a background job is one step. A checkout of the last commit lies there as ~/takt. With --build FOLDER that
finished build of this checkout is installed, and Takt is not built: an hour less. Without --page it prints at the end what the
project and the smallest program on `core` cost (tests/tools/hello_cost.py). Exit 1 if a step fails, or something costs too much."""
import argparse
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ("docs/own_project.md", "docs/start.md")
LIMIT_S = 3600


def steps_of(text):
    """[(heading, command)]; a line that ends with \\ goes on in the next one."""
    steps, heading, block = [], "", None
    for line in text.splitlines():
        if line.startswith("```"):
            if block: steps += [(heading, command) for command in commands_of("\n".join(block))]
            block = [] if line == "```sh" else None
        elif block is not None: block.append(line)
        elif line.startswith("#"): heading = line.lstrip("# ")
    return steps


def commands_of(block):
    if "<<" in block or re.search(r"[^&]&$", block, flags=re.M): return ["set -e\n" + block]
    return [line for line in block.replace("\\\n", "").splitlines() if line.strip()]


class Shell:
    """One shell after the other, each in the folder and with the variables that the last one left. `enter`: a command that
    runs a script of that home (chroot), before its name."""

    def __init__(self, home, seen_as, enter):
        self.home, self.seen_as, self.enter = home, seen_as, enter
        (home / ".state").write_text(f"cd {shlex.quote(seen_as)}/takt\nexport HOME={shlex.quote(seen_as)}\n")

    def run(self, command):
        state = shlex.quote(f"{self.seen_as}/.state")
        # The state is kept also where the command fails: the table names that step, and the rest is not run.
        script = f". {state}\n{command}\ncode=$?\n{{ export -p; printf 'cd %q\\n' \"$PWD\"; }} > {state}\nexit $code\n"
        begin = time.monotonic()
        try:
            ended = subprocess.run([*self.enter, "bash", "-c", script], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LIMIT_S)
            code, said = ended.returncode, ended.stdout
        except subprocess.TimeoutExpired as late:
            code, said = -1, f"{(late.stdout or b'').decode(errors='replace')}\nnot done after {LIMIT_S} s"
        return code, said, time.monotonic() - begin


def make_debian(folder):
    if (folder / "etc/debian_version").exists(): return
    if not shutil.which("debootstrap"): sys.exit("debootstrap is missing: apt-get install debootstrap (or use --here)")
    subprocess.run(["debootstrap", "--variant=minbase", "--include=ca-certificates", "bookworm", str(folder)], check=True, stdout=subprocess.DEVNULL)


class Mounted:
    """What programs of a bare system expect to be there, and these folders of this machine, while this lives."""

    PLACES = ("/proc", "/sys", "/dev", "/dev/shm")

    def __init__(self, folder, shown=()):
        self.folder, self.shown, self.mounted = folder, shown, []

    def __enter__(self):
        for place in (*self.PLACES, *self.shown):
            there = self.folder / str(place).lstrip("/")
            there.mkdir(parents=True, exist_ok=True)
            subprocess.run(["mount", "--bind", str(place), str(there)], check=True)
            self.mounted.append(there)
        shutil.copy("/etc/resolv.conf", self.folder / "etc/resolv.conf")
        return self

    def __exit__(self, *_):
        for place in reversed(self.mounted): subprocess.run(["umount", "--lazy", str(place)], check=False)
        if str(self.folder) not in pathlib.Path("/proc/self/mountinfo").read_text(): return
        print(f"something is still mounted below {self.folder}: it stays, and so does what is mounted", flush=True)
        os._exit(1)


def check_out(home, build):
    """The last commit as ~/takt, with that finished build as its own."""
    for old in ("takt", "takt-0.2", "robot", "hello_core"): shutil.rmtree(home / old, ignore_errors=True)
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(home / "takt")], check=True)
    if build:
        (home / "takt/build").mkdir()
        (home / "takt/build/release").symlink_to(build)


def step(shell, heading, command):
    """A row of the table: (heading, command, seconds, exit code)."""
    print(f"$ {command}", flush=True)
    code, said, seconds = shell.run(command)
    lines = said.rstrip().splitlines()
    print("\n".join(f"  {line}" for line in (lines if code or len(lines) <= 8 else lines[:3] + ["..."] + lines[-4:])), flush=True)
    return heading, command, seconds, code


def follow(shell, steps, built):
    """The rows of the table, up to the first step that fails."""
    rows = []
    for heading, command in steps:
        # What was built already is not built again; what it needs of the system is installed.
        if built and command.startswith("./takt "): command = "TAKT_BUILD=$HOME/packages ./takt packages"
        rows.append(step(shell, heading, command))
        if rows[-1][3]: break
    return rows


# What the hello programs cost: the project that the page has made, and the smallest one on `core`.
COSTS = (
    "python3 ~/takt/tests/tools/hello_cost.py ~/robot/build/robot ~/robot/robot.yaml",
    "cp -r ~/takt/examples/hello_core ~ && cmake -S ~/hello_core -B ~/hello_core/build && cmake --build ~/hello_core/build",
    "python3 ~/takt/tests/tools/hello_cost.py ~/hello_core/build/hello_core",
)


def table(rows):
    rows = [(heading, command.removeprefix("set -e\n").splitlines()[0], seconds, code) for heading, command, seconds, code in rows]
    width = max(len(command) for _, command, _, _ in rows)
    lines = [f"{'step':>4}  {'command':<{width}}  {'seconds':>8}  exit"]
    lines += [f"{number:>4}  {command:<{width}}  {seconds:>8.1f}  {code}" for number, (_, command, seconds, code) in enumerate(rows, 1)]
    lines.append(f"{len(rows)} steps, {sum(row[2] for row in rows):.1f} s")
    return "\n".join(lines)


def outsider(page, home, seen_as, enter, build):
    """Exit code of all."""
    check_out(home, build)
    shell = Shell(home, seen_as, enter)
    steps = steps_of((ROOT / page).read_text())
    rows = follow(shell, steps, build)
    print("\n" + table(rows) + "\n", flush=True)
    failed = [row for row in rows if row[3]]
    if not failed and page == PAGES[0]: failed = [row for row in (step(shell, "cost", command) for command in COSTS) if row[3]]
    for _, command, _, code in failed: print(f"FAILED with exit {code}: {command}")
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--here", action="store_true")
    parser.add_argument("--root", type=pathlib.Path)
    parser.add_argument("--build", type=pathlib.Path)
    parser.add_argument("--page", choices=PAGES, default=PAGES[0])
    asked = parser.parse_args()
    if asked.here and asked.root: parser.error("--root has no --here")
    build = asked.build and asked.build.resolve()
    if build and not (build / "cmake_install.cmake").exists(): parser.error(f"{build} is no build folder")
    assert steps_of("# A\n```sh\ncd x\nb \\\n c\n```\n```text\nd\n```\n") == [("A", "cd x"), ("A", "b  c")]
    assert steps_of("```sh\na &\nwait\n```\n") == [("", "set -e\na &\nwait")]
    if not any(command.startswith("takt new robot") for _, command in steps_of((ROOT / asked.page).read_text())): sys.exit(f"{asked.page} no longer makes a project robot")
    with tempfile.TemporaryDirectory(prefix="takt_outsider.") as scratch:
        if asked.here: return outsider(asked.page, pathlib.Path(scratch), scratch, ["env", "-u", "TAKT_HOME", "-u", "CMAKE_PREFIX_PATH"], build)
        if os.geteuid() != 0: sys.exit("a chroot needs root; or use --here")
        debian = (asked.root or pathlib.Path(scratch) / "debian").resolve()
        make_debian(debian)
        enter = ["chroot", str(debian), "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8"]
        with Mounted(debian, (ROOT, build) if build else ()): return outsider(asked.page, debian / "root", "/root", enter, build)


if __name__ == "__main__": sys.exit(main())
