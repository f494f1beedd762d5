#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Stray stores in one process of a run: wild.sh [STORES] [SEED] [takt run options...]; default: 200 stores, each 4 B to 1 MB,
# at random addresses of the memory that the process shares with others. Each goes through /proc/PID/mem, which refuses what
# the page tables refuse to the process itself: a store that is refused, or runs on into a page that nobody may touch, ends the
# process there (SIGSEGV), as its own would. The victim changes with each store. Needs the right to write to the memory of its children.
# Shown: what the stores hit; whether another process ended; whether a store changed a byte of another one's messages or
# records (each leaves a pattern that is looked for in all of the shared memory); damaged messages, withheld or lost, by name.
# What all processes write (logs of what was seen, commit words: docs/limits.md) counts as the victim's own.
# The spare of a victim takes its place, so its own name is gone for a while. Exit 1 if another process ended, or a byte
# elsewhere changed.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "$@" <<'PY'
import collections, json, os, processes, random, signal, subprocess, sys, tempfile, time

takt, args = sys.argv[1], sys.argv[2:]
stores = int(args[0]) if args else 200
chance = random.Random(int(args[1]) if len(args) > 1 else 1)
PAUSE_S = 3.2  # a process that ends 12 times in 30 s is given up, by design
Map = collections.namedtuple("Map", "begin end writable offset kind")


def shared_maps(pid):
    """Of pools (a memory file) and board (anonymous), in the order of their addresses."""
    maps = []
    for line in open(f"/proc/{pid}/maps"):
        span, rights, offset, _, inode, *name = line.split(None, 5)
        if rights[3] != "s": continue
        begin, end = (int(part, 16) for part in span.split("-"))
        kind = "pools" if name and "memfd:takt" in name[0] else "board" if name and "/dev/zero" in name[0] else None
        if kind: maps.append(Map(begin, end, "w" in rights, int(offset, 16), kind + inode))
    return maps


def find(pid, pattern):
    """Offsets in the shared memory, seen by another process, at which the pattern stands."""
    places = []
    with open(f"/proc/{pid}/mem", "rb", 0) as memory:
        for m in shared_maps(pid):
            memory.seek(m.begin)
            data, at = memory.read(m.end - m.begin), -1
            while (at := data.find(pattern, at + 1)) >= 0: places.append((m.kind, m.offset + at))
    return places


def store(pid, at, data):
    """How many bytes of it the process could have written."""
    done = 0
    with open(f"/proc/{pid}/mem", "r+b", 0) as memory:
        while done < len(data):
            page_left = 4096 - (at + done) % 4096
            try:
                memory.seek(at + done)
                done += memory.write(data[done:done + page_left])
            except OSError:
                break
    return done


with tempfile.TemporaryDirectory(prefix="wild-") as work:
    log = open(f"{work}/log", "w")
    length = stores * (PAUSE_S + 1.5) + 30
    run = subprocess.Popen([takt, "run", "--isolate", "subsystem", "--for", f"{length:.0f}s", "--output", f"{work}/out", "--report", f"{work}/report.json",
                            *args[2:]], stdout=log, stderr=log)
    while "completed:" not in open(log.name).read() and run.poll() is None: time.sleep(0.1)
    time.sleep(3)
    hits, struck, wrong, strangers, done = collections.Counter(), collections.Counter(), [], [], 0
    while done < stores and run.poll() is None:
        members = {processes.name(p): p for p in processes.children(run.pid)}
        name = chance.choice(sorted(members))
        pid = members[name]
        try:
            maps = shared_maps(pid)
            if len(maps) < 10: raise ProcessLookupError  # on its way back
            m = chance.choice(maps)
            size = int(4 * 2 ** chance.uniform(0, 18))
            at = chance.randrange(m.begin, m.end)
            pattern = chance.randbytes(16)
            data = (pattern * (size // 16 + 1))[:size]
            written = store(pid, at, data)
        except (OSError, ProcessLookupError):
            time.sleep(0.2)
            continue
        done += 1
        ended = written < size
        if ended: os.kill(pid, signal.SIGSEGV)
        hits[(m.kind.rstrip("0123456789"), "own" if m.writable else "others'", "ends it" if ended else "goes on")] += 1
        struck[name] += ended
        if written >= 16:  # only where the victim itself may write
            own = [(o.kind, o.offset, o.offset + o.end - o.begin) for o in maps if o.writable]
            for kind, offset in find(run.pid, pattern):
                if not any(k == kind and begin <= offset < end for k, begin, end in own): wrong.append((name, kind, offset))
        time.sleep(PAUSE_S / 2)
        now = {processes.name(p): p for p in processes.children(run.pid)}
        strangers += [other for other, p in members.items() if other not in (name, name + "-spare") and now.get(other) != p]
        time.sleep(PAUSE_S / 2)
    survived = run.poll() is None
    if survived: run.send_signal(signal.SIGINT)
    code = run.wait()
    said = open(log.name).read()
    report = json.load(open(f"{work}/report.json")) if os.path.exists(f"{work}/report.json") else {}

for (what, whose, end), count in sorted(hits.items()): print(f"{count:4d} stores into {whose} {what}: the process {end}")
print(f"{done} stores, {sum(struck.values())} ended their process: " + ", ".join(f"{n} {c}" for n, c in sorted(struck.items())))
print(f"other processes that ended: {len(strangers)} {' '.join(strangers)}; bytes changed elsewhere: {len(wrong)} places")
for row in wrong[:5]: print("  ", row)
damaged = [fault for fault in report.get("faults", []) if fault.get("kind") == "damaged"]
print(f"messages lost to readers: {sum(edge.get('damaged', 0) for edge in report.get('edges', []))}; named:")
for fault in damaged[:8]: print(f"   {fault['what']}")
print(f"the run {'went on to the end' if survived else 'ended early'}, exit code {code}")
if not survived: print(said[-1500:])
sys.exit(0 if survived and done == stores and not strangers and not wrong and report else 1)
PY
