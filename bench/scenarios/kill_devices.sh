#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# kill -9 of the process of the devices, and of those that keep a run, while the robot drives: kill_devices.sh [KILLS] [REPEATS]
# Default: 20 kills of `devices`, 5 runs each for supervisor, nursery and keeper (iceoryx). The graph is ace.yaml, profile
# doubles; its base is a process of its own (takt double base) behind a bus that this script listens to. Prints how long
# after a kill the base stood by its own watchdog, and how long until it had a command again.
# Exit 1 if it stood later than 200 ms and one period (67 ms) after a kill, had no command again within 0.5 s (p99), or any
# process of a run is left 2 s after the death of one that keeps it.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "$root" "$@" <<'PY'
import os, processes, select, signal, socket, struct, subprocess, sys, tempfile, threading, time

takt, root, args = sys.argv[1], sys.argv[2], sys.argv[3:]
kills, repeats = (int(args[i]) if len(args) > i else default for i, default in ((0, 20), (1, 5)))
COMMAND, MOTION = 544, 672
STAND_MS, BACK_MS = 200 + 1000 / 15, 500
bad = []


class Bus(threading.Thread):
    """Between the driver and the base: passes frames on, and notes when commands and states went by."""

    def __init__(self, work):
        super().__init__(daemon=True)
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.listener.bind(f"{work}/bus")
        self.listener.listen(4)
        self.base = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.base.connect(f"{work}/base")
        self.commands, self.stood, self.moved = [], [], []  # ns
        self.start()

    def run(self):
        driver = None
        while True:
            for ready in select.select([self.listener, self.base] + ([driver] if driver else []), [], [])[0]:
                if ready is self.listener:
                    if driver: driver.close()
                    driver = self.listener.accept()[0]
                    break
                try: frame = ready.recv(16)
                except OSError: frame = b""
                if not frame:
                    if ready is self.base: return
                    driver.close()
                    driver = None
                    break
                self.note(frame)
                try:
                    if ready is not self.base: self.base.send(frame)
                    elif driver: driver.send(frame)
                except OSError: pass

    def note(self, frame):
        kind, now = struct.unpack_from("<I", frame)[0] & 0x7ff, time.monotonic_ns()
        if kind == COMMAND and frame[9] >> 4 == 1: self.commands.append(now)  # to drive
        if kind == MOTION: (self.stood if frame[9] >> 6 & 1 else self.moved).append(now)


