# SPDX-License-Identifier: Apache-2.0
# What an operator sets stays set: after kill -9 of each process of a run, in later runs if it is kept, and in a replay.
# Deadlines are not judged here.
source "$(dirname "$0")/lib.sh" "$@"

told() { said "$1" "$work/$name.err"; }
python() { python3 - "$@" || fail "the report is wrong"; }
overlay=$TAKT_STATE_DIR/overlays/ace.yaml

# One live parameter in each process with nodes: process, parameter, value, as `takt get` prints it.
sets=(
  "robot obstacle_stop.scan_age_max 0.01s 0.01 s"
  "detection traffic_signs.size_min 0.4 0.4"
  "people person_tracking.distance 170cm 1.7 m"
  "mapping traversability.range_max 4m 4.0 m"
  "mind semantic.strip 1.1m 1.1 m"
)
all_set() { # WORDS: every parameter has its value, and stands there with these words
  local line words
  for line in "${sets[@]}"; do
    words=($line)
    expect 0 "" "$takt" get "${words[1]}" --run $run
    prints "${words[1]} ${words[*]:3} (set at "
    prints "$1"
  done
}
# No scan is younger than 10 ms: the node says that it has none (reason 4), as long as it uses the value.
scan_lost() {
  for ((i = 0; i < 100; ++i)); do
    "$takt" echo obstacle_stop.stop --run $run >"$work/stop"
    reasons=$(sed -n 's/^ *"reasons": \([0-9]*\),*$/\1/p' "$work/stop")
    ((reasons & 4)) && return
    sleep 0.1
  done
  fail "obstacle_stop does not use the value that it was given: reasons $reasons"
}

echo "=== kill -9 of each process"
name=killed
start_run $name --isolate subsystem --for 0s --record "$work/$name.mcap" --report "$work/$name.json"
for line in "${sets[@]}"; do
  words=($line)
  expect 0 "" "$takt" set "${words[1]}" "${words[2]}" --run $run
done
expect 0 "" "$takt" set obstacle_stop:beams_min 3 --run $run
expect 2 "must lie in" "$takt" set semantic.strip 11m --run $run
expect 2 "is fixed while the graph runs (sizes memory)" "$takt" set stereo.disparities 64 --run $run
all_set ")"
scan_lost
for process in devices robot detection people mapping mind; do kill -KILL "$(member $process)"; done
for process in devices robot detection people mapping mind; do told "process $process is back"; done
all_set ", taken up after 1 restart)"
scan_lost
expect 0 "" "$takt" get --run $run
prints "obstacle_stop.beams_min 3 (set at "
expect 0 "" "$takt" get stereo.disparities --run $run
prints "(file)"
expect 2 "did you mean \`semantic.strip\`" "$takt" get semantic.stripe --run $run
expect 0 "" "$takt" top --once --run $run
prints "semantic.strip 1.1 m (set at "
end_run 1
grep -q "^parameters: .*semantic.strip 1.1 m (set at .* taken up after 1 restart)" "$work/$name.out" || fail "the summary does not name the parameters"
[ ! -e "$overlay" ] || fail "what was not to be kept is"
python "$work/$name.json" <<'PY'
import json, os, sys
parameters = {p["node"] + "." + p["param"]: p for p in json.load(open(sys.argv[1]))["parameters"]}
assert sorted(parameters) == ["obstacle_stop.beams_min", "obstacle_stop.scan_age_max", "person_tracking.distance", "semantic.strip",
                              "traffic_signs.size_min", "traversability.range_max"], parameters
assert all(p["from"] == "set" and p["at_s"] > 0 and p["taken_up"] == 1 and p["by_user"] == os.getuid() for p in parameters.values()), parameters
assert parameters["person_tracking.distance"]["value"] == 1.7 and parameters["person_tracking.distance"]["unit"] == "m", parameters
PY

