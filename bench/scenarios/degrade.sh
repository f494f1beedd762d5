#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What `on_overrun: degrade` is worth: degrade.sh [SECONDS OF THE CAUSE]. The stereo node of the simulated robot is slowed
# while it runs: it is asked to search more disparities (`takt set stereo.search`), so that a job at full quality takes over
# twice its budget, and told to search the usual number again. It matches in large windows, in both directions, and does little
# else: by default its cost depends too little on the range. Budget and number follow from what a job costs here, which is
# measured first. Its deadline is twice the budget: what takes longer is late even if all CPUs are free. To make room for that,
# four of the dear nodes run at 2 Hz; the rest of the graph is the thesis's. It is not proven with the enforcement error of a
# virtual machine, and so runs `--unchecked`. The same run twice, with `continue` and with `degrade`. Exit 1 unless a job took
# twice its budget, more than 30 % were late or skipped meanwhile without `degrade`, less than 1 % with it, and level 0 was back
# within 5 s of the cause's end; 3 where SCHED_DEADLINE, which makes an overrun late, is refused.
# `degrade.sh inputs` only makes the schedule and has it read.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1 TAKT_HOME="$root"
if [ -z "${TAKT:-}" ]; then
  "$root/takt" nodes >/dev/null  # builds it; from here on without the launcher, which looks for changes each time
  TAKT=${TAKT_BUILD:-$root/build/release}/graph/command/takt
