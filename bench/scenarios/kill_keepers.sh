#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# kill -9 of those who keep a run: kill_keepers.sh [REPEATS]. The supervisor (local transport), iceoryx's daemon, which is
# also stopped so that it hangs, and the keeper in front of it. Prints how long it takes until all members are gone, or
# all nodes run again, how long the next start takes and what is left behind after that one. Exit 1 if something is left, nobody comes
# back, or the next start fails.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "$@" <<'PY'
import json, os, signal, subprocess, sys, tempfile, time
from processes import alive, children, family, name as name_of

takt, args = sys.argv[1], sys.argv[2:]
repeats = int(args[0]) if args else 20
bad = 0


def members_of(supervisor):
    """Without those that only fork the others again."""
    return [c for c in children(supervisor) if name_of(c) != "takt-nursery"]


def left():
    return {f"{d}/{f}" for d in ("/dev/shm", "/tmp") for f in os.listdir(d) if f.startswith(("roudi", "iceoryx", "takt-")) and not f.endswith(".lock")}


def wait(what, seconds=60):
    begin = time.monotonic()
    while not what():
        if time.monotonic() > begin + seconds: return None
        time.sleep(0.001)
    return time.monotonic() - begin


def start(work, transport):
    """A run whose processes have all begun to work."""
    err = open(f"{work}/err", "w+")
    run = subprocess.Popen([takt, "run", "--isolate", "subsystem", "--transport", transport, "--for", "0s", "--output", f"{work}/out",
                            "--report", f"{work}/report.json"], stdout=err, stderr=err)
    if wait(lambda: "completed:" in open(err.name).read()) is None: sys.exit("the run does not begin:\n" + open(err.name).read())
    return run


def row(name, took, more):
    took = sorted(took)
    print(f"{name:34}{len(took):4} x  p50 {took[len(took) // 2]:6.3f}  max {took[-1]:6.3f} s   {more}", flush=True)


def ends_all(name, transport, victim):
    """Those whose death ends the run: nothing may be left that stops the next start."""
    global bad
    gone, again, remains, failed = [], [], set(), 0
    for _ in range(repeats):
        with tempfile.TemporaryDirectory(prefix="keepers-") as work:
            before = left()
            run = start(work, transport)
            members = family(run.pid)
            os.kill(victim(run), signal.SIGKILL)
            took = wait(lambda: not any(alive(m) for m in members))
            run.wait()
            if took is None: sys.exit(f"{name}: members outlive it: {[m for m in members if alive(m)]}")
            gone.append(took)
            begin = time.monotonic()
            code = subprocess.run([takt, "run", "--isolate", "subsystem", "--transport", transport, "--for", "1s", "--output", f"{work}/out"],
                                  capture_output=True).returncode
            again.append(time.monotonic() - begin - 1)
            failed += code not in (0, 1)
            remains |= left() - before
    row(name + ": all gone after", gone, f"next start and end take {sorted(again)[len(again) // 2]:.2f} s, {failed} failed; left behind: {sorted(remains) or 'nothing'}")
    bad |= bool(remains) or failed > 0


def comes_back(name, strike):
    """Those who are started again with all processes of the run."""
    global bad
    away, lost = [], 0
    for _ in range(repeats):
        with tempfile.TemporaryDirectory(prefix="keepers-") as work:
            run = start(work, "iceoryx")
            members = len(members_of(children(run.pid)[0]))
            os.kill(children(run.pid)[0], strike)
            wait(lambda: open(f"{work}/err").read().count(" is back") >= members)
            time.sleep(1)
            run.send_signal(signal.SIGINT)
            run.wait()
            outages = [f for f in json.load(open(f"{work}/report.json"))["faults"] if f.get("kind") == "outage"]
            lost += len(outages) != members or any(o["back_s"] is None for o in outages)
            away += [o["down_s"] for o in outages if o["back_s"] is not None]
    row(name + ": every process away", away, f"{lost} of {repeats} runs with one not back")
    bad |= lost > 0


ends_all("supervisor killed, local", "local", lambda run: run.pid)
ends_all("keeper killed, iceoryx", "iceoryx", lambda run: run.pid)
comes_back("daemon killed, iceoryx", signal.SIGKILL)
comes_back("daemon hung, iceoryx", signal.SIGSTOP)
sys.exit(bad)
PY
