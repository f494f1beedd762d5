# SPDX-License-Identifier: Apache-2.0
# Graphs that say what they expect: the run ends by itself, with 0 if it came true and 1 if not; under either clock, in one
# process or several.
source "$(dirname "$0")/lib.sh" "$@"
scenarios=$source/tests/scenarios
edited() { # FILE SED: the scenario with one change
  mkdir -p "$work/scenarios"
  cp -r "$scenarios"/schedules "$scenarios"/worlds "$work/scenarios"
  sed -e "s|\.\./\.\./graph|$source/graph|" -e "$2" "$scenarios/$1.yaml" >"$work/scenarios/$1.yaml"
  cmp -s "$scenarios/$1.yaml" "$work/scenarios/$1.yaml" && fail "the edit $2 changed nothing"
}
run() { # EXIT 'TEXT ON STDERR' FILE OPTIONS...
  local code=$1 text=$2 file=$3
  shift 3
  expect "$code" "$text" "$takt" run "$file" --output "$work/out" --report "$work/report.json" "$@"
  sed -n '/expected/,$p' "$work/stdout"
}
judge() { # 'EXPRESSION OF r'
  python3 -c 'import json, sys; r = json.load(open(sys.argv[1])); sys.exit(not eval(sys.argv[2]))' "$work/report.json" "$1" ||
    fail "the report is not as it should be: $1"
}

run 0 "" "$scenarios/obstacle.yaml" --clock virtual
judge 'r["expectations"]["met"] and r["duration_s"] < 15 and r["expectations"]["within_s"] == 20'
judge 'r["expectations"]["conditions"][0]["met"] and r["expectations"]["conditions"][0]["since_s"] > 0.5'
run 0 "" "$scenarios/obstacle.yaml" --clock virtual --seed 7
run 0 "" "$scenarios/obstacle.yaml" --policy cooperative

# Unmet: at the latest then, at once where nothing can mend it, and where the run is too short.
edited obstacle 's/field: reasons, is: 1/field: reasons, is: 2/'
run 1 "" "$work/scenarios/obstacle.yaml" --clock virtual
grep -q '^NOT AS EXPECTED' "$work/stdout" || fail "the summary does not say so"
judge 'r["duration_s"] == 20 and [c["what"] for c in r["expectations"]["conditions"] if not c["met"]] == ["obstacle_stop.stop reasons"]'
edited obstacle 's/within: 0.6m/within: 6m/'
run 1 "" "$work/scenarios/obstacle.yaml" --clock virtual
judge 'r["duration_s"] < 10'
run 1 "" "$scenarios/obstacle.yaml" --clock virtual --for 3s

# What cannot be looked at is refused before anything starts.
edited obstacle 's/of: bernd/of: bert/'
run 2 'obstacle.yaml:30:7: error: the simulated world has no object `bert`; did you mean `bernd`?' "$work/scenarios/obstacle.yaml"
run 2 'with devices whose driver is sim, and --isolate none' "$scenarios/obstacle.yaml" --isolate subsystem
edited obstacle 's/field: speed_m_s/field: sped_m_s/'
run 2 'did you mean `speed_m_s`?' "$work/scenarios/obstacle.yaml"

# Several processes: what ports say can be followed, the world cannot.
edited obstacle '/world: ace/d'
run 0 "" "$work/scenarios/obstacle.yaml" --isolate subsystem --policy cooperative
finish