fi
work=$(mktemp -d)
trap 'rm -rf "$work"; kill $(jobs -p) 2>/dev/null || true' EXIT
export XDG_RUNTIME_DIR=$work  # no other run is in the way
cat >"$work/degrade.py" <<'PY'
import json, statistics, subprocess, sys, time
from schedule_lines import Schedule, in_us
root, takt, work, cause = sys.argv[1:]
BEFORE, AFTER, RATE = 6, 10, 15
MOST = 512             # disparities that the node can search
TWICE = (2.3, 2.5, 2.8)  # least, wanted and most of a slowed job over its budget, as measured: a shared machine may be faster later
DEAR = ("n_square=31", "n_min=1", "left_right_check=true", "cloud_step=16", "row_check=false", f"disparities={MOST}")
QUIET = dict(stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def schedule(verb, **says):
    made = Schedule(f"{root}/schedules/thesis.yaml")
    for node in ("stereo_wide", "traffic_signs", "body_pose", "object_detection"): made.change(node, rate="2", deadline="450ms")
    made.change("stereo", rate=str(RATE), on_overrun=verb, **says)
    made.write(f"{work}/{verb}.yaml")
    return ["--schedule", f"{work}/{verb}.yaml", *(word for value in DEAR for word in ("--set", f"stereo.{value}"))]


def run(verb, search, seconds, *options, **says):
    return [takt, "run", f"{root}/graph/ace.yaml", "--for", f"{seconds}s", *schedule(verb, **says), "--set", f"stereo.search={search}",
            "--output", f"{work}/out", "--report", f"{work}/{verb}.json", *options]


def stereo_of(told): return next(node for node in told["nodes"] if node["name"] == "stereo")
def report(verb): return json.load(open(f"{work}/{verb}.json"))


def cost_ms(search):
    """Median CPU time of a job at full quality."""
    subprocess.run(run("continue", search, 5, "--policy", "cooperative"), **QUIET)
    stereo = stereo_of(report("continue"))
    if 2 * stereo["no_result"] > stereo["samples"]: sys.exit("stereo gets no images: this machine is too busy to measure what a job takes")
    return stereo["exec_ms"]["p50"]


def choose():
    """(budget in ms, usual search, the long one)"""
    dearest = cost_ms(MOST)
    for usual in (64, 32, 16):
        cheap = cost_ms(usual)
        budget = 2 * cheap  # leaves level 0 room for a noisy machine
        if dearest >= TWICE[0] * budget and 2 * budget <= 950 / RATE: break  # the deadline lies within the period
    else: sys.exit(f"searching {MOST} disparities takes {dearest:.1f} ms, {usual} {cheap:.1f}: no cause of twice a budget whose deadline fits; mend this script")
    many, reached = MOST, dearest
    for _ in range(4):
        if reached <= TWICE[2] * budget: break
        many = max(usual + 1, round(usual + (many - usual) * (TWICE[1] * budget - cheap) / (reached - cheap)))
        reached = cost_ms(many)
    print(f"a job takes {cheap:.1f} ms with {usual} disparities, {reached:.1f} with {many}; budget {budget:.1f} ms", flush=True)
    return budget, usual, many


def running_s():
    told = subprocess.run([takt, "top", "--once", "--json"], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    return json.loads(told.stdout)["running_s"] if told.returncode == 0 and told.stdout else -1


def slowed_run(verb, budget, usual, many):
    """The instants at which it was slowed and let go, and what `takt top` showed meanwhile."""
    process = subprocess.Popen(run(verb, usual, BEFORE + cause + AFTER, "--unchecked", budget=in_us(budget / 1000),
                                   deadline=in_us(2 * budget / 1000)), **{**QUIET, "stderr": open(f"{work}/{verb}.err", "w")})

    def wait_until(instant_s):
        while (now := running_s()) < instant_s:
            if process.poll() is not None: sys.exit(f"{verb}: the run ended with {process.returncode}: {open(f'{work}/{verb}.err').read()[-500:]}")
            time.sleep(0.2)
        return now
    wait_until(0)
    with open(f"{work}/{verb}.top", "w") as shown:
        top = subprocess.Popen([takt, "top", "--json"], **{**QUIET, "stdout": shown})
        instants = []
        for instant_s, search in ((BEFORE, many), (BEFORE + cause, usual)):
            instants.append(wait_until(instant_s))
            subprocess.run([takt, "set", "stereo.search", str(search)], check=True, **{**QUIET, "stderr": None})
        process.wait()
        top.wait()
    tops = [json.loads(line) for line in open(f"{work}/{verb}.top") if line.endswith("\n")]
    return instants, [(told["running_s"], stereo_of(told)) for told in tops]


def judge(verb, budget, instants, tops):
    """(share of jobs that were late or skipped while slowed, seconds until level 0 was back, least over budget) as shown"""
    told = report(verb)
    stereo, (begin_s, end_s) = stereo_of(told), instants
    first, last = (min(tops, key=lambda top: abs(top[0] - instant))[1] for instant in instants)
    bad = sum(last[key] - first[key] for key in ("deadline_misses", "skipped"))
    share = 100 * bad / (RATE * (end_s - begin_s))
    full = [node["exec_ms"] for at_s, node in tops if begin_s + 1 < at_s < end_s and node["level"] == 0]
    over = statistics.median(full) / budget if full else None
    changes = [(change["at_s"], change["level"]) for change in stereo["quality_changes"]["last"]]
    level = changes[-1][1] if changes else 0
    back_s = max([at_s - end_s for at_s, to in changes if at_s > end_s], default=0) if level == 0 else None
    others = sum(node["deadline_misses"] for node in told["nodes"] if node["criticality"] == "high" and node["name"] != "stereo")
    print(f"{verb:<9} slowed from {begin_s:.1f} to {end_s:.1f} s: {bad} late or skipped ({share:.1f} %), in the whole run "
          f"{stereo['deadline_misses']} late, {stereo['skipped']} skipped of {stereo['released']}; "
          + (f"jobs at level 0 took {over:.2f} budgets" if over else "no job at level 0 was seen")
          + f"; jobs by level {stereo['quality']}; policy {told['policy_granted']}, host stall {told['host_stall_ms']} ms, "
          f"misses of other high-criticality nodes {others}")
    if changes: print("          level changes: " + ", ".join(f"{to} at {at_s:.2f} s" for at_s, to in changes))
    return told["policy_granted"], share, back_s, over


if cause == "inputs":
    sys.exit(subprocess.run([takt, "check", f"{root}/graph/ace.yaml", *schedule("degrade", budget="10ms", deadline="20ms")], **QUIET).returncode > 1)
cause = float(cause)
chosen = choose()
granted, without, _, over = judge("continue", chosen[0], *slowed_run("continue", *chosen))
_, with_it, back_s, _ = judge("degrade", chosen[0], *slowed_run("degrade", *chosen))
if granted != "deadline":
    print("not judged: needs SCHED_DEADLINE")
    sys.exit(3)
wrong = [what for what, ok in ((f"a slowed job took {over or 0:.2f} budgets, not 2", over and over >= 2),
                               (f"without degrade {without:.1f} % and not above 30 %", without > 30),
                               (f"with degrade {with_it:.1f} % and not below 1 %", with_it < 1),
                               (f"level 0 was back after {back_s} s and not within 5", back_s is not None and back_s <= 5)) if not ok]
print("\n".join(wrong) or f"degrade: {without:.1f} % -> {with_it:.1f} %, level 0 back {back_s:.2f} s after the cause")
sys.exit(len(wrong) > 0)
PY
python3 "$work/degrade.py" "$root" "$TAKT" "$work" "${1:-20}"
