# SPDX-License-Identifier: Apache-2.0
"""Speaks to a running graph over its local socket, as `takt echo`, `set` and `mode` do."""
import json
import os
import socket
import stat
import time

_ALL, _ENDED = 1 << 30, "the run has ended"


class Error(RuntimeError):
    """The run refused; the text names the valid choices."""


class Message(dict):
    """The fields of one message by name. `stamp_ns`: when it was true, monotonic clock; `sequence`, `level`, `type`."""

    def __init__(self, line):
        super().__init__({name: value["first"] if isinstance(value, dict) and "first" in value else value
                          for name, value in line["message"].items()})
        self.type, self.stamp_ns = line["type"], line["stamp_ns"]
        self.sequence, self.level = line["sequence"], line["level"]


def _folders():
    """Where sockets of runs lie, opened: the first of this user, then the service's. graph/attach/socket_folder.hpp."""
    user, places = os.geteuid(), []
    if os.environ.get("XDG_RUNTIME_DIR") and os.access(os.environ["XDG_RUNTIME_DIR"], os.W_OK):
        places.append(os.environ["XDG_RUNTIME_DIR"] + "/takt")
    places += [f"/run/takt.{user}"] if user == 0 else ["/run/takt"]
    places.append(f"/tmp/takt.{user}")
    if os.environ.get("HOME"):
        places.append(os.environ["HOME"] + "/.cache/takt/run")
    own = False
    for place in places + ["/run/takt"]:
        service = place == "/run/takt"
        if own and not service:
            continue
        try:
            folder = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError:
            continue
        try:
            facts = os.fstat(folder)
            forbidden = stat.S_IWGRP | stat.S_IWOTH if service else stat.S_IRWXG | stat.S_IRWXO
            if not facts.st_mode & forbidden and (service or facts.st_uid == user):
                own = True
                yield folder
        finally:
            os.close(folder)


def running():
    """Process ids of the runs that can be spoken to: [4711]."""
    pids = set()
    for folder in _folders():
        for name in os.listdir(folder):
            pid = name.removesuffix(".sock")
            if pid != name and pid.isdigit() and os.path.exists(f"/proc/{pid}"):
                pids.add(int(pid))
    return sorted(pids)


class Connection:
    """To a running graph.

        run = takt.Connection()
        run.set("cruise.speed", "0.3m/s")
        for message in run.follow("front_laser.scan", count=3):
            print(message.stamp_ns, message["range_m"][:5])

    `pid`: of the run; left out where only one runs. Raises Error if there is none, or several. Any thread: each
    question has a connection of its own.
    """

    def __init__(self, pid=None, timeout_s=10.0):
        if pid is None:
            runs = running()
            if len(runs) != 1:
                raise Error("no graph of this user is running; start one with: takt run" if not runs else
                            f"several graphs are running; choose one by pid: {', '.join(map(str, runs))}")
            pid = runs[0]
        self.pid, self._timeout_s = pid, timeout_s
        self._connect().close()

    def _connect(self):
        for folder in _folders():
            found = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            found.settimeout(self._timeout_s)
            try:
                found.connect(f"/proc/self/fd/{folder}/{self.pid}.sock")
                return found
            except OSError:
                found.close()
        raise Error(f"process {self.pid} is no running graph of this user (running: "
                    f"{', '.join(map(str, running())) or 'none'})")

    @staticmethod
    def _read(file):
        line = file.readline()
        if not line:
            raise Error(_ENDED)
        answer = json.loads(line)
        if "error" in answer:
            raise Error(answer["error"])
        file.read(answer.get("bytes", 0))
        return answer

    def ask(self, **question):
        """One question of graph/attach: ask(do="top"). The answer as a dict; raises Error if the run refuses."""
        try:
            with self._connect() as connection, connection.makefile("rb") as file:
                connection.sendall(json.dumps(question).encode() + b"\n")
                return self._read(file)
        except OSError as problem:
            raise Error(f"the run does not answer: {problem}") from problem

    def top(self):
        """What `takt top --json` prints: rates, counts, misses, states of devices."""
        return self.ask(do="top")

    def set(self, param, value, keep=False):
        """Sets a parameter between two jobs: set("cruise.speed", "0.3m/s"). A text with its unit, a number or a bool."""
        text = str(value).lower() if isinstance(value, bool) else str(value)
        self.ask(do="set", param=param, value=text, keep=keep)

    def get(self, param):
        """The value a parameter has now."""
        return self.ask(do="get", param=param)["parameters"][0]["value"]

    def fault(self, device, fault, on=True):
        """Switches a fault of a simulated device or double: fault("front_laser", "silent"); `on=False` ends it."""
        self.ask(do="fault", device=device, fault=fault, on=on)

    def faults(self):
        """What can be switched: {"front_laser": ["silent", "unplugged", "garbage", "frozen"]}."""
        return {device["device"]: device["faults"] for device in self.ask(do="fault")["devices"]}

    def mode(self, name):
        """Changes the mode of the run: mode("safe_stop")."""
        self.ask(do="mode", mode=name)

    def stop(self):
        """Ends the run cleanly."""
        self.ask(do="stop")

    def follow(self, port, count=None, timeout_s=None):
        """Messages of an output as they come, the newest first seen: a reader that is slow misses some.

        Ends after `count` messages, or with the run. Raises TimeoutError after `timeout_s` without a message (default:
        as the connection), Error for an unknown port or one that somebody else follows.
        """
        wanted = count if count is not None else 1 << 62
        timeout_s = timeout_s if timeout_s is not None else self._timeout_s
        free_by = time.monotonic() + min(1.0, timeout_s)  # the run may not have seen yet that we left the port
        taken = 0
        while True:
            try:
                for message in self._follow_once(port, wanted - taken, timeout_s):
                    taken += 1
                    yield message
                return
            except TimeoutError:
                raise TimeoutError(f"no message of {port} came within {timeout_s:g} s") from None
            except Error as problem:
                if taken and str(problem) == _ENDED:
                    return
                if taken or "somebody else listens" not in str(problem) or time.monotonic() > free_by:
                    raise
                time.sleep(0.02)

    def _follow_once(self, port, wanted, timeout_s):
        connection = self._connect()
        connection.settimeout(timeout_s)
        with connection, connection.makefile("rb") as file:
            question = {"do": "echo", "port": port, "as": "", "count": wanted, "items": _ALL}
            connection.sendall(json.dumps(question).encode() + b"\n")
            for _ in range(wanted):
                yield Message(self._read(file))
