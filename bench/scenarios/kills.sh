#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Kills processes of a run at random instants: kills.sh [KILLS] [SECONDS] [SEED] [SHARD/SHARDS] [takt run options...]
# Default: 200 kills in a run of 10 minutes, of the nursery that starts the others again and of spares, too. 2/3: the second of
# three parts, each with a third of the kills and of the time. Prints for each process how soon it was back, what the nodes
# of the others missed meanwhile, and what is left afterwards: chunks, beside a minute without kills that comes first;
# descriptors, threads, /dev/shm, /tmp, and SCHED_DEADLINE bandwidth, found by asking the kernel for it.
# A process is back when its workers wait for their next releases. Limits, p99: 0.5 s (1.0 s with a learned model); of the
# process with a spare 100 ms until the next stop command is published, if its last kill was more than 2 s ago (else 0.5 s, as the
# others). The stop command that the base latches is never older than its max_age, but for 2 s after such a second kill, and
# after a kill of the devices, without which there is neither a base nor a scan.
# Each miss of a high-criticality node is told with its reason (takt explain) and with the kill before it; those of jobs whose
# own process was away are counted apart. How long the host was seen away meanwhile (tests/tools/host_holes.py) is told and
# excuses nothing. Exit 1 if a limit is broken, a process did not come back, a high-criticality node of another one missed a
# deadline for which the host's stall does not account, or something is left.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios:$root/tests/tools" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "$@" <<'PY'
import ctypes, host_holes, json, os, processes, random, re, signal, struct, subprocess, sys, tempfile, time

takt, args = sys.argv[1], sys.argv[2:]
kills = int(args[0]) if args else 200
seconds = float(args[1]) if len(args) > 1 else 600
chance = random.Random(int(args[2]) if len(args) > 2 else 1)
shard, shards = 1, 1
if len(args) > 3 and re.fullmatch(r"\d+/\d+", args[3]): shard, shards = map(int, args.pop(3).split("/"))
if shards > 1:
    kills, seconds = kills * shard // shards - kills * (shard - 1) // shards, seconds / shards
    chance = random.Random(f"{args[2]} {shard}")
options = args[3:]
SPARED, MAX_AGE_MS, SOON_NS = "robot", 300, 2_000_000_000  # whose stop the base reads, with that max_age
LEARNED = set()  # processes with a learned model: 1.0 s
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
    return [(processes.name(pid), pid) for pid in processes.children(supervisor(run)) if processes.alive(pid)]


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


def jobs_of(trace, node):
    return sorted((e["args"] for e in trace["traceEvents"] if e.get("cat") == "job" and e["name"].split()[0] == node),
                  key=lambda job: job["release_ns"])


def last_kill(process, before, at_ns):
    """The instant of the newest kill of the process before that one, or None."""
    return max((at for at, name in struck if name == process[:15] and at < at_ns - before), default=None)


def killed_soon(process, at_ns):
    """That kill came within 2 s of the one before."""
    last = last_kill(process, 0, at_ns)
    return last is not None and at_ns - last <= SOON_NS


def stops(trace):
    """From each kill of the process with the spare to the next stop command: (ms, whether killed soon after the last)."""
    published = sorted(job["published_ns"] for job in jobs_of(trace, "obstacle_stop") if job["published"])
    rows = []
    for at, name in struck:
        after = next((ns for ns in published if ns > at), None)
        if name == SPARED and after is not None: rows.append(((after - at) / 1e6, killed_soon(SPARED, at), at))
    return rows


