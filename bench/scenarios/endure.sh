#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A run with a fault every ten seconds, of all kinds in turn: endure.sh [MINUTES] [SEED] [takt run options...]
# Default: 30 minutes. Each fault must strike, obstacle_stop must not miss a deadline, and whatever else a scenario always
# expects (docs/faults.md) must be met; memory must stay flat: what supervisor and members have for themselves is sampled,
# and the last tenth compared with a tenth behind the first fault of each kind, or behind half of a shorter run: what a fault makes a
# process take for the first time it keeps. Exit 1 if any of it is broken. With --trace FILE it says
# why a deadline was missed, and memory is not judged, since the trace is kept in it. The run is recorded, for faults of the
# disk: 2 GB a minute in the temporary folder.
# Beside the run stands how late cyclictest was woken on the same CPUs: what no program could help.
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1
exec python3 - "${TAKT:-$root/takt}" "$root" "$@" <<'PY'
import collections, host_probe, json, os, processes, random, subprocess, sys, tempfile, time

takt, root, args = sys.argv[1], sys.argv[2], sys.argv[3:]
minutes = float(args[0]) if args else 30
chance = random.Random(int(args[1]) if len(args) > 1 else 1)
options = args[2:]
seconds = int(minutes * 60)
kinds = [  # {t}: when it begins; {u}: three seconds later, {v}: eight, since a message is held at each publication
    "{{kind: kill, target: mapping, at: {t}s}}",
    "{{kind: unplugged, target: head_camera, from: {t}s, to: {u}s}}",
    "{{kind: corrupt, target: stereo.disparity, from: {t}s, to: {u}s}}",
    "{{kind: hang, target: object_detection, at: {t}s, for: 0s}}",
    "{{kind: cpu_hog, from: {t}s, to: {u}s, threads: 2}}",
    "{{kind: drop, target: head_camera.pair, from: {t}s, to: {u}s, probability: 0.5}}",
    "{{kind: stop_process, target: detection, at: {t}s, for: 5s}}",
    "{{kind: silent, target: front_laser, from: {t}s, to: {u}s}}",
    "{{kind: memory_hog, megabytes: 200, from: {t}s, to: {u}s}}",
    "{{kind: kill_at_step, target: stereo.cloud, step: inside_publish, at: {t}s}}",
    "{{kind: slow_consumer, target: mapping_3d, by: 150ms, from: {t}s, to: {u}s}}",
    "{{kind: exhausted_pool, target: ego_motion.motion, from: {t}s, to: {v}s}}",
    "{{kind: kill, target: mind, at: {t}s}}",
    "{{kind: frozen, target: head_camera, from: {t}s, to: {u}s}}",
    "{{kind: delay, target: front_laser.scan, by: 50ms, from: {t}s, to: {u}s}}",
    "{{kind: kill, target: devices, at: {t}s}}",
    "{{kind: garbage, target: front_laser, from: {t}s, to: {u}s}}",
    "{{kind: kill, target: detection, at: {t}s}}",
    "{{kind: duplicate, target: front_laser.scan, from: {t}s, to: {u}s}}",
    "{{kind: truncate, target: stereo.cloud, from: {t}s, to: {u}s}}",
    "{{kind: freeze, target: stereo.disparity, from: {t}s, to: {u}s}}",
    "{{kind: reorder, target: front_laser.scan, from: {t}s, to: {u}s}}",
    "{{kind: clock_step, target: head_camera.pair, by: -200ms, from: {t}s, to: {u}s}}",
    "{{kind: slow_disk, bytes_per_s: 2000, from: {t}s, to: {u}s}}",
    "{{kind: full_disk, megabytes: 0.001, from: {t}s, to: {u}s}}",
]
known = json.load(open(f"{root}/graph/schema/faults.schema.json"))["definitions"]["fault"]["properties"]["kind"]["enum"]
if lacking := [kind for kind in known if not any(f"kind: {kind}," in line for line in kinds)]: sys.exit(f"endure.sh has no fault of these kinds: {lacking}")
chance.shuffle(kinds)
kinds.sort(key=lambda line: "slow_disk" not in line)  # the first one: what the recorder lets wait (128 MB) is kept, so memory is judged behind it
with tempfile.TemporaryDirectory(prefix="endure-") as work:
    with open(f"{work}/scenario.yaml", "w") as f:
        f.write("takt: 1\nname: endure\nseed: 1\nfaults:\n")
        for i, t in enumerate(range(10, seconds - 10, 10)):
            f.write("  - " + kinds[i % len(kinds)].format(t=t, u=t + 3, v=t + 8) + "\n")
        f.write("expect:\n  misses: {obstacle_stop: 0}\n")
    log = open(f"{work}/log", "w")
    probe = host_probe.start(seconds, f"{work}/probe.json")
    run = subprocess.Popen([takt, "run", f"{root}/graph/ace.yaml", "--isolate", "subsystem", "--for", f"{seconds}s", "--faults", f"{work}/scenario.yaml",
                            "--output", f"{work}/out", "--report", f"{work}/report.json",
                            "--record", f"{work}/record.mcap", "--record-port", "front_laser.scan", *options], stdout=log, stderr=log)

    def resident_mb():
        """What each process has for itself, by name. Not what it maps: files of the ring come and go there."""
        found = collections.Counter()
        for pid in processes.family(run.pid):
            try: found[processes.name(pid)] += int(next(l for l in open(f"/proc/{pid}/smaps_rollup") if l.startswith("Pss_Anon:")).split()[1]) / 1024
            except (OSError, StopIteration): pass
        return found

    samples, end = [], time.monotonic() + seconds  # before the first process leaves: starting takes seconds, too
    while run.poll() is None:
        time.sleep(5)
        if time.monotonic() > end: continue
        try: samples.append(resident_mb())
        except OSError: pass
    if probe: probe.wait()
    beside = host_probe.text(f"{work}/probe.json", 29)
    if not os.path.exists(f"{work}/report.json"): sys.exit("no report:\n" + open(log.name).read()[-2000:])
    report = json.load(open(f"{work}/report.json"))
    traced = options[options.index("--trace") + 1] if "--trace" in options else None
    why = subprocess.run([takt, "explain", traced, "obstacle_stop"], capture_output=True, text=True).stdout if traced else ""
