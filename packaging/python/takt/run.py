# SPDX-License-Identifier: Apache-2.0
"""Runs a graph from Python, for tests of a whole robot."""
import json
import os
import pathlib
import subprocess
import tempfile
import time

from .live import Connection, Error, running
from .record import read_record


class RunFailed(RuntimeError):
    """The run did not start, or ended too early; the text has what it printed to stderr."""


_NEWEST_REPORT = 1


def read_report(path):
    """The report of `takt run --report FILE`, or of --json, as a dict: read_report("report.json")["ok"]. Raises Error for
    one of a later format."""
    with open(path, encoding="utf-8") as file:
        report = json.load(file)
    if report.get("format", 1) > _NEWEST_REPORT:
        raise Error(f"the report has format {report['format']}, and this reader knows up to {_NEWEST_REPORT}; "
                    "use a later takt")
    return report


def _descends_from(pid, ancestor):
    while pid > 1:
        if pid == ancestor:
            return True
        try:
            status = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
        except OSError:
            return False
        pid = int(status.rpartition(")")[2].split()[1])
    return False


class Run:
    """A graph that runs as long as the `with` block.

        with takt.Run("graph.yaml", profile="doubles") as run:
            run.set("cruise.speed", "0.3m/s")
            run.fault("front_laser", "silent")
            run.wait_for("obstacle_stop.stop", lambda m: m["reasons"] != 0, within_s=5)
        assert run.exit_code == 0, run.stderr

    `record`: True keeps a record, read by `run.record()` after the block. `longest_s`: the run ends by itself after so
    long. `arguments`: more of `takt run`, as ["--isolate", "subsystem"]. `command`: the program, else $TAKT, else
    `takt` on the path. After the block: `report` (a dict, None if there is none), `exit_code`, `stderr`. Entering raises
    RunFailed if the run does not start. One thread at a time.
    """

    def __init__(self, graph, profile=None, record=False, longest_s=600, arguments=(), command=None, start_within_s=60):
        self._folder = tempfile.TemporaryDirectory(prefix="takt-run-")
        self.folder = pathlib.Path(self._folder.name)
        self.report, self.exit_code, self.stderr = None, None, ""
        self._record, self._start_within_s = record, start_within_s
        self._process = self._connection = None
        self._words = [command or os.environ.get("TAKT", "takt"), "run", str(graph), "--for", f"{longest_s:g}s",
                       "--output", str(self.folder / "out"), "--report", str(self.folder / "report.json")]
        self._words += ["--profile", profile] if profile else []
        self._words += ["--record", str(self.folder / "run.mcap")] if record else []
        self._words += map(str, arguments)

    def __del__(self):
        self._folder.cleanup()

    def __enter__(self):
        with open(self.folder / "stdout", "wb") as out, open(self.folder / "stderr", "wb") as err:
            try:
                self._process = subprocess.Popen(self._words, stdin=subprocess.DEVNULL, stdout=out, stderr=err)
            except OSError as problem:
                raise RunFailed(f"{self._words[0]} cannot be started ({problem.strerror}); set TAKT to the program "
                                "takt, or give command=") from problem
        try:
            self._await_start()
        except BaseException:
            self._kill()
            raise
        return self

    def _await_start(self):
        end = time.monotonic() + self._start_within_s
        while time.monotonic() < end:
            if self._process.poll() is not None:
                self._end()
                raise RunFailed(f"takt run ended with exit code {self.exit_code}:\n{self.stderr}")
            for pid in running():
                if self._connection is None and _descends_from(pid, self._process.pid):
                    try:
                        self._connection = Connection(pid)
                    except Error:
                        pass  # it does not listen yet
            try:
                if self._connection is not None and self._connection.top()["running_s"] > 0:
                    return
            except Error:
                pass  # it ends, which is seen above
            time.sleep(0.02)
        self._kill()
        raise RunFailed(f"takt run did not start within {self._start_within_s} s:\n{self.stderr}")

    def __exit__(self, kind, *_):
        try:
            if self._process.poll() is None:
                try:
                    self._connection.stop()
                except Error:
                    pass  # it has just ended
                try:
                    self._process.wait(30)
                except subprocess.TimeoutExpired:
                    self._kill()
                    if kind is None:
                        raise RunFailed(f"takt run did not end within 30 s of the stop:\n{self.stderr}") from None
        finally:
            self._end()

    def _kill(self):
        if self._process.poll() is None:
            self._process.kill()
        self._end()

    def _end(self):
        self.exit_code = self._process.wait()
        self.stderr = (self.folder / "stderr").read_text(encoding="utf-8", errors="replace")
        if (self.folder / "report.json").exists():
            self.report = read_report(self.folder / "report.json")

    def _live(self):
        if self._connection is None or self.exit_code is not None:
            raise Error("the run is not going on; use it inside its `with` block")
        return self._connection

    def set(self, param, value):
        """As Connection.set: set("cruise.speed", "0.3m/s")."""
        self._live().set(param, value)

    def get(self, param):
        """The value a parameter has now."""
        return self._live().get(param)

    def fault(self, device, fault, on=True):
        """As Connection.fault: fault("front_laser", "silent"); `on=False` ends it."""
        self._live().fault(device, fault, on)

    def faults(self):
        """As Connection.faults."""
        return self._live().faults()

    def mode(self, name):
        """Changes the mode: mode("safe_stop")."""
        self._live().mode(name)

    def top(self):
        """Rates, counts and states of devices, as Connection.top."""
        return self._live().top()

    def follow(self, port, count=None, timeout_s=None):
        """As Connection.follow."""
        return self._live().follow(port, count, timeout_s)

    def wait_for(self, port, predicate, within_s=10.0):
        """Waits for a message of `port` that `predicate` accepts, and returns it.

            run.wait_for("obstacle_stop.stop", lambda m: m["reasons"] == 1, within_s=3)

        Raises AssertionError with the last message seen if none comes within `within_s`, Error for an unknown port.
        """
        end, last, seen = time.monotonic() + within_s, None, 0
        while (left := end - time.monotonic()) > 0:
            try:
                for message in self.follow(port, timeout_s=max(left, 0.01)):
                    last, seen = message, seen + 1
                    if predicate(message):
                        return message
                    if time.monotonic() >= end:
                        break
                else:
                    break  # the run has ended
            except TimeoutError:
                break
        raise AssertionError(f"no message of {port} came true within {within_s:g} s; {seen} seen, the last: {last}")

    def wait_for_device(self, device, state="ok", within_s=10.0):
        """Waits until a device is in that state: ok, silent, disconnected, garbage, frozen, unattended.

        Raises AssertionError with its state if that does not happen within `within_s`, Error for an unknown device.
        """
        end = time.monotonic() + within_s
        while True:
            states = {node["name"]: node["device"]["state"] for node in self.top()["nodes"] if "device" in node}
            if device not in states:
                raise Error(f"there is no device {device}; devices: {', '.join(states)}")
            if states[device] == state:
                return
            if time.monotonic() >= end:
                raise AssertionError(f"{device} is {states[device]}, not {state} within {within_s:g} s")
            time.sleep(0.02)

    def wait_for_end(self, within_s=60.0):
        """Waits until the run ends by itself, as a graph does whose `expect` is decided. Then `report` is there.

            run.wait_for_end(within_s=20)
            assert run.report["expectations"]["met"]

        Raises AssertionError if it still runs after `within_s`.
        """
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"the run did not end by itself within {within_s:g} s") from None
        self._end()

    def record(self):
        """The record of the run, after the block; see read_record()."""
        if not self._record:
            raise Error("this run kept no record; start it with record=True")
        return read_record(self.folder / "run.mcap")
