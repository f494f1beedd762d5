#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Kills processes of a run at random instants: kills.sh [KILLS] [SECONDS] [SEED] [takt run options...]
# Default: 200 kills in a run of 10 minutes. Prints how long each process was away, what the nodes of the others missed
# meanwhile, and what is left afterwards: chunks, descriptors, threads, /dev/shm, /tmp, and SCHED_DEADLINE bandwidth,
# found by asking the kernel for it. Each miss of a high-criticality node is told with its reason (takt explain) and with
# the kill before it. Exit 1 if a process did not come back or something is left.
root=$(readlink -f "$(dirname "$0")/../..")
exec python3 - "${TAKT:-$root/takt}" "$@" <<'PY'
import ctypes, json, os, random, signal, struct, subprocess, sys, tempfile, time

takt, args = sys.argv[1], sys.argv[2:]
kills = int(args[0]) if args else 200
seconds = float(args[1]) if len(args) > 1 else 600
chance = random.Random(int(args[2]) if len(args) > 2 else 1)
options = args[3:]
libc = ctypes.CDLL(None, use_errno=True)
SYS_sched_setattr = {"x86_64": 314, "aarch64": 274}[os.uname().machine]


def reserve(runtime_us):
    """Whether the kernel reserves that much of 100 ms; in a process of its own, which gives it back."""
    pid = os.fork()
    if pid == 0:
        attr = struct.pack("IIQiIQQQ", 48, 6, 1, 0, 0, runtime_us * 1000, 100_000_000, 100_000_000)
        os._exit(0 if libc.syscall(SYS_sched_setattr, 0, attr, 0) == 0 else 1)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0


def bandwidth():
    """Largest single reservation that the kernel still admits beside as many full ones as it takes; None: not permitted."""
    if not reserve(2000): return None
    held = []
    while len(held) < 64:  # whole CPUs first, each held by a sleeping process
        ready = os.pipe()
        pid = os.fork()
        if pid == 0:
            attr = struct.pack("IIQiIQQQ", 48, 6, 1, 0, 0, 50_000_000, 100_000_000, 100_000_000)
            os.write(ready[1], b"y" if libc.syscall(SYS_sched_setattr, 0, attr, 0) == 0 else b"n")
            while True: signal.pause()
        granted = os.read(ready[0], 1) == b"y"
        for end in ready: os.close(end)
        held.append(pid)
        if not granted: break
    low, high = 0, 50_000
    while high - low > 50:
        middle = (low + high) // 2
        low, high = (middle, high) if reserve(middle) else (low, middle)
        time.sleep(0.11)  # until the kernel has forgotten the one that just ended
    for pid in held:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    time.sleep(0.2)
    return round((len(held) - 1) * 50 + low / 1000, 1)  # ms of 100


def traces():
    return sorted(n for d in ("/dev/shm", "/tmp", "/run/takt") if os.path.isdir(d) for n in os.listdir(d)
                  if "takt" in n or "roudi" in n or "iceoryx" in n)


def children(pid):
    out = {}
    for tid in os.listdir(f"/proc/{pid}/task"):
        for child in open(f"/proc/{pid}/task/{tid}/children").read().split():
            try: out[open(f"/proc/{child}/comm").read().strip()] = int(child)
            except OSError: pass
    out.pop("takt-nursery", None)
    return out


def open_things(pid):
    pids = {"supervisor": pid, **children(pid)}
    return {name: (len(os.listdir(f"/proc/{p}/fd")), len(os.listdir(f"/proc/{p}/task"))) for name, p in sorted(pids.items())}


def why_missed(trace_file, nodes, struck):
    """A line per job of these nodes that missed, with the kill before it."""
    jobs = [(e["args"], e["name"].split()[0]) for e in json.load(open(trace_file))["traceEvents"] if e.get("cat") == "job"]
    late = sorted((job["release_ns"], name) for job, name in jobs if job["late"] and name in nodes)
    said = {n: subprocess.run([takt, "explain", trace_file, n], capture_output=True, text=True).stdout.splitlines()
            for n in {name for _, name in late}}
    lines = []
    for release_ns, name in late:
        before = [kill for kill in struck if kill[0] <= release_ns]
        kill = f"{(release_ns - before[-1][0]) / 1e6:.0f} ms after the end of {before[-1][1]}" if before else "before any kill"
        lines.append(f"{kill}: {said[name].pop(0)}")
    return lines


