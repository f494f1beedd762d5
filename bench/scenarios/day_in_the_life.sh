#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A graph whose devices are all doubles at byte level, with everything on: day_in_the_life.sh [MINUTES] [SEED]
# Default: 30 minutes of graph/ace.yaml (GRAPH=FILE: another one), profile doubles, recorded (RECORD=FILE keeps the record;
# it is some 40 MB a second, so by default it goes to /dev/null). It prints which rates were kept, what each device lost,
# memory and descriptors at the start, in the middle and at the end, deadlines missed, and how long the host was seen away
# (tests/tools/host_holes.py). With a SEED (and at least 2 minutes) a device misbehaves every 12 seconds for 3, in every way
# that its double knows.
# Exit 1 if memory or descriptors grew, a device was not well at the end, obstacle_stop missed a deadline, a node with a
# rate had fewer than 99 of 100 jobs while it was to run, the record lost anything, or, without a SEED, a device had
# damaged or missing data, left commands unsent, or was away after its start.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/tests/tools" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "${GRAPH:-$root/graph/ace.yaml}" "$@" <<'PY'
import host_holes, json, os, random, re, subprocess, sys, tempfile, time

takt, graph, args = sys.argv[1], sys.argv[2], sys.argv[3:]
seconds = int(float(args[0] if args else 30) * 60)
seed = int(args[1]) if len(args) > 1 else None
# What each kind's double knows that its device may really do; frozen lines and axes are nothing that a driver can see.
words = {
    "stereo_camera": ["silent", "unplugged", "garbage", "frozen", "repeated", "flagged", "cut", "empty", "io_error", "end_of_stream", "queue_error"],
    "lms200": ["silent", "unplugged", "garbage", "frozen", "wrong_crc", "wrong_baud", "dazzled", "polluted"],
    "lms400": ["silent", "unplugged", "garbage", "frozen", "wrong_crc"],
    "camera_head": ["silent", "unplugged", "garbage", "repeated", "wrong_crc", "masquerade", "lost_frames", "no_heartbeat", "bus_off"],
    "mobile_base": ["silent", "unplugged", "garbage", "repeated", "wrong_crc", "masquerade", "lost_frames", "no_heartbeat", "bus_off"],
    "digital_lines": ["unplugged"],
}
devices = {d: model or kind for d, kind, model in re.findall(r"^  (\w+): \{kind: (\w+)(?:, model: (\w+))?", open(graph).read(), re.M)}
told = {d: [] for d in devices}
if seed is not None:
    orders = [(d, w) for d, kind in devices.items() for w in words.get(kind, [])]
    random.Random(seed).shuffle(orders)
    for i, t in enumerate(range(20, seconds - 20, 12)):
        device, word = orders[i % len(orders)]
        told[device].append(f"{word} {t}s..{t + 3}s")
options = [f"--set={d}.failures={', '.join(failures)}" for d, failures in told.items() if failures]

with tempfile.TemporaryDirectory(prefix="day-") as work:
    log = open(f"{work}/log", "w")
    watch = host_holes.start(f"{work}/holes")
    run = subprocess.Popen([takt, "run", graph, "--profile", "doubles", "--for", f"{seconds}s", "--output", f"{work}/out",
                            "--report", f"{work}/report.json", "--record", os.environ.get("RECORD", "/dev/null"), *options], stdout=log, stderr=log)

    def reading():
        """Memory that is no file (proportional, MB), descriptors and threads of all processes of the run. Pages of libraries are not
        the run's: how many count as its own depends on who else has them mapped."""
        pids, pss, files, threads = [run.pid], 0, 0, 0
        for pid in pids:
            try:
                for task in os.listdir(f"/proc/{pid}/task"):
                    pids += [int(c) for c in open(f"/proc/{pid}/task/{task}/children").read().split()]
                    threads += 1
                files += len(os.listdir(f"/proc/{pid}/fd"))
                pss += sum(int(l.split()[1]) for l in open(f"/proc/{pid}/smaps_rollup") if l.startswith(("Pss_Anon:", "Pss_Shmem:")))
            except OSError: pass
        return pss / 1024, files, threads

    samples = []
    while run.poll() is None:
        time.sleep(5)
        if run.poll() is None: samples.append(reading())
    if not os.path.exists(f"{work}/report.json"): sys.exit("no report:\n" + open(log.name).read()[-3000:])
    report = json.load(open(f"{work}/report.json"))
    holes_ms = [(end - begin) / 1e6 for _, begin, end in host_holes.end(watch, f"{work}/holes")]

