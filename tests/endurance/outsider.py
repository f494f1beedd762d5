#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takt as an outsider meets it: follows docs/own_project.md to the letter, counts steps and seconds.

    outsider.py                  in a bare Debian 12 (debootstrap, chroot), made for this and removed afterwards; needs root
    outsider.py --root FOLDER    in that bare Debian, which is made if it is not there, and stays
    outsider.py --here           on this machine, in a home of its own

Every line of the page's ```sh blocks is a step, run by one shell after the other in a folder of its own; what a step exports
and where it changes to holds for the next ones. A checkout of the last commit lies there as ~/takt. With --build FOLDER it
takes that finished build for its own: what is timed then is not Takt's build. Exit 1 if a step fails."""
import argparse
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = "docs/own_project.md"
LIMIT_S = 3600


def steps_of(text):
    """[(heading, command)]; a line that ends with \\ goes on in the next one."""
    steps, heading, inside, command = [], "", False, ""
    for line in text.splitlines():
        if line.startswith("```"): inside = line == "```sh"
        elif not inside and line.startswith("#"): heading = line.lstrip("# ")
        elif inside and line.strip():
            command += line.rstrip("\\") if line.endswith("\\") else line
            if not line.endswith("\\"):
                steps.append((heading, command))
                command = ""
    return steps


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
    """What programs of a bare system expect to be there, while this lives."""

    PLACES = ("proc", "sys", "dev", "dev/shm")

    def __init__(self, folder):
        self.folder, self.mounted = folder, []

    def __enter__(self):
        for place in self.PLACES:
            subprocess.run(["mount", "--bind", f"/{place}", str(self.folder / place)], check=True)
            self.mounted.append(self.folder / place)
        shutil.copy("/etc/resolv.conf", self.folder / "etc/resolv.conf")
        return self

    def __exit__(self, *_):
        for place in reversed(self.mounted): subprocess.run(["umount", "--lazy", str(place)], check=False)


def check_out(home, build):
    checkout = home / "takt"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(checkout)], check=True)
    if build:
        (checkout / "build").mkdir()
        (checkout / "build/release").symlink_to(build.resolve())


def follow(shell, built):
    """The rows of the table: (heading, command, seconds, exit code)."""
    rows = []
    for heading, command in steps_of((ROOT / PAGE).read_text()):
        if built and command.startswith("./takt "): continue  # it would build
        print(f"$ {command}", flush=True)
        code, said, seconds = shell.run(command)
        rows.append((heading, command, seconds, code))
        lines = said.rstrip().splitlines()
        print("\n".join(f"  {line}" for line in (lines if code or len(lines) <= 8 else lines[:3] + ["..."] + lines[-4:])), flush=True)
        if code: break
    return rows


def table(rows):
    width = max(len(command) for _, command, _, _ in rows)
    lines = [f"{'step':>4}  {'command':<{width}}  {'seconds':>8}  exit"]
    lines += [f"{number:>4}  {command:<{width}}  {seconds:>8.1f}  {code}" for number, (_, command, seconds, code) in enumerate(rows, 1)]
    lines.append(f"{len(rows)} steps, {sum(row[2] for row in rows):.1f} s")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--here", action="store_true")
    parser.add_argument("--root", type=pathlib.Path)
    parser.add_argument("--build", type=pathlib.Path)
    asked = parser.parse_args()
    if asked.here and asked.root or asked.build and not asked.here: parser.error("--root has no --here, and --build needs it")
    assert steps_of("# A\n```sh\ncd x\nb \\\n c\n```\n```text\nd\n```\n") == [("A", "cd x"), ("A", "b  c")]
    steps = steps_of((ROOT / PAGE).read_text())
    if not any("cp -r examples/" in command for _, command in steps): sys.exit(f"{PAGE} no longer copies an example")
    with tempfile.TemporaryDirectory(prefix="takt_outsider.") as scratch:
        if asked.here:
            home = pathlib.Path(scratch)
            check_out(home, asked.build)
            rows = follow(Shell(home, str(home), ["env", "-u", "TAKT_HOME", "-u", "CMAKE_PREFIX_PATH"]), asked.build)
        else:
            if os.geteuid() != 0: sys.exit("a chroot needs root; or use --here")
            debian = (asked.root or pathlib.Path(scratch) / "debian").resolve()
            make_debian(debian)
            home = debian / "root"
            for old in ("takt", "takt-0.2", "kitchen"): shutil.rmtree(home / old, ignore_errors=True)
            check_out(home, None)
            with Mounted(debian): rows = follow(Shell(home, "/root", ["chroot", str(debian), "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8"]), None)
    print("\n" + table(rows))
    done = len(rows) == len(steps) - (sum(command.startswith("./takt ") for _, command in steps) if asked.build else 0)
    if rows[-1][3] or not done: sys.exit(f"step {len(rows)} failed: {rows[-1][1]}")


main()
