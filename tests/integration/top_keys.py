#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""takt top in a terminal of its own: pages, keys, sizes, and the terminal as it was before, however it ends.

  top_keys.py TAKT RUN CASE     CASE: pages, narrow, plain, term, hangup, suspended, held or stopped

Of `stopped` the run is stopped, by `takt stop`. Exit 1 where something is not as it should be. Nothing is timed: the
script waits until the screen has what it looks for, up to a minute.
"""
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time

PATIENCE_S = 60
PAGES = ["nodes", "chains", "timeline", "devices", "processes", "log", "parameters"]


class Screen:
    """What a terminal shows of the sequences that takt top sends; any other sequence is a mistake."""

    def __init__(self, columns, rows):
        self.columns, self.rows = columns, rows
        self.alternate, self.cursor, self.styled = False, True, False
        self.resized = False  # what comes until all is cleared was meant for the size before
        self.clear()

    def clear(self):
        self.resized = False
        self.cells = [[" "] * self.columns for _ in range(self.rows)]
        self.row = self.column = 0

    def text(self):
        return "\n".join("".join(line).rstrip() for line in self.cells)

    def put(self, c):
        if self.resized: return
        assert self.row < self.rows and self.column < self.columns, f"outside of the screen: {c!r} at {self.row}, {self.column}"
        self.cells[self.row][self.column] = c
        self.column += 1

    def take(self, data):
        """Returns the part that is not whole yet."""
        while data:
            if data[0] != "\x1b":
                if self.alternate and data[0] not in "\r\n": self.put(data[0])
                data = data[1:]
                continue
            whole = re.match(r"\x1b\[([?0-9;]*)([A-Za-z])", data)
            if not whole:
                assert len(data) < 20, data[:40]
                return data
            self.sequence(*whole.groups())
            data = data[whole.end():]
        return ""

    def sequence(self, parameters, final):
        known = {"?1049h": ("alternate", True), "?1049l": ("alternate", False), "?25l": ("cursor", False), "?25h": ("cursor", True)}
        if parameters + final in known:
            setattr(self, *known[parameters + final])
        elif final == "H":
            place = [int(n) for n in parameters.split(";")] if parameters else [1, 1]
            self.row, self.column = min(place[0], self.rows) - 1, place[1] - 1
        elif final == "J":
            self.clear()
        elif final == "K" and not self.resized:
            self.cells[self.row][self.column:] = [" "] * (self.columns - self.column)
        elif final in "Km":
            self.styled = self.styled or final == "m" and parameters != "0"
        else:
            raise AssertionError(f"unknown sequence {parameters}{final}")


class Top:
    """The command in a session of its own on a new terminal, which controls it. `shell`: started by that."""

    def __init__(self, takt, run, columns=80, rows=24, shell=(), **environment):
        self.near, self.far = pty.openpty()
        self.size(columns, rows)
        self.before = termios.tcgetattr(self.far)
        environment = {**os.environ, "TERM": "xterm", "LC_ALL": "C.UTF-8", **environment}
        self.process = subprocess.Popen([*shell, takt, "top", "--run", run], stdin=self.far, stdout=self.far,
                                        stderr=subprocess.PIPE, env=environment, start_new_session=True,
                                        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
        self.rest = b""

    def size(self, columns, rows):
        fcntl.ioctl(self.far, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.screen = Screen(columns, rows)
        self.unread = ""

    def resize(self, columns, rows):
        alternate = self.screen.alternate
        self.size(columns, rows)
        self.screen.alternate, self.screen.cursor, self.screen.resized = alternate, False, True
        self.process.send_signal(signal.SIGWINCH)

    def keys(self, text):
        os.write(self.near, text.encode())

    def read(self, wait_s):
        if not select.select([self.near], [], [], wait_s)[0]: return
        self.rest += os.read(self.near, 65536)
        try:
            text, self.rest = self.rest.decode(), b""
        except UnicodeDecodeError as cut:
            text, self.rest = self.rest[:cut.start].decode(), self.rest[cut.start:]
        self.unread = self.screen.take(self.unread + text)

    def until(self, true, what):
        end = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < end, f"never: {what}\n{self.screen.text()}"
            assert self.process.poll() is None or true(), f"ended before {what}: {self.process.stderr.read()}"
            self.read(0.1)

    def shows(self, *words):
        for word in words: self.until(lambda: word in self.screen.text(), word)

    def ends(self, code):
        while self.process.poll() is None: self.read(0.1)
        self.read(0)
        assert self.process.returncode == code, (self.process.returncode, self.process.stderr.read())
        self.given_back()
        return self.process.stderr.read().decode()

    def given_back(self):
        assert termios.tcgetattr(self.far) == self.before, "the terminal's settings"
        assert not self.screen.alternate and self.screen.cursor, "the terminal's screen"


def pages(takt, run):
    top = Top(takt, run)
    top.shows("ace · ", "[1 nodes]", "obstacle_stop", "proven")
    assert termios.tcgetattr(top.far) != top.before and top.screen.alternate and not top.screen.cursor
    for number, name in enumerate(PAGES, 1):
        top.keys(str(number))
        top.shows(f"[{number} {name}]")
    top.keys("\t")
    top.shows("[1 nodes]")
    for key, name in (("\x1b[Z", "[7 parameters]"), ("2", "obstacle "), ("3", "One column is "), ("4", "front_laser"),
                      ("5", "supervisor"), ("5", "cores, memory"), ("6", "[6 log]"), ("?", "suspend"), ("\x1b", "[6 log]")):
        top.keys(key)
        top.shows(name)
    subprocess.run([takt, "mark", "seen by the test", "--run", run], check=True)
    top.shows("seen by the test")
    top.keys("1\x1b[B\x1b[6~")
    top.until(lambda: not re.search(r"^q ends|^1-", top.screen.text().split("\n")[-1]), "other rows")
    top.keys("g\x1b[C")
    top.shows("< 1")
    assert top.screen.styled, "no colours"
    top.keys("q")
    assert top.ends(0) == ""


def narrow(takt, run):
    top = Top(takt, run, 40, 10)
    top.shows("[1 nodes] 2 3 4 5 6 7 ?", "miss")
    for number, name in enumerate(PAGES, 1):
        top.keys(str(number))
        top.shows(f"[{number} {name}]")
    top.resize(200, 50)
    top.shows("1 nodes 2 chains", "? help")
    top.keys("1")
    top.shows("criticality")
    top.resize(20, 4)
    top.shows("ace")
    top.keys("\x03")
    assert top.ends(0) == ""


def plain(takt, run):
    for environment in ({"TERM": "dumb"}, {"NO_COLOR": "1", "LC_ALL": "C"}):
        top = Top(takt, run, **environment)
        top.shows("[1 nodes]", "obstacle_stop")
        top.keys("3")
        top.shows("One column is ")
        top.keys("q")
        top.ends(0)
        assert not top.screen.styled, environment
    assert top.screen.text().isascii()


def term(takt, run):
    for sent in (signal.SIGTERM, signal.SIGQUIT, signal.SIGABRT):
        top = Top(takt, run)
        top.shows("[1 nodes]")
        top.process.send_signal(sent)
        top.ends(-sent)


def hangup(takt, run):
    top = Top(takt, run)
    top.shows("[1 nodes]")
    os.close(top.far)
    os.close(top.near)
    assert top.process.wait(PATIENCE_S) in (0, -signal.SIGHUP), top.process.returncode


def suspended(takt, run):
    """With job control: the command's group is in the foreground of its session, and not orphaned."""
    script = ("import os, signal, sys\n"
              "signal.signal(signal.SIGTTOU, signal.SIG_IGN)\n"
              "child = os.fork()\n"
              "if child == 0:\n"
              "    os.setpgid(0, 0)\n"
              "    os.tcsetpgrp(0, os.getpid())\n"
              "    signal.signal(signal.SIGTTOU, signal.SIG_DFL)\n"
              "    os.execv(sys.argv[1], sys.argv[1:])\n"
              "_, status = os.waitpid(child, os.WUNTRACED)\n"
              "assert os.WIFSTOPPED(status), status\n"
              "os.tcsetpgrp(0, os.getpid())\n"
              "print('SUSPENDED', file=sys.stderr, flush=True)\n"
              "sys.stdin.readline()\n"
              "os.tcsetpgrp(0, child)\n"
              "os.killpg(child, signal.SIGCONT)\n"
              "sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n")
    top = Top(takt, run, shell=(sys.executable, "-c", script))
    top.shows("[1 nodes]")
    top.keys("\x1a")
    top.until(lambda: select.select([top.process.stderr], [], [], 0)[0], "suspended")
    said = os.read(top.process.stderr.fileno(), 1000).decode()
    assert said == "SUSPENDED\n", said
    while select.select([top.near], [], [], 0)[0]: top.read(0)
    top.given_back()
    top.keys("\n")
    top.until(lambda: top.screen.alternate and "[1 nodes]" in top.screen.text(), "again")
    top.keys("q")
    top.ends(0)


def held(takt, run):
    """The run lets go of one who does not read for long; he comes back by himself."""
    def sockets():
        found = set()
        for fd in os.listdir(f"/proc/{run}/fd"):
            try:
                found.add(os.readlink(f"/proc/{run}/fd/{fd}"))
            except FileNotFoundError:  # closed meanwhile
                pass
        return {name for name in found if name.startswith("socket:")}

    before = sockets()
    top = Top(takt, run)
    top.shows("[1 nodes]", "· full ·")
    its_own = sockets() - before
    assert its_own
    top.process.send_signal(signal.SIGSTOP)
    top.until(lambda: not its_own & sockets(), "the run lets go")
    top.process.send_signal(signal.SIGCONT)
    top.keys("6")
    subprocess.run([takt, "mark", "he is back", "--run", run], check=True)
    top.shows("he is back")
    top.keys("q")
    top.ends(0)


def stopped(takt, run):
    top = Top(takt, run)
    top.shows("[1 nodes]")
    subprocess.run([takt, "stop", "--run", run], check=True)
    assert top.ends(0) == "takt: the run has ended\n"


{case.__name__: case for case in (pages, narrow, plain, term, hangup, suspended, held, stopped)}[sys.argv[3]](*sys.argv[1:3])
