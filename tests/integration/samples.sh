#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Files of every version that Takt ever wrote or took (tests/samples) are read; one of a later version gets one clear error.
source "$(dirname "$0")/lib.sh" "$@"
old=$source/tests/samples
mkdir "$work/old"
cp -L "$old"/*.yaml "$old"/lab.* "$work/old/"
output=(--output "$work/out")


# later FILE TEXT COMMAND...: exit 2, and of the errors there is one
later() {
  local file=$1 text=$2
  shift 2
  expect 2 "$text" "$@"
  grep -qF -- "$file" "$work/stderr" || fail "the error does not name $file"
  [ "$(grep -c "later Takt" "$work/stderr")" = 1 ] && [ "$(grep -c error "$work/stderr")" = 1 ] ||
    fail "not one error: $(cat "$work/stderr")"
}

echo "=== language 1: graph, schedule, parameter file, scenario, kept values"
mkdir -p "$TAKT_STATE_DIR/overlays"
cp "$old/kept.yaml" "$TAKT_STATE_DIR/overlays/guard.yaml"
expect 0 "obstacle_stop.scan_age_max 220ms" "$takt" check "$work/old/graph.yaml"
tells 0 "scenario met" "$takt" run "$work/old/graph.yaml" --params "$work/old/params.yaml" --faults "$work/old/faults.yaml" \
  --clock virtual --isolate none --for 400ms "${output[@]}" --report "$work/report.json" --trace "$work/trace.json"
for file in graph schedule params faults; do
  sed 's/^takt: 1/takt: 2/; $a future: {}' "$old/$file.yaml" >"$work/old/$file.yaml"
  later "$work/old/$file.yaml:" ": error: the file is of version 2 of the language, and this is Takt " \
    "$takt" run "$work/old/graph.yaml" --params "$work/old/params.yaml" --faults "$work/old/faults.yaml" --clock virtual \
    --for 400ms "${output[@]}"
  cp "$old/$file.yaml" "$work/old/"
done
sed -i 's/^takt: 1/takt: 2/' "$TAKT_STATE_DIR/overlays/guard.yaml"
later "$TAKT_STATE_DIR/overlays/guard.yaml:" ": error: the file is of version 2" "$takt" check "$work/old/graph.yaml"
rm "$TAKT_STATE_DIR/overlays/guard.yaml"

echo "=== records of every format"
while read -r name format content jobs; do
  damage=()
  [ "$name" != format_1_killed ] || damage=(--allow-damage)
  tells 0 "content $content" "$takt" log info "${damage[@]}" "$old/$name.mcap"
  [ "$format" != 1 ] || tells 0 "format 1" "$takt" log info "${damage[@]}" "$old/$name.mcap"
  tells 0 "the same" "$takt" log diff "${damage[@]}" "$old/$name.mcap" "$old/$name.mcap"
  tells 0 "messages" "$takt" log export "${damage[@]}" "$old/$name.mcap" -o "$work/old/export.mcap"
  tells 0 "jobs" "$takt" log cut "${damage[@]}" "$old/$name.mcap" --from 0.1 --to 0.3 -o "$work/old/cut.mcap"
  tells 0 "cut: 0.100 s to 0.300 s" "$takt" log info "$work/old/cut.mcap"
  params=()
  [ "$format" = 1 ] || params=(--params "$work/old/params.yaml")
  "$takt" replay "$old/$name.mcap" "$work/old/graph.yaml" "${params[@]}" --compare "${output[@]}" >"$work/replay.txt" 2>&1
  code=$?
  if [ $code -eq 2 ] && grep -q "SIMD target" "$work/replay.txt"; then
    echo "NOT RUN: $(cat "$work/replay.txt")"
    continue
  fi
  grep -q "replayed $jobs jobs" "$work/replay.txt" || fail "replay of $name.mcap: $(cat "$work/replay.txt")"
  if [ "$name" = format_1_restarted ]; then
    [ $code -eq 1 ] && grep -q "format 1 does not tell where a process was started again" "$work/replay.txt" ||
      fail "replay of a restart in format 1, exit $code: $(cat "$work/replay.txt")"
  else
    grep -q " 0 differ" "$work/replay.txt" || fail "replay of $name.mcap: $(cat "$work/replay.txt")"
  fi
done <<END
format_1 1 c7f31d1b9153a670 15
format_1_restarted 1 1e3d17a692097cec 43
format_1_killed 1 fdd23bb8214c07c1 31
format_2 2 9b1e1541a7fc930e 6
END
tells 0 "jpeg 60" "$takt" log info "$old/format_3.mcap"
tells 0 "content 7e00235c22f0afc3" "$takt" log info "$old/format_3.mcap"
tells 0 '"width":70' "$takt" log echo "$old/format_3.mcap" eyes.pair
tells 0 "the same" "$takt" log diff "$old/format_3.mcap" "$old/format_3.mcap"
tells 0 "messages" "$takt" log export "$old/format_3.mcap" -o "$work/old/export.mcap"
cp "$old"/camera*.yaml "$work/old/"
tells 1 "nothing was compared" "$takt" replay "$old/format_3.mcap" "$work/old/camera.yaml" --compare "${output[@]}"
tells 1 "eyes.pair was recorded as jpeg 60" "$takt" replay "$old/format_3.mcap" "$work/old/camera.yaml" --compare "${output[@]}"
sed 's/format\x01\x00\x00\x001/format\x01\x00\x00\x009/' "$old/format_1.mcap" >"$work/old/later.mcap"
later "$work/old/later.mcap" "is a record of format 9, and this is Takt " "$takt" log info "$work/old/later.mcap"

echo "=== reports and traces"
for report in "$old/report.json" "$work/report.json"; do
  tells 0 "obstacle_stop missed 1 of 6 jobs" "$takt" explain "$report"
  expect 0 "" "$takt" report "$report" "$work/old/graph.yaml" --html "$work/report.html"
  grep -q obstacle_stop "$work/report.html" || fail "the page of $report lacks its node"
done
for trace in "$old/trace.json" "$work/trace.json"; do
  tells 0 "obstacle_stop missed job 3 by 11.0 ms" "$takt" explain "$trace"
done
grep -q '"format": 1,' "$work/report.json" && grep -q '"format":1,' "$work/trace.json" || fail "a file does not say its format"
sed -i 's/"format": 1,/"format": 2,/' "$work/report.json"
sed -i 's/"format":1,/"format":2,/' "$work/trace.json"
later "$work/report.json" " is of format 2, and this is Takt " "$takt" explain "$work/report.json"
later "$work/report.json" " is of format 2, and this is Takt " "$takt" report "$work/report.json" "$work/old/graph.yaml" --html "$work/x"
later "$work/trace.json" " is of format 2, and this is Takt " "$takt" explain "$work/trace.json"
finish
