#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Does a run whose processes are killed replay? record_restarts.sh [SECONDS] [KILLS] [SETS] [SEED]
# Default: 60 s, 20 kills, 10 sets, seed 1. The main graph runs with a process for each subsystem and is recorded. Its processes
# are killed at random instants, every second one at a random step of a message of a random output; values are set in between.
# Then every job runs again, in one process and in as many as the run had. Exit 1 if a message differs or cannot be compared,
# or if fewer kills struck; 3 if nothing differs, but the recorder lost something, as where the machine stood for 250 ms.
root=$(readlink -f "$(dirname "$0")/../..")
exec python3 - "${TAKT:-$root/takt}" "$root" "$@" <<'PY'
import json, os, random, re, subprocess, sys, tempfile, time

takt, root = sys.argv[1:3]
seconds, kills, sets, seed = (int(given) for given in (sys.argv[3:] + [60, 20, 10, 1][len(sys.argv) - 3:]))
rng = random.Random(seed)
PROCESSES = ["devices", "robot", "detection", "people", "mapping", "mind"]
STEPS = ["after_loan", "half_written", "inside_publish", "after_publish", "inside_commit", "after_commit"]
OUTPUTS = ["head_camera.pair", "front_laser.scan", "obstacle_stop.stop", "stereo.disparity", "stereo.cloud", "ego_motion.motion",
           "robot_pose.odometry", "scan_matching.map", "object_detection.detections", "stereo_wide.cloud", "body_pose.bodies", "semantic.requests"]
VALUES = {"obstacle_stop.scan_age_max": ["150ms", "180ms", "250ms"], "obstacle_stop.beams_min": ["2", "3", "4"],
          "stereo.search": ["48", "64", "96"]}
first, last = 2.0, seconds - 3.0  # the last one is back before the end
faults = []
for k in range(kills):
    at = f"at: {first + (last - first) * (k + rng.random()) / kills:.3f}s"
    if k % 2: faults.append(f"{{kind: kill_at_step, target: {rng.choice(OUTPUTS)}, step: {rng.choice(STEPS)}, {at}}}")
    else: faults.append(f"{{kind: kill, target: {rng.choice(PROCESSES)}, {at}}}")
code = 0


def wrong(what):
    global code
    code = 1
    print(f"WRONG: {what}", flush=True)


with tempfile.TemporaryDirectory(prefix="restarts-") as work:
    with open(f"{work}/scenario.yaml", "w") as f:
        f.write("takt: 1\nname: restarts\nfaults:\n" + "".join(f"  - {fault}\n" for fault in faults))
    run = subprocess.Popen([takt, "run", f"{root}/graph/ace.yaml", "--isolate", "subsystem", "--for", f"{seconds}s", "--record", f"{work}/run.mcap",
                            "--faults", f"{work}/scenario.yaml", "--report", f"{work}/run.json", "--output", f"{work}/out"]
                           + os.environ.get("RUN_OPTIONS", "").split(), stdout=open(f"{work}/log", "w"), stderr=subprocess.STDOUT)
    began, done = None, 0
    while run.poll() is None and done < sets:
        if began is None:
            if subprocess.run([takt, "top", "--once", "--run", str(run.pid)], capture_output=True).returncode == 0: began = time.monotonic()
            time.sleep(0.1)
        elif time.monotonic() - began < first + (last - first) * done / sets: time.sleep(0.05)
        else:  # refused while the process is away
            name = rng.choice(list(VALUES))
            done += subprocess.run([takt, "set", name, rng.choice(VALUES[name]), "--run", str(run.pid)], capture_output=True).returncode == 0
    run.wait()
    try: report = json.load(open(f"{work}/run.json"))
    except OSError: sys.exit(f"no report, exit {run.returncode}: {open(f'{work}/log').read()[-500:]}")
    info = json.loads(subprocess.run([takt, "log", "info", f"{work}/run.mcap", "--json"], capture_output=True, text=True).stdout)
    struck = sum(fault["struck"] for fault in report["scenario"]["faults"])
    outages = [fault for fault in report["faults"] if fault.get("kind") == "outage"]
    record = report["record"]
    print(f"recorded {report['duration_s']:.0f} s, policy {report['policy_granted']}, seed {seed}: {record['messages']} messages, {record['jobs']} jobs, "
          f"events {info['events']}, lost {record['lost']}", flush=True)
    print(f"{struck} kills struck, {len(outages)} outages, {done} values set, {sum(n['cut_off'] for n in info['nodes'])} jobs cut off, "
          f"{sum(n['restarts'] for n in info['nodes'])} tasks started again", flush=True)
    if struck < 0.8 * kills or done < sets: wrong(f"{struck} of {kills} kills, {done} of {sets} values")
    for more in ([], ["--isolate", "subsystem"]):
        replay = subprocess.run([takt, "replay", f"{work}/run.mcap", "--compare", "--output", f"{work}/again"] + more, capture_output=True, text=True)
        print(replay.stdout.strip(), flush=True)
        same = re.search(r"; 0 differ$", replay.stdout, re.M)
        if not same or replay.returncode != 0 and not report["recorder_lost"]: wrong(f"replay {more}: exit {replay.returncode} {replay.stderr}")
    if report["recorder_lost"]:
        missing = ", ".join(f"{port['missing']} of {port['port']}" for port in info["ports"] if port["missing"])
        print(f"the recorder lost something: this run shows little. Missing: {missing or 'nothing between others'}; "
              f"its thread was away for {record['longest_pause_ms']:.0f} ms at most")
        code = code or 3
    if code and os.environ.get("KEEP"): subprocess.run(["cp", "-r", work, os.environ["KEEP"]])
sys.exit(code)
PY
