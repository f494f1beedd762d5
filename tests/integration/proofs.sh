# SPDX-License-Identifier: Apache-2.0
# Proof = run: proofs.sh TAKT SOURCE [--full] [--shard K/N]. Of graphs x profiles x isolation x policy, `takt check --json` and
# `takt run --report` come to the same verdict and the same bounds; under a granted policy nothing unexplained is seen above them.
# The host's stalls stand in the same row. Without --full each pair of values is in some row; with it all rows, in shards.
# What cannot run here (a device that is missing, a policy that is refused) is shown as NOT RUN and counted.
source "$(dirname "$0")/lib.sh" "$@"
shift 2
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
# A publication that is late, with no CPU time used: the job sleeps. Unexplained, told first, exit 1.
cat >"$work/planted.yaml" <<'YAML'
takt: 1
name: planted
schedule: schedule.yaml
subsystems:
  work: {sleeper: {type: load, params: {work: 1ms, sleep: 8ms}}}
profiles: {sim: {}}
YAML
cat >"$work/schedule.yaml" <<YAML
takt: 1
name: planted
policy: fixed
cores: [$(taskset -pc $$ | sed 's/.*[ ,-]//')]
nodes: {sleeper: {rate: 10, budget: 2ms, deadline: 50ms, criticality: high}}
YAML
env -u TAKT_RT_STRICT "$takt" run "$work/planted.yaml" --policy fixed --for 2s --output "$work/out" --report "$work/report.json" \
  >"$work/run.stdout" 2>"$work/run.stderr"
case $? in
  1)
    sed -n '/./{p;q}' "$work/run.stdout" | grep "^NOT AS PROVEN: response of sleeper" || fail "a planted late publication is not told first"
    python3 - "$work/report.json" <<'PY' || fail "the report of a planted late publication"
import json, sys
report = json.load(open(sys.argv[1]))
row = report["proofs"]["above_proof"][0]
assert report["proofs"]["verdict"] == "unexplained" and not report["ok"], report["proofs"]
assert row["what"] == "response of sleeper" and row["cause"] == "unexplained" and row["samples_above"] >= 15, row
assert report["nodes"][0]["deadline_misses"] == 0, report["nodes"]
PY
    ;;
  3) skipped=$((skipped + 1)) && echo "NOT RUN: a planted late publication: $(tail -n 1 "$work/run.stderr")" ;;
  *) fail "a planted late publication: $(tail -n 3 "$work/run.stderr")" ;;
esac
echo "$ran rows as proven, $skipped NOT RUN, $failures failed"
[ $ran -gt 0 ] || fail "no row could be compared"
finish
