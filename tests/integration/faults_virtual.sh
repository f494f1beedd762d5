# SPDX-License-Identifier: Apache-2.0
# The matrix of fault scenarios in virtual time (tests/faults) but for those of the main graph: nothing here depends on the
# machine.
source "$(dirname "$0")/lib.sh" "$@"
source "$(dirname "$0")/fault_matrix.sh"

# shellcheck disable=SC2046  # names without blanks
run_matrix 27 $(grep -l '^# run: .*--clock virtual' tests/faults/*.yaml | grep -v /ace_)

python3 - "$work/wrong_expectation.json" <<'PY' || fail "the report of wrong_expectation does not say what was unmet"
import json, sys
scenario = json.load(open(sys.argv[1]))["scenario"]
unmet = [row["what"] for row in scenario["expectations"] if not row["met"]]
assert scenario["met"] is False and unmet == ["stale of filter"], scenario
assert scenario["faults"][0]["struck"] == 20, scenario
PY

# What an empty pool kept from being sent stands on each edge of that output, and on no other.
python3 - "$work/exhausted_pool.json" <<'PY' || fail "the edges of exhausted_pool do not say what was never made"
import json, sys
report = json.load(open(sys.argv[1]))
struck = report["scenario"]["faults"][0]["struck"]
refused = {(e["from"], e["to"]): e["exhausted"] for e in report["edges"]}
mine = [n for (start, _), n in refused.items() if start == "source.output"]
assert struck > 0 and mine and all(n == struck for n in mine) and sum(refused.values()) == sum(mine), (struck, refused)
PY
grep -q '^edge source.output -> filter.* messages never made, no chunk was free' "$work/exhausted_pool.out" ||
  fail "the summary of exhausted_pool says nothing of its edge"

# Chance is the seed's alone: the same messages are struck again, to the last byte.
for i in 1 2; do
  "$takt" run tests/faults/loads.yaml --clock virtual --for 10s --faults tests/faults/all_at_once.yaml \
    --output "$work/out" --record "$work/again$i.mcap" --record-port all >"$work/again$i.out" 2>&1 ||
    fail "all_at_once with a record: exit $?"
done
expect 0 '' "$takt" log diff "$work/again1.mcap" "$work/again2.mcap"
sed 's/^seed: .*/seed: 100/' tests/faults/all_at_once.yaml >"$work/other_seed.yaml"
"$takt" run tests/faults/loads.yaml --clock virtual --for 10s --faults "$work/other_seed.yaml" --output "$work/out" \
  --record "$work/other.mcap" --record-port all >/dev/null 2>&1
expect 1 '' "$takt" log diff "$work/again1.mcap" "$work/other.mcap"

# What cannot be run is refused before anything starts, with the place and the way out.
run() { "$takt" run --output "$work/out" "$@"; }
expect 2 'none.yaml cannot be read: No such file' run tests/faults/loads.yaml --clock virtual --faults "$work/none.yaml"
expect 2 'real_cpu_hog.yaml:6:12: error: `cpu_hog` exists in real time only' \
  run tests/faults/loads.yaml --clock virtual --faults tests/faults/real_cpu_hog.yaml
expect 2 '`kill` needs a process to strike' \
  run tests/faults/loads.yaml --isolate none --faults tests/faults/kill_front.yaml
expect 2 'run with --record FILE' run tests/faults/loads.yaml --clock virtual --faults tests/faults/full_disk.yaml
printf 'takt: 1\nname: blind\nfaults: [{kind: silent, target: head_camera}]\n' >"$work/blind.yaml"
expect 2 'has the driver replay, which cannot be told to fail' \
  run graph/ace.yaml --profile replay --clock virtual --faults "$work/blind.yaml"
printf 'takt: 1\nname: typo\nfaults: [{kind: drop, target: front_lazer.scan}]\n' >"$work/typo.yaml"
expect 2 'did you mean `front_laser.scan`?' run graph/ace.yaml --clock virtual --faults "$work/typo.yaml"
finish