echo "=== replayed: restarted nodes go on with the values they took up"
expect 0 "" "$takt" replay "$work/$name.mcap" --compare --output "$work/out"
prints " 0 differ"
prints " restarts of nodes done again"
expect 0 "" "$takt" replay "$work/$name.mcap" --compare --isolate subsystem --output "$work/out"
prints " 0 differ"
expect 0 "" "$takt" log export "$work/$name.mcap" -o "$work/export.mcap"
expect 0 "" "$takt" log info "$work/$name.mcap"
prints " restart"

echo "=== kept, and replayed"
name=kept
start_run $name --isolate subsystem --for 0s --record "$work/$name.mcap"
expect 0 "kept in $overlay" "$takt" set --keep traversability.range_max 4m --run $run
expect 0 "kept in $overlay" "$takt" set --keep semantic:strip 1.1m --run $run
expect 2 "must lie in" "$takt" set --keep semantic.strip 11m --run $run
sleep 1
end_run 0 1
grep -qx "  traversability.range_max: 4m" "$overlay" && grep -qx "  semantic.strip: 1.1m" "$overlay" || { cat "$overlay"; fail "the overlay is wrong"; }
expect 0 "$overlay is not used: the record says" "$takt" replay "$work/$name.mcap" --compare --output "$work/out"
prints " 0 differ"
expect 0 "" "$takt" replay "$work/$name.mcap" --compare --isolate subsystem --output "$work/out"
prints " 0 differ"

echo "=== the next runs"
virtual=(--clock virtual --isolate none --for 1s --output "$work/out" --report "$work/next.json")
expect 0 "takt: kept values of $overlay: semantic.strip 1.1m, traversability.range_max 4m" \
  "$takt" run "${virtual[@]}" --record "$work/next.mcap"
prints "parameters: "
python "$work/next.json" "$overlay" <<'PY'
import json, sys
report = json.load(open(sys.argv[1]))
assert report["overlay"] == sys.argv[2], report["overlay"]
assert {p["node"]: (p["value"], p["from"]) for p in report["parameters"]} == {"semantic": (1.1, "kept"), "traversability": (4, "kept")}
PY
expect 0 "semantic.strip 1.1m (--set wins)" "$takt" run "${virtual[@]}" --set semantic.strip=0.9m
grep -q '"from": "command line"' "$work/next.json" || fail "--set is not named in the report"
expect 0 "$overlay is not used" "$takt" run "${virtual[@]}" --no-overlay
grep -q '"parameters": \[\],' "$work/next.json" || fail "--no-overlay used the values"
"$takt" check >"$work/stdout" 2>"$work/stderr"  # admitted or not, by the machine
grep -q "kept values of $overlay" "$work/stderr" || fail "check does not name the values"

echo "=== forgotten, and what does not fit"
expect 0 "is no longer in" "$takt" set --forget traversability.range_max
expect 2 "holds no value" "$takt" set --forget traversability.range_max
expect 0 "nothing runs; kept in" "$takt" set --keep person_tracking:distance 1.5m
expect 2 "must lie in" "$takt" set --keep person_tracking.distance 50m
expect 2 "no node of that type" "$takt" set --keep person_trackin:distance 1m
expect 3 "no graph of this user is running" "$takt" set semantic.strip 1m
expect 0 "is not used" "$takt" replay "$work/next.mcap" --compare --output "$work/out"
prints " 0 differ"
sed -i 's/semantic.strip: 1.1m/semantic.strips: 1.1m/' "$overlay"
line=$(grep -n strips "$overlay" | cut -d: -f1)
for command in run check; do
  expect 2 "$overlay:$line:3: error: node \`semantic\`" "$takt" $command
  expect 2 "takt set --forget semantic.strips" "$takt" $command
done
expect 0 "" "$takt" set --forget semantic.strips
expect 0 "person_tracking.distance 1.5m" "$takt" run "${virtual[@]}"
finish
