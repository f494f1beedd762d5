#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Kills processes of a run at every step of a message's life: kill_steps.sh [REPEATS] [TRANSPORT or STEP...]
# Default: 50 repeats of all steps over local and iceoryx. One run for each step: the process of stereo (the writer of
# stereo.disparity), or of semantic (a reader of obstacle_stop.stop), is killed there every 4 s (over iceoryx less often), at
# the instants within inside_publish in turn. Prints for each step how often it struck, what came of it (the process came
# back, or the whole group was started anew), how long it took, and the chunks in use at the end beside those of a run
# without kills. Exit 1 if a kill did not strike, anybody did not come back, or a chunk is left taken.
root=$(readlink -f "$(dirname "$0")/../..")
exec python3 - "${TAKT:-$root/takt}" "$root" "$@" <<'PY'
import json, os, subprocess, sys, tempfile

takt, root, args = sys.argv[1], sys.argv[2], sys.argv[3:]
repeats = int(args[0]) if args else 50
writer = [(step, "stereo.disparity", None) for step in ("inside_loan", "after_loan", "half_written", "inside_publish",
                                                       "after_publish", "inside_commit", "after_commit")]
reader = [(step, "obstacle_stop.stop", "semantic") for step in ("inside_take", "while_held", "inside_release")]
of_own_pools = ("inside_loan", "inside_take")  # iceoryx has no such steps
known = ["local", "iceoryx"], [step for step, _, _ in writer + reader]
if unknown := [a for a in args[1:] if a not in known[0] + known[1]]:
    sys.exit(f"kill_steps.sh: {unknown[0]} is neither a transport ({', '.join(known[0])}) nor a step ({', '.join(known[1])})")
transports, steps = ([a for a in args[1:] if a in those] or those for those in known)
bad = 0
print(f"{'transport':10}{'step':16}{'struck':>7}{'back':>6}{'group':>7}{'away p50':>10}{'max':>8}  others' high-criticality misses; chunks at the end")


def run_it(work, transport, seconds, *more):
    """Its report; None if there is none, with the reason printed."""
    run = subprocess.run([takt, "run", f"{root}/graph/ace.yaml", "--isolate", "subsystem", "--transport", transport, "--for", f"{seconds}s",
                          "--output", f"{work}/out", "--report", f"{work}/report.json", *more], capture_output=True, text=True)
    try: return json.load(open(f"{work}/report.json"))
    except OSError: print(f"{transport}: no report, exit {run.returncode}: {run.stderr[-300:]}")


for transport in transports:
    with tempfile.TemporaryDirectory(prefix="steps-") as work:
        calm = run_it(work, transport, 30)
    if calm is None: sys.exit(1)
    for step, output, who in (of for of in writer + reader if of[0] in steps and (transport == "local" or of[0] not in of_own_pools)):
        with tempfile.TemporaryDirectory(prefix="steps-") as work:
            # Given up, by design, is a process that ends 12 times in 30 s, and a group that is lost six times.
            pace = 4 if transport == "local" else 8 if step == "inside_publish" else 5
            last = 3 + pace * repeats
            key = f", reader: {who}" if who else ""
            with open(f"{work}/scenario.yaml", "w") as f:
                f.write(f"takt: 1\nname: {step}\nfaults:\n  - {{kind: kill_at_step, target: {output}, step: {step}{key}, every: {pace}s, from: 3s, to: {last}s}}\n")
            report = run_it(work, transport, last + 8, "--faults", f"{work}/scenario.yaml")
        if report is None:
            bad = 1
            continue
        outages = [f for f in report["faults"] if f.get("kind") == "outage"]
        struck = report["scenario"]["faults"][0]["struck"]
        victim = "mind" if who else "mapping"
        mine = [o for o in outages if o["process"] == victim]
        group = sum("daemon" in o["cause"] or "supervisor" in o["cause"] for o in mine)
        back = sorted(o["down_s"] for o in mine if o["back_s"] is not None)
        members = set(mine[0]["nodes"]) if mine else set()
        misses = sum(n["deadline_misses"] for n in report["nodes"] if n["criticality"] == "high" and n["name"] not in members)
        chunks, calm_chunks = (r["memory"]["chunks_at_end"] for r in (report, calm))
        lost = len(mine) - len(back)
        bad |= lost > 0 or chunks > calm_chunks or min(struck, len(mine)) < repeats
        middle = back[len(back) // 2] if back else float("nan")
        print(f"{transport:10}{step:16}{struck:7}{len(back) - group:6}{group:7}{middle:9.2f}s{back[-1] if back else float('nan'):7.2f}s  {misses}; {chunks} "
              f"({calm_chunks} without kills)" + (f"; NOT BACK: {lost}" if lost else "")
              + ("; CHUNKS LEFT TAKEN" if chunks > calm_chunks else "") + (f"; OF {repeats}" if min(struck, len(mine)) < repeats else ""), flush=True)
        for o in mine:
            if o["back_s"] is None: print(f"    {o['what']}", flush=True)
sys.exit(bad)
PY
