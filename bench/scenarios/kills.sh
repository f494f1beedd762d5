#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Kills processes of a run at random instants: kills.sh [KILLS] [SECONDS] [SEED] [takt run options...]
# Default: 200 kills in a run of 10 minutes, of the nursery that starts the others again, too. Prints how long each process
# was away, how soon it was back after its last kill (it may be killed again on its way back), what the nodes of the others
# missed meanwhile, and what is left afterwards: chunks, beside a minute without kills that comes first; descriptors, threads,
# /dev/shm, /tmp, and SCHED_DEADLINE bandwidth, found by asking the kernel for it.
# Each miss of a high-criticality node is told with its reason (takt explain) and with the kill before it; those of jobs whose
# own process was away are counted apart. How long the host was seen away meanwhile (tests/tools/host_holes.py) is told and
# excuses nothing. Exit 1 if a process was away for more than 2 s, killed once or twice, or did not come back, a
# high-criticality node of another one missed a deadline for which the host's stall does not account, or something is left.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios:$root/tests/tools" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "$@" <<'PY'
import ctypes, host_holes, json, os, processes, random, re, signal, struct, subprocess, sys, tempfile, time

takt, args = sys.argv[1], sys.argv[2:]
kills = int(args[0]) if args else 200
seconds = float(args[1]) if len(args) > 1 else 600
chance = random.Random(int(args[2]) if len(args) > 2 else 1)
options = args[3:]
iceoryx = "iceoryx" in options
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


def supervisor(run):
    """Over iceoryx there is a keeper in front of it; 0 while there is none."""
    return next(iter(processes.children(run)), 0) if iceoryx else run


def victims(run):
    """(name, process number) of each."""
    return [(processes.name(pid), pid) for pid in processes.children(supervisor(run))]


def open_things(run):
    pids = [("run", run)] + ([("supervisor", supervisor(run))] if iceoryx else []) + sorted(victims(run))
    return [(name, len(os.listdir(f"/proc/{p}/fd")), len(os.listdir(f"/proc/{p}/task"))) for name, p in pids]


def begin(name, length):
    log = open(f"{work}/{name}.log", "w")
    run = subprocess.Popen([takt, "run", "--isolate", "subsystem", "--for", f"{length}s", "--output", f"{work}/{name}", "--report", f"{work}/{name}.json",
                            "--trace", f"{work}/{name}.trace", *options], stdout=log, stderr=log)
    while "completed:" not in open(log.name).read() and run.poll() is None: time.sleep(0.1)  # all of them are at work
    time.sleep(2)
    if run.poll() is not None: sys.exit("the run did not start:\n" + open(log.name).read())
    return run


def missed(report, holes):
    """Jobs of high-criticality nodes that were late: (line, whether their own process was away, whether the host's stall
    accounts for it). A miss that the trace does not have is nobody's excuse."""
    trace = json.load(open(f"{work}/killed.trace"))
    epoch = trace["otherData"]["epoch_ns"]
    high = {n["name"]: n["deadline_misses"] for n in report["nodes"] if n["criticality"] == "high"}
    away = [(set(o["nodes"]), epoch + o["at_s"] * 1e9, epoch + o["back_s"] * 1e9 if o["back_s"] is not None else float("inf"))
            for o in report["faults"] if o.get("kind") == "outage"]
    jobs = [(e["args"], e["name"].split()[0]) for e in trace["traceEvents"] if e.get("cat") == "job" and e["args"]["late"]
            and e["args"]["release_ns"] < trace["otherData"]["end_ns"]]
    late = sorted((job["release_ns"], job["deadline_ns"], name) for job, name in jobs if name in high)
    said = {n: subprocess.run([takt, "explain", f"{work}/killed.trace", n], capture_output=True, text=True).stdout.splitlines()
            for n in {name for _, _, name in late}}
    rows = []
    for release, deadline, name in late:
        line = said[name].pop(0) if said[name] else f"{name} missed a job that takt explain does not tell of"
        before = [kill for kill in struck if kill[0] <= release]
        kill = f"{(release - before[-1][0]) / 1e6:.0f} ms after the end of {before[-1][1]}" if before else "before any kill"
        stall, by = re.search(r"host stall ([\d.]+)", line), re.search(r" by ([\d.]+) ms", line)
        seen_ms = host_holes.taken_ns(holes, release, deadline + (float(by[1]) if by else 0) * 1e6) / 1e6
        rows.append((f"{kill}: {line}" + (f"; the host was seen away for {seen_ms:.1f} ms meanwhile" if seen_ms else ""),
                     any(name in nodes and release <= to and deadline >= start for nodes, start, to in away),
                     bool(stall and by and float(stall[1]) >= float(by[1]))))
    for name, count in high.items():
        told = sum(row[2] == name for row in late)
        if count > told: rows.append((f"{count - told} misses of {name} that the trace does not have", False, False))
    return rows


def with_kills(outages):
    """Each outage that ended, with `kills`: the instants in it, in seconds from its begin, at which its process was killed,
    and `recovery_s`: from the last of them until every node had run again. The begin is when the end was seen, up to 0.7 s
    after the kill: it takes the kernel so long to clear a process up."""
    epoch = json.load(open(f"{work}/killed.trace"))["otherData"]["epoch_ns"]
    ended = [o for o in outages if o["back_s"] is not None]
    last_back = {}
    for o in ended:
        begin, back = (epoch + o[key] * 1e9 for key in ("at_s", "back_s"))
        since = max(begin - 0.7e9, last_back.get(o["process"], 0))
        o["kills"] = [(at - begin) / 1e9 for at, name in struck if name == o["process"][:15] and since <= at <= back]
        o["recovery_s"] = o["down_s"] - max(o["kills"], default=0)
        last_back[o["process"]] = back
    return ended