def stop_ages(trace):
    """Ages in ms at which the base latched the stop command: (the largest, the largest while robot had been killed twice within
    2 s, or the base and the lasers were just back from a kill of their own)."""
    excused = [at for at, name in struck if name == "devices" or name == SPARED and killed_soon(SPARED, at)]
    largest = [0.0, 0.0]
    for job in jobs_of(trace, "base"):
        for edge, _, stamp in job["latched"]:
            kind = any(at <= job["start_ns"] <= at + SOON_NS for at in excused)
            largest[kind] = max(largest[kind], (job["start_ns"] - stamp) / 1e6)
    return largest


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
        o["ready_s"] = o["phases_ms"]["running"] / 1e3 - max(o["kills"], default=0)
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
        at = time.monotonic_ns()
        try: os.kill(pid, signal.SIGKILL)
        except ProcessLookupError: continue
        struck.append((at, name))
    time.sleep(max(0, last + 5 - time.monotonic()))
    late = open_things(run.pid) if run.poll() is None else []
    code = run.wait()
    if not os.path.exists(f"{work}/killed.json"): sys.exit(f"no report, exit {code}, killed {struck}:\n" + open(f"{work}/killed.log").read()[-3000:])
    report = json.load(open(f"{work}/killed.json"))
    holes = host_holes.end(watch, f"{work}/holes")
    misses = missed(report, holes)
    outages = [f for f in report["faults"] if f.get("kind") == "outage"]
    ended = with_kills(outages)
    trace = json.load(open(f"{work}/killed.trace"))
    to_stop, ages = stops(trace), stop_ages(trace)
    print(open(f"{work}/killed.log").read()[-3000:] if code not in (0, 1) else "", end="")
    after, room_after = traces(), bandwidth()

chunks = report["memory"]["chunks_at_end"]
back, away = sorted(o["recovery_s"] for o in ended), sorted(o["down_s"] for o in ended)
pick = lambda values, q: values[min(len(values) - 1, int(q * len(values)))] if values else float("nan")
print(f"{len(struck)} kills in {report['duration_s']:.0f} s, policy {report['policy_granted']}, {report['transport']} transport, "
      f"host stall {report['host_stall_ms']} ms, seen away {len(holes)} times, {sum(end - begin for _, begin, end in holes) / 1e6:.0f} ms; exit {code}")
print(f"{'process':12}{'outages':>8}{'by spare':>9}  from the last kill: workers wait p50, p99, max; every node has run p50, max [s]")
ready_p99 = {}
for process in sorted({o["process"] for o in ended}):
    mine = [o for o in ended if o["process"] == process]
    ready, ran = sorted(o["ready_s"] for o in mine), sorted(o["recovery_s"] for o in mine)
    ready_p99[process] = pick(ready, .99)
    print(f"{process:12}{len(mine):8}{sum(o['by_spare'] for o in mine):9}  {pick(ready, .5):.3f} {pick(ready, .99):.3f} {pick(ready, 1):.3f}; "
          f"{pick(ran, .5):.3f} {pick(ran, 1):.3f}")
quick, again = (sorted(ms for ms, soon, _ in to_stop if soon == kind) for kind in (False, True))
print(f"from the kill of {SPARED} to the next stop command: p50 {pick(quick, .5):.0f} ms, p99 {pick(quick, .99):.0f} ms, max {pick(quick, 1):.0f} ms of "
      f"{len(quick)}; within 2 s of another kill of it: max {pick(again, 1):.0f} ms of {len(again)}")
print(f"obstacle_stop.stop -> base.stop: at most {ages[0]:.0f} ms old; {ages[1]:.0f} ms within 2 s of a kill of devices or a second one of {SPARED}; max_age {MAX_AGE_MS} ms")
for spare in report.get("spares", []):
    print(f"spare of {spare['process']}: {spare['takeovers']} takeovers, not ready {spare['not_ready']}, lost {spare['lost']}, ready within "
          f"{spare['ready_within_s']:.2f} s, {spare['memory_mb']:.0f} MB, {spare['cpu_s']:.2f} s of CPU")
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
if not iceoryx:
    for process, ready in ready_p99.items():
        limit = 1.0 if process in LEARNED else 0.5
        if ready > limit: bad.append(f"{process} back {ready:.2f} s (p99) after its last kill, more than {limit} s")
    if quick and pick(quick, .99) > 100: bad.append(f"{pick(quick, .99):.0f} ms (p99) from a kill of {SPARED} to the next stop command, more than 100")
    if again and pick(again, 1) > 500: bad.append(f"{pick(again, 1):.0f} ms from a second kill of {SPARED} to the next stop command, more than 500")
    if ages[0] > MAX_AGE_MS: bad.append(f"the base latched a stop command of {ages[0]:.0f} ms, more than {MAX_AGE_MS}")
elif back and back[-1] > 2: bad.append(f"back {back[-1]:.2f} s after its last kill, more than 2 s")
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
