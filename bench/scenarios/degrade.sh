#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What `on_overrun: degrade` is worth: degrade.sh [SECONDS OF THE CAUSE]. The stereo node of the simulated robot is slowed
# while it runs: it is asked to search more disparities (`takt set stereo.search`), so that a job at full quality takes over
# twice its budget, and told to search the usual number again. The same run twice, with `continue` and with `degrade`; the
# rest of the graph is the thesis's. Prints what was late while the cause lasted, and how soon after its end level 0 was back.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
cause=${1:-20}
before=6 after=10
usual=64 many=512
work=$(mktemp -d)
trap 'rm -rf "$work"; kill $(jobs -p) 2>/dev/null || true' EXIT

one_run() { # VERB
  # A budget that the usual search fits into and the long one exceeds twice; the other nodes keep theirs.
  sed -E -e "s/^( *stereo: \{.*budget: )[^,]+(,.*on_overrun: )degrade/\1${budget}\2$1/" \
    "$root/schedules/thesis.yaml" >"$work/$1.yaml"
  grep -q "stereo: .*budget: $budget,.*on_overrun: $1" "$work/$1.yaml" || { echo "schedules/thesis.yaml has changed: mend this script"; exit 1; }
  "$takt" run --for "$((before + cause + after))s" --schedule "$work/$1.yaml" --set "stereo.disparities=$many" \
    --set "stereo.search=$usual" --output "$work/out" --report "$work/$1.json" >"$work/$1.log" 2>&1 & local run=$!
  running() { kill -0 $run 2>/dev/null || { tail -n 2 "$work/$verb.log"; exit 3; }; }
  local verb=$1
  until "$takt" top --once >/dev/null 2>&1; do
    running
    sleep 0.2
  done
  : >"$work/$1.top"  # read at once below
  "$takt" top --json >>"$work/$1.top" 2>/dev/null & local top=$!
  wait_until() { # until the run is that old, s
    until awk -v t="$1" 'END { exit !(match($0, /"running_s":[0-9.]+/) && substr($0, RSTART + 12, RLENGTH - 12) + 0 >= t) }' "$work/$verb.top"
    do
      running
      sleep 0.1
    done
  }
  wait_until $before
  "$takt" set stereo.search $many
  wait_until $((before + cause))
  "$takt" set stereo.search $usual
  wait $run || true
  kill $top 2>/dev/null || true
  wait $top 2>/dev/null || true
}

budget=${BUDGET:-10ms}
for verb in continue degrade; do one_run $verb; done
python3 - "$work" "$before" "$cause" "$budget" <<'PY'
import json, sys
work, before, cause, budget = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
for verb in ("continue", "degrade"):
    report = json.load(open(f"{work}/{verb}.json"))
    stereo = next(n for n in report["nodes"] if n["name"] == "stereo")
    tops = [(t["running_s"], next(n for n in t["nodes"] if n["name"] == "stereo"))
            for t in map(json.loads, open(f"{work}/{verb}.top"))]
    def at(second): return min(tops, key=lambda t: abs(t[0] - second))[1]
    begin, end = at(before), at(before + cause)
    def share(late, skipped, of): return f"{late} late, {skipped} skipped of {of} releases ({100 * (late + skipped) / max(1, of):.1f} %)"
    slowed = share(*(end[k] - begin[k] for k in ("deadline_misses", "skipped")), round(15 * cause))
    whole = share(stereo["deadline_misses"], stereo["skipped"], stereo["released"])
    full = [n["exec_ms"] for s, n in tops if before + 1 < s < before + cause and n["level"] == 0]
    others = sum(n["deadline_misses"] for n in report["nodes"] if n["criticality"] == "high" and n is not stereo)
    print(f"{verb:<9} while slowed {slowed}, in the whole run {whole}; jobs by level {stereo['quality']}; budget {budget}, CPU time of a "
          f"job at level 0 while slowed " + (f"{min(full):.1f} to {max(full):.1f} ms" if full else "not seen") +
          f"; policy {report['policy_granted']}, host stall {report['host_stall_ms']} ms, misses of other high-criticality nodes {others}")
    changes = [(c["at_s"], c["level"]) for c in stereo["quality_changes"]["last"]]
    if changes: print("          level changes: " + ", ".join(f"{l} at {s:.2f} s" for s, l in changes))
    back = [s for s, l in changes if l == 0 and s > before + cause]
    if back: print(f"          slowed from {before:.1f} to {before + cause:.1f} s (+ up to 0.6 s until told); level 0 back {back[-1] - before - cause:.2f} s after")
PY