def world(work):
    """A copy of the main graph with a base that is told to drive, and the double of that base."""
    os.mkdir(f"{work}/graph")
    for name in os.listdir(f"{root}/graph"):
        if name != "ace.yaml": os.symlink(f"{root}/graph/{name}", f"{work}/graph/{name}")
    graph = open(f"{root}/graph/ace.yaml").read()
    for old, new in (("schedule: ../schedules/thesis.yaml", f"schedule: {work}/schedule.yaml"),
                     ("in: {stop: {from: obstacle_stop.stop, max_age: 300ms}}}",
                      "in: {stop: {from: obstacle_stop.stop, max_age: 300ms}, velocity: {from: cruise.velocity, max_age: 300ms}}}"),
                     ("exports: [obstacle_stop.stop]\n", "exports: [obstacle_stop.stop, cruise.velocity]\n    cruise: {type: cruise, params: {speed: 0.2m/s}}\n"),
                     ("doubles: {default: {driver: double, world: worlds/lab.xml},",
                      f"doubles: {{default: {{driver: double, world: worlds/lab.xml}}, base: {{driver: can, interface: \"unix:{work}/bus\"}},")):
        if graph.count(old) != 1: sys.exit(f"graph/ace.yaml has no `{old}`")
        graph = graph.replace(old, new)
    open(f"{work}/graph/graph.yaml", "w").write(graph)
    open(f"{work}/schedule.yaml", "w").write(open(f"{root}/schedules/thesis.yaml").read() + "  cruise: {rate: 15, budget: 1ms, deadline: 60ms}\n")
    base = subprocess.Popen([takt, "double", "base", "--can", f"unix:{work}/base"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
    base.stdout.readline()
    return base


def start(work, *options):
    log = open(f"{work}/log", "w")
    run = subprocess.Popen([takt, "run", f"{work}/graph/graph.yaml", "--profile", "doubles", "--isolate", "subsystem", "--for", "0s", "--unchecked",
                            "--output", f"{work}/out", "--report", f"{work}/report.json", *options], stdout=log, stderr=log)
    while "completed:" not in open(log.name).read():
        if run.poll() is not None: sys.exit("the run did not start:\n" + open(log.name).read())
        time.sleep(0.1)
    time.sleep(1)
    return run


def first(instants, after):
    return next((ns for ns in instants if ns > after), None)


def ms(at, since):
    return float("inf") if at is None else (at - since) / 1e6


def figures(name, values):
    values = sorted(values)
    print(f"{name}: p50 {values[len(values) // 2]:.0f} ms, p99 {values[min(len(values) - 1, int(.99 * len(values)))]:.0f} ms, max {values[-1]:.0f} ms of {len(values)}", flush=True)
    return values[min(len(values) - 1, int(.99 * len(values)))]


def kill_devices():
    with tempfile.TemporaryDirectory(prefix="devices-") as work:
        base = world(work)
        bus, run = Bus(work), start(work)
        struck = []
        for _ in range(kills):
            pid = next((p for p in processes.children(run.pid) if processes.name(p) == "devices" and processes.alive(p)), None)
            if pid is None or not bus.commands or time.monotonic_ns() - bus.commands[-1] > 100_000_000: bad.append("the base was not driven before a kill")
            if pid is not None: os.kill(pid, signal.SIGKILL)
            struck.append(time.monotonic_ns())
            time.sleep(6)
        run.send_signal(signal.SIGINT)
        run.wait()
        base.terminate()
        base.wait()
    back = [ms(first(bus.commands, at + 5_000_000), at) for at in struck]
    stood = [ms(first(bus.stood, at), at) for at in struck]
    stood = [stand for stand, again in zip(stood, back) if stand < again or again > STAND_MS]  # else it had a command in time
    if stood and figures("devices killed, the base stands by itself", stood) > STAND_MS: bad.append("the base stood too late")
    if figures("devices killed, the base has a command again", back) > BACK_MS: bad.append(f"no command again within {BACK_MS} ms (p99)")


def kill_keeping(name, transport, victim):
    stood, left = [], 0
    for _ in range(repeats):
        with tempfile.TemporaryDirectory(prefix="devices-") as work:
            base = world(work)
            bus, run = Bus(work), start(work, "--transport", transport)
            members = processes.family(run.pid)
            ends = victim(run)
            at = time.monotonic_ns()
            os.kill(ends, signal.SIGKILL)
            time.sleep(2)
            if name == "nursery":  # nobody notices
                left += run.poll() is not None or not any(ns > at + 1_900_000_000 for ns in bus.commands)
                run.send_signal(signal.SIGINT)
                run.wait()
            else:
                run.wait()
                left += sum(processes.alive(p) for p in members)
                stood.append(ms(first(bus.stood, at), at))
            base.terminate()
            base.wait()
    if stood and figures(f"{name} killed, the base stands by itself", stood) > STAND_MS: bad.append(f"{name}: the base stood too late")
    print(f"{name} killed {repeats} times: " + (f"{left} runs noticed it" if name == "nursery" else f"{left} processes left"), flush=True)
    if left: bad.append(f"{name}: {left} " + ("runs noticed it" if name == "nursery" else "processes left"))


kill_devices()
kill_keeping("supervisor", "local", lambda run: run.pid)
kill_keeping("nursery", "local", lambda run: next(p for p in processes.children(run.pid) if processes.name(p) == "takt-nursery"))
kill_keeping("keeper", "iceoryx", lambda run: run.pid)
for what in bad: print("FAILED:", what)
sys.exit(1 if bad else 0)
PY