duration = report["duration_s"]
print(f"{report['graph']}: {duration:.0f} s, policy {report['policy_granted']}, {len(report['processes']) or 1} processes, CPU {report['cpu']['utilisation']:.2f} cores, "
      f"host stall {report['host_stall_ms']} ms, seen away {len(holes_ms)} times, longest {max(holes_ms, default=0):.0f}, in all {sum(holes_ms):.0f} ms" + (f", {sum(map(len, told.values()))} misbehaviours (seed {seed})" if seed is not None else ""))
bad = []
for n in report["nodes"]:
    if n["rate_hz"] and n["completed"] < 0.99 * n["rate_hz"] * n["active_s"] - 1: bad.append(f"{n['name']} did not keep its rate")
    rate = f"{n['completed'] / max(n['active_s'], 1e-9):.2f} of {n['rate_hz']:g} Hz" if n["rate_hz"] else "on demand"
    print(f"{n['name']:18}{n['criticality']:>7}  {rate:18} released {n['released']:6} done {n['completed']:6} skipped {n['skipped']:4} no result {n['no_result']:5} miss {n['deadline_misses']:4}")
for d in report["devices"]:
    print(f"device {d['name']:15} {d['state']:12} received {d['received']:7} damaged {d['damaged']:5} resyncs {d['resyncs']:5} missing {d['missing']:5} unsent {d['unsent']:5}; "
          f"lost {d['losses']} times, {d['lost_s']:.1f} s" + (f"; {d['trouble']}" if d["trouble"] else ""))
    if d["state"] != "ok": bad.append(f"{d['name']} is {d['state']} at the end")
    if seed is None and d["damaged"] + d["resyncs"] > 0: bad.append(f"{d['name']} had damaged data")
    if seed is None and d["missing"] + d["unsent"] > 0: bad.append(f"{d['name']} has {d['missing']} missing, {d['unsent']} unsent")
    if seed is None and d["losses"] > 1: bad.append(f"{d['name']} was lost {d['losses']} times")
high = [n for n in report["nodes"] if n["criticality"] == "high"]
print(f"deadlines missed by nodes of high criticality: {sum(n['deadline_misses'] for n in high)} of {sum(n['released'] for n in high)}; "
      f"changes of mode: {len(report['modes']) - 1}")
if any(n["name"] == "obstacle_stop" and n["deadline_misses"] for n in high): bad.append("obstacle_stop missed a deadline")
print(f"record: {report['record']}")
if report["recorder_lost"]: bad.append(f"the record lost {report['recorder_lost']}")
tenth = max(1, len(samples) // 10)
middle = lambda part: tuple(sorted(column)[len(part) // 2] for column in zip(*part))
early, half, late = middle(samples[tenth:2 * tenth] or samples), middle(samples[len(samples) // 2:][:tenth]), middle(samples[-tenth - 1:-1] or samples)
print("in the second tenth, the middle and the last tenth: memory " + ", ".join(f"{s[0]:.1f}" for s in (early, half, late)) + " MB; descriptors " +
      ", ".join(str(s[1]) for s in (early, half, late)) + "; threads " + ", ".join(str(s[2]) for s in (early, half, late)))
if late[0] > 1.02 * early[0] + 2: bad.append(f"memory grew from {early[0]:.1f} to {late[0]:.1f} MB")
if late[1] > early[1] + 2: bad.append(f"descriptors grew from {early[1]} to {late[1]}")
for what in bad: print("FAILED:", what)
sys.exit(bool(bad))
PY
