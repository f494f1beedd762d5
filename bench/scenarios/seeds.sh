#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A scenario over seeds, in virtual time: seeds.sh FILE N [JOBS] [SHARE]. Runs `takt run FILE --clock virtual --seed k` for k = 1..N, JOBS at a
# time (default 1), and prints how many ended as expected, after how long, and what each other one did not meet. Exit 1 if they are less than
# SHARE (default 1) of all, 2 if the file is wrong. Needs the built takt alone: TAKT=PATH if it is not this tree's; REPORTS=DIR keeps the reports.
set -eu
[ $# -ge 2 ] || { sed -n 3,5p "$0" >&2; exit 2; }
root=$(readlink -f "$(dirname "$0")/../..")
export TAKT=${TAKT:-$root/build/release/graph/command/takt} FILE=$1
seeds=$2 jobs=${3:-1} share=${4:-1}
[ -x "$TAKT" ] || { echo "$TAKT: no such program; build it, or say TAKT=PATH" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export REPORTS=${REPORTS:-$work}
mkdir -p "$REPORTS"

one_run() { # SEED
  local at=$REPORTS/$1 code=0
  rm -f "$at.json"
  "$TAKT" run "$FILE" --clock virtual --seed "$1" --output "$at.files" --report "$at.json" >"$at.log" 2>&1 </dev/null || code=$?
  rm -rf "$at.files"
  echo "$code" >"$at.exit"
}
export -f one_run
seq "$seeds" | xargs -P "$jobs" -I{} bash -c 'one_run {}'

python3 - "$FILE" "$REPORTS" "$seeds" "$share" <<'PY'
import collections, json, os, statistics, sys
file, reports, seeds, share = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
took, unmet, wrong = [], collections.Counter(), False
for seed in range(1, seeds + 1):
    code = int(open(f"{reports}/{seed}.exit").read())
    name = f"{reports}/{seed}.json"
    if code not in (0, 1) or not os.path.exists(name):
        wrong |= code == 2
        unmet[f"no report, exit {code}"] += 1
        print(f"seed {seed}: exit {code}: " + " | ".join(open(f"{reports}/{seed}.log", errors="replace").read().splitlines()[-3:]))
        continue
    report = json.load(open(name))
    if code == 0:
        took.append(report["duration_s"])
        continue
    lacking = [c for c in report.get("expectations", {}).get("conditions", []) if not c["met"]]
    unmet.update(f"{c['what']} {c['expected']}" for c in lacking)
    print(f"seed {seed}, {report['duration_s']:.1f} s: " +
          ("; ".join(f"{c['what']} {c['expected']}: {c['observed']}" for c in lacking) or "not ok, and nothing was expected of it"))
for what, times in unmet.most_common():
    print(f"{times:4} x unmet: {what}")
print(f"{file}: {len(took)} of {seeds} seeds as expected ({100 * len(took) / seeds:.0f} %)" +
      (f", after {min(took):.1f} to {max(took):.1f} s, median {statistics.median(took):.1f} s" if took else ""))
sys.exit(2 if wrong else len(took) < share * seeds)
PY
