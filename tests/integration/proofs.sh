# SPDX-License-Identifier: Apache-2.0
# Proof = run: proofs.sh TAKT SOURCE [--full] [--shard K/N]. Of graphs x profiles x isolation x policy, `takt check --json` and
# `takt run --report` come to the same verdict and the same bounds; under a granted policy nothing unexplained is seen above them.
# The host's stalls stand in the same row. Without --full each pair of values is in some row; with it all rows, in shards.
# TAKT_PROOF_ROWS=some, as ctest has it: an eighth of them, another one for each TAKT_PROPERTY_SEED, which CI takes from the commit.
# What cannot run here (a device that is missing, a policy that is refused) is shown as NOT RUN and counted.
source "$(dirname "$0")/lib.sh" "$@"
shift 2
[ "${TAKT_PROOF_ROWS:-}" != some ] || set -- --shard $((${TAKT_PROPERTY_SEED:-0} % 8 + 1))/8
rows="python3 $source/tests/tools/proof_rows.py"
graphs=("$source"/graph/{ace,crossing,fine,lasers,people,yard}.yaml "$source/tests/faults/loads.yaml")
case " $* " in *" --full "*) graphs+=("$source"/graph/{simulator,remote_robot,kitti,carmen}.yaml) ;; esac

ran=0 skipped=0
while read -r graph profile isolation policy; do
  chosen=()
  [ "$profile" = - ] || chosen=(--profile "$profile")
  "$takt" check "$graph" "${chosen[@]}" --policy "$policy" --json >"$work/check.json" 2>"$work/check.stderr"
  check=$?
  : >"$work/report.json"
  timeout 120 "$takt" run "$graph" "${chosen[@]}" --policy "$policy" --isolate "$isolation" --for 2s --output "$work/out" \
    --report "$work/report.json" >"$work/run.stdout" 2>"$work/run.stderr"
  run=$?
  row="$(basename "$graph" .yaml) $profile, isolation $isolation, policy $policy"
  said=$($rows compare "$work/check.json" $check "$work/report.json" $run "$work/run.stderr" 2>&1)
  case $? in
    0) ran=$((ran + 1)) ;;
    77) skipped=$((skipped + 1)) ;;
    *) fail "$row" ;;
  esac
  echo "$row: $said"
done < <($rows rows "$@" "${graphs[@]}")
# planted WHAT WORDS ROW: a run of $work/planted.yaml in which something is planted ends with 1, says so first, and that row is unexplained.
planted() {
  env -u TAKT_RT_STRICT "$takt" run "$work/planted.yaml" --policy fixed --for 2s --output "$work/out" --report "$work/report.json" \
    >"$work/run.stdout" 2>"$work/run.stderr"
  case $? in
    1) sed -n '/./{p;q}' "$work/run.stdout" | grep "^NOT AS PROVEN: $2" || fail "$1 is not told first: $(head -n 3 "$work/run.stdout")" ;;
    3) skipped=$((skipped + 1)) && echo "NOT RUN: $1: $(tail -n 1 "$work/run.stderr")" && return ;;
    *) fail "$1: $(tail -n 3 "$work/run.stderr")" && return ;;
  esac
  python3 - "$work/report.json" "$2" <<'PY' || fail "the report of $1"
import json, sys
report, what = json.load(open(sys.argv[1])), sys.argv[2]
rows = [row for row in report["proofs"]["above_proof"] if row["what"] == what and row["cause"] == "unexplained"]
assert report["proofs"]["verdict"] == "unexplained" and not report["ok"] and rows, report["proofs"]
assert all(node["deadline_misses"] == 0 for node in report["nodes"]), report["nodes"]
PY
}
cores=$(taskset -pc $$ | sed 's/.*[ ,-]//')
cat >"$work/schedule.yaml" <<YAML
takt: 1
name: planted
policy: fixed
cores: [$cores]
anticipate: 0ms
nodes:
  source: {rate: 10, budget: 2ms, deadline: 40ms, criticality: high}
  reader: {rate: 10, offset: 50ms, budget: 2ms, deadline: 40ms}
YAML
graph_of() { # PARAMS of the source
  cat >"$work/planted.yaml" <<YAML
takt: 1
name: planted
schedule: schedule.yaml
subsystems:
  work:
    source: {type: load, params: $1}
    reader: {type: load, in: {input: {from: source.output, max_age: 200ms}}}
profiles: {sim: {}}
YAML
}
# A publication that is late, with no CPU time used: the job sleeps.
graph_of '{work: 1ms, sleep: 8ms}'
planted "a late publication" "response of source"
# Overheads that are smaller than what it takes to get a job going.
graph_of '{work: 0.1ms}'
export TAKT_MACHINE=$work/machine.json
cat >"$TAKT_MACHINE" <<'JSON'
{"machine": {"cpu": "any", "cores": 2, "kernel": "6.12.0 #1"}, "measured_at": "2026-11-28T08:00:00Z", "release_us": 0.1, "switch_us": 0.1,
 "publish_us": 0.1, "take_us": 0.1, "per_mb_us": 0, "enforcement_us": 4000, "demotion_us": 50, "look_us": 0.1, "tick_us": 4000, "deadline_bandwidth": 1.8,
 "worst": {"release_us": 0.1, "switch_us": 0.1, "publish_us": 0.1, "take_us": 0.1}}
JSON
planted "a wrong overhead" "age at source.output -> reader.input"
unset TAKT_MACHINE
echo "$ran rows as proven, $skipped NOT RUN, $failures failed"
[ $ran -gt 0 ] || fail "no row could be compared"
finish