tenth = max(1, len(samples) // 10)
settled = int(len(samples) * min(0.5, (10 + 10 * len(kinds)) / seconds))
middle = lambda part: sorted(part, key=lambda sample: sample.total())[len(part) // 2]
before, after = middle(samples[settled:settled + tenth] or samples), middle(samples[-tenth - 1:-1] or samples)
early, late = before.total(), after.total()
outages = [f for f in report["faults"] if f.get("kind") == "outage"]
back = sorted(f["down_s"] for f in outages if f["back_s"] is not None)
faults = report["scenario"]["faults"]
print(f"{report['duration_s']:.0f} s, policy {report['policy_granted']}, host stall {report['host_stall_ms']} ms, {beside}: {len(faults)} faults, "
      f"{sum(f['struck'] > 0 for f in faults)} struck; {len(outages)} outages, {len(outages) - len(back)} not back"
      + (f", away p50 {back[len(back) // 2]:.2f} s, max {back[-1]:.2f} s" if back else ""))
print(f"modes {len(report['modes']) - 1} changes; resident memory {early:.0f} MB once it was settled, {late:.0f} MB in the last tenth")
for n in report["nodes"]:
    print(f"{n['name']:18}{n['criticality']:>6} released {n['released']:6} down {n.get('down', 0):5} done {n['completed']:6} miss {n['deadline_misses']:4}")
stop = next(n for n in report["nodes"] if n["name"] == "obstacle_stop")
bad = []
if stop["deadline_misses"]:
    above = [row for row in report["proofs"]["above_proof"] if row["what"] == "response of obstacle_stop"]
    bad.append(f"obstacle_stop missed {stop['deadline_misses']}: {above}\n{why.rstrip()}")
if len(outages) != len(back): bad.append("a process did not come back")
if idle := [f"{f['kind']} {f['target']}" for f in faults if f["struck"] == 0]: bad.append(f"did not strike: {idle}")
bad += [f"{row['what']}: expected {row['expected']}, observed {row['observed']}" for row in report["scenario"]["expectations"] if not row["met"]]
if run.returncode not in (0, 1): bad.append(f"exit {run.returncode}")
if not traced and late > 1.05 * early + 5: bad.append(f"memory grew from {early:.0f} to {late:.0f} MB: " + ", ".join(
    f"{name} {before[name]:.0f} to {after[name]:.0f} (every 10 s: {' '.join(f'{sample[name]:.0f}' for sample in samples[::2])})" for name in sorted(before | after) if after[name] > before[name] + 2))
for what in bad: print("FAILED:", what)
sys.exit(bool(bad))
PY