with tempfile.TemporaryDirectory(prefix="kills-") as work:
    before, room = traces(), bandwidth()
    report_file, trace_file = f"{work}/report.json", f"{work}/trace.json"
    log = open(f"{work}/log", "w")
    run = subprocess.Popen([takt, "run", "--isolate", "subsystem", "--for", f"{seconds}s", "--output", f"{work}/out",
                            "--report", report_file, "--trace", trace_file, *options], stdout=log, stderr=log)
    while len(children(run.pid)) < 2 and run.poll() is None: time.sleep(0.1)
    time.sleep(6)
    if run.poll() is not None: sys.exit("the run did not start:\n" + open(log.name).read())
    early = open_things(run.pid)
    first, last = time.monotonic(), time.monotonic() + seconds - 20
    struck = []
    for instant in sorted(chance.uniform(first, last) for _ in range(kills)):
        time.sleep(max(0, instant - time.monotonic()))
        alive = children(run.pid)
        if not alive: break
        victim = chance.choice(sorted(alive))
        try: os.kill(alive[victim], signal.SIGKILL)
        except ProcessLookupError: continue
        struck.append((time.monotonic_ns(), victim))
    time.sleep(max(0, last + 5 - time.monotonic()))
    late = open_things(run.pid) if run.poll() is None else {}
    code = run.wait()
    report = json.load(open(report_file))
    high = {n["name"] for n in report["nodes"] if n["criticality"] == "high"}
    reasons = why_missed(trace_file, high, struck)
    print(open(log.name).read()[-3000:] if code not in (0, 1) else "", end="")
    after, room_after = traces(), bandwidth()

outages = [f for f in report["faults"] if f.get("kind") == "outage"]
back = sorted(f["down_s"] for f in outages if f["back_s"] is not None)
pick = lambda q: back[min(len(back) - 1, int(q * len(back)))] if back else float("nan")
print(f"{len(struck)} kills in {report['duration_s']:.0f} s, policy {report['policy_granted']}, {report['transport']} transport, "
      f"host stall {report['host_stall_ms']} ms; exit {code}")
print(f"away until every node has run again: p50 {pick(.5):.2f} s, p99 {pick(.99):.2f} s, max {pick(1):.2f} s; "
      f"not back: {len(outages) - len(back)}; chunks taken back from the dead: {sum(f['chunks_freed'] for f in outages)}")
print(f"{'node':18}{'crit':>6}{'released':>10}{'down':>7}{'done':>8}{'miss':>6}{'skip':>6}")
worse = 0
for n in report["nodes"]:
    print(f"{n['name']:18}{n['criticality']:>6}{n['released']:10}{n.get('down', 0):7}{n['completed']:8}{n['deadline_misses']:6}{n['skipped']:6}")
    if n["criticality"] == "high": worse += n["deadline_misses"]
print(f"deadline misses of high-criticality nodes: {worse}")
for line in reasons: print("   ", line)
bad = []
if len(outages) != len(back): bad.append("a process did not come back")
if early != late: bad.append(f"descriptors or threads: {early} -> {late}")
if before != after: bad.append(f"left behind: {sorted(set(after) - set(before))}")
if room != room_after: bad.append(f"SCHED_DEADLINE bandwidth: {room} -> {room_after} ms of 100")
held = sum(p["in_use_at_end"] for p in report["memory"]["pools"])
print(f"before and after: descriptors and threads {'equal' if early == late else 'NOT EQUAL'}, files {'equal' if before == after else 'NOT EQUAL'}, "
      f"SCHED_DEADLINE bandwidth {room} and {room_after} ms of 100; chunks in use at the end {held}")
for what in bad: print("FAILED:", what)
sys.exit(1 if bad else 0)
PY
