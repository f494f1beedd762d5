#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# How well `takt replay --schedule --cores` predicts: what_if.sh [virtual] [SECONDS]. Records the simulated robot once on the
# thesis's schedule, predicts it on other schedules and cores, and runs the same there; prints the deadline misses and the chain
# ages of both, predicted / run. The runs are real ones, under the policy of each schedule (root); `virtual`: record and runs are
# in virtual time, with times of jobs that are drawn by the seed, so that both have the same. Threads under `deadline` use all
# cores, so one core is tried under `fixed`. Exit 3 where a policy is refused. `what_if.sh inputs` only makes the schedules and
# has them read.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
export PYTHONPATH="$root/bench/scenarios" PYTHONDONTWRITEBYTECODE=1 TAKT_HOME="$root"
if [ -z "${TAKT:-}" ]; then
  "$root/takt" nodes >/dev/null  # builds it
  TAKT=${TAKT_BUILD:-$root/build/release}/graph/command/takt
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export XDG_RUNTIME_DIR=$work  # no other run is in the way
cat >"$work/what_if.py" <<'PY'
import json, subprocess, sys
from schedule_lines import Schedule
root, takt, work, *words = sys.argv[1:]
inputs, virtual = "inputs" in words, "virtual" in words
LENGTH = next((int(word) for word in words if word.isdigit()), 10 if virtual else 20)
CLOCK = ["--clock", "virtual", "--durations", "random", "--seed", "1"] if virtual else []
SLOW = {"stereo": "10", "object_detection": "5", "traffic_signs": "2", "stereo_wide": "2", "body_pose": "2"}
# Near what half of the jobs take, so that some are late. Their budgets stay: the kernel would grant no reservations for that.
TIGHT = ({"stereo": "14ms", "ego_motion": "9ms", "ground_map": "6ms", "object_detection": "9ms", "mapping_3d": "22ms"} if virtual else
         {"stereo": "5700us", "ego_motion": "4100us", "ground_map": "1700us", "object_detection": "5ms", "mapping_3d": "9ms"})


def changed(name, policy, cores, rates={}, deadlines={}):
    made = Schedule(f"{root}/schedules/thesis.yaml")
    for node, rate in rates.items(): made.change(node, rate=rate)
    for node, deadline in deadlines.items(): made.change(node, deadline=deadline)
    made.lines = [f"policy: {policy}\ncores: {cores}" if line.startswith("policy:") else line for line in made.lines]
    made.write(f"{work}/{name}.yaml")
    return name, len(cores)


VARIANTS = [
    changed("thesis", "deadline", [0, 1]),
    changed("slow", "deadline", [0, 1], rates=SLOW),
    changed("fixed", "fixed", [0, 1]),
    changed("tight", "fixed", [0, 1], deadlines=TIGHT),
    changed("fixed_one", "fixed", [0]),
    changed("slow_one", "fixed", [0], rates=SLOW),
    changed("tight_one", "fixed", [0], deadlines=TIGHT),
]


def call(*words, codes=(0, 1)):
    done = subprocess.run([takt, *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode not in codes:
        print(done.stderr[-2000:], file=sys.stderr)
        sys.exit(3 if done.returncode == 3 else 1)


def run(name, *more):
    call("run", f"{root}/graph/ace.yaml", "--for", f"{LENGTH}s", "--schedule", f"{work}/{name}.yaml", "--unchecked", *CLOCK, "--output", f"{work}/out",
         "--report", f"{work}/{name}.json", *more)
    report = json.load(open(f"{work}/{name}.json"))
    if not virtual and report["policy_granted"] != report["policy_asked"]:
        print(f"{name}: the policy {report['policy_asked']} was refused: {report['adjusted']}", file=sys.stderr)
        sys.exit(3)
    return report


def named(entries): return {entry["name"]: entry for entry in entries}
def ms(value): return "-" if value is None else f"{value:.1f}"


def print_comparison(name, cores, told, real):
    predicted = told["predicted"]
    print(f"\n{name}: policy {told['what_if']['policy']}, {cores} core{'s' * (cores > 1)}, {LENGTH} s; predicted / run")
    pairs = [(node["name"], node["criticality"], node["deadline_misses"], named(real["nodes"])[node["name"]]["deadline_misses"],
              node["samples"]) for node in predicted["nodes"]]
    for which in ("high", "low"):
        print(f"  misses, {which}: {sum(p[2] for p in pairs if p[1] == which)} / {sum(p[3] for p in pairs if p[1] == which)}"
              f" of {sum(p[4] for p in pairs if p[1] == which)} jobs")
    for node, _, was, became, of in pairs:
        if was or became: print(f"    {node:18}{was:6} / {became:<6} of {of}")
    for chain in predicted["chains"]:
        other = named(real["chains"])[chain["name"]]["age_ms"]
        pair = lambda key: f"{ms(chain['age_ms'][key]):>7} / {ms(other[key]):<7}"
        print(f"  chain {chain['name']:10} p50 {pair('p50')} p99 {pair('p99')} max {pair('max')} ms")


for name, _ in VARIANTS: call("check", f"{root}/graph/ace.yaml", "--schedule", f"{work}/{name}.yaml", codes=(0, 1))
if inputs: sys.exit(0)
run("thesis", "--record", f"{work}/run.mcap")
for name, cores in VARIANTS:
    call("replay", f"{work}/run.mcap", "--schedule", f"{work}/{name}.yaml", "--cores", str(cores), "--report", f"{work}/{name}_told.json")
    print_comparison(name, cores, json.load(open(f"{work}/{name}_told.json")), run(name))
    sys.stdout.flush()
PY
status=0
python3 "$work/what_if.py" "$root" "$TAKT" "$work" "$@" || status=$?
exit $status