struck = []
with tempfile.TemporaryDirectory(prefix="kills-") as work:
    before, room = traces(), bandwidth()
    begin("calm", min(seconds, 60)).wait()
    calm = json.load(open(f"{work}/calm.json"))["memory"]["chunks_at_end"]
    watch = host_holes.start(f"{work}/holes")
    run = begin("killed", seconds)
    early = open_things(run.pid)
    first, last = time.monotonic(), time.monotonic() + seconds - 16
    for instant in sorted(chance.uniform(first, last) for _ in range(kills)):
        time.sleep(max(0, instant - time.monotonic()))
        while not victims(run.pid) and run.poll() is None: time.sleep(0.01)  # all of them are being started again
        if run.poll() is not None: break
        name, pid = chance.choice(sorted(victims(run.pid)))
        try: os.kill(pid, signal.SIGKILL)
        except ProcessLookupError: continue
        struck.append((time.monotonic_ns(), name))
    time.sleep(max(0, last + 5 - time.monotonic()))
    late = open_things(run.pid) if run.poll() is None else []
    code = run.wait()
    if not os.path.exists(f"{work}/killed.json"): sys.exit(f"no report, exit {code}, killed {struck}:\n" + open(f"{work}/killed.log").read()[-3000:])
    report = json.load(open(f"{work}/killed.json"))
    holes = host_holes.end(watch, f"{work}/holes")
    misses = missed(report, holes)
    outages = [f for f in report["faults"] if f.get("kind") == "outage"]
    ended = with_kills(outages)
    print(open(f"{work}/killed.log").read()[-3000:] if code not in (0, 1) else "", end="")
    after, room_after = traces(), bandwidth()

chunks = report["memory"]["chunks_at_end"]
back, away = sorted(o["recovery_s"] for o in ended), sorted(o["down_s"] for o in ended)
pick = lambda values, q: values[min(len(values) - 1, int(q * len(values)))] if values else float("nan")
print(f"{len(struck)} kills in {report['duration_s']:.0f} s, policy {report['policy_granted']}, {report['transport']} transport, "
      f"host stall {report['host_stall_ms']} ms, seen away {len(holes)} times, {sum(end - begin for _, begin, end in holes) / 1e6:.0f} ms; exit {code}")
print(f"from the last kill of a process until every node of it has run again: p50 {pick(back, .5):.2f} s, p99 {pick(back, .99):.2f} s, "
      f"max {pick(back, 1):.2f} s; not back: {len(outages) - len(back)}; chunks taken back from the dead: {sum(f['chunks_freed'] for f in outages)}")
print(f"{len(ended)} outages, {sum(len(o['kills']) > 1 for o in ended)} of them of processes killed again on their way back; away in all: "
      f"p50 {pick(away, .5):.2f} s, max {pick(away, 1):.2f} s; those of 1.5 s and more:")
for o in (o for o in ended if o["down_s"] >= 1.5):
    print(f"    {o['process']} {o['down_s']:.2f} s from {o['at_s']:.2f} s on, killed at {', '.join(f'{at:+.2f}' for at in o['kills'])} s")
print(f"{'node':18}{'crit':>6}{'released':>10}{'down':>7}{'done':>8}{'miss':>6}{'skip':>6}")
for n in report["nodes"]:
    print(f"{n['name']:18}{n['criticality']:>6}{n['released']:10}{n.get('down', 0):7}{n['completed']:8}{n['deadline_misses']:6}{n['skipped']:6}")
own, hosts = [m for m in misses if m[1]], [m for m in misses if not m[1] and m[2]]
others = [m for m in misses if not m[1] and not m[2]]
print(f"deadline misses of high-criticality nodes: {len(own)} while their own process was away, {len(hosts)} the host's, {len(others)} others'")
for kind, rows in (("own", own), ("host", hosts), ("OTHERS", others)):
    for line, _, _ in rows: print(f"    {kind}: {line}")
bad = []
if len(struck) < kills: bad.append(f"only {len(struck)} of {kills} kills")
if code not in (0, 1): bad.append(f"exit {code}")
if len(outages) != len(back): bad.append("a process did not come back")
if away and away[-1] > 2: bad.append(f"away for {away[-1]:.2f} s, more than 2 s")
if back and back[-1] > 2: bad.append(f"back {back[-1]:.2f} s after its last kill, more than 2 s")
if others: bad.append(f"{len(others)} deadlines of high-criticality nodes whose process was there")
if early != late: bad.append(f"descriptors or threads: {early} -> {late}")
if before != after: bad.append(f"left behind: {sorted(set(after) - set(before))}")
if chunks > calm: bad.append(f"chunks in use at the end: {calm} without kills, {chunks} with them")
if room is None and "--policy" not in options: bad.append("SCHED_DEADLINE is not permitted here: its bandwidth cannot be compared")
if room != room_after: bad.append(f"SCHED_DEADLINE bandwidth: {room} -> {room_after} ms of 100")
print(f"before and after: descriptors and threads {'equal' if early == late else 'NOT EQUAL'}, files {'equal' if before == after else 'NOT EQUAL'}, "
      + ("SCHED_DEADLINE bandwidth not measured (not permitted)" if room is None else f"SCHED_DEADLINE bandwidth {room} and {room_after} ms of 100")
      + f"; chunks in use at the end of a run without kills {calm}, of this one {chunks}")
for what in bad: print("FAILED:", what)
sys.exit(1 if bad else 0)
PY
