# SPDX-License-Identifier: Apache-2.0
# A run keeps its newest part, freezes it when asked, and what a killed one kept is rescued.
source "$(dirname "$0")/lib.sh" "$@"
cd "$source" || exit 1

# Rules that make no sense.
graph_with() { # RECORD: the lasers' graph with that block
  sed "s|worlds/|$source/graph/worlds/|; s|\.\./schedules|$source/schedules|" graph/lasers.yaml >"$work/graph.yaml"
  echo "record: $1" >>"$work/graph.yaml"
}
refused() { # TEXT RECORD
  graph_with "$2"
  expect 2 "$1" "$takt" check "$work/graph.yaml"
}
refused '`disk` of `record` must be at least 16 MB' '{disk: 1MB}'
refused '`disk` of `record` is `2h`' '{disk: 2h}'
refused '`keep` of `record` is 1ms; it must be at least 1 s' '{keep: 1ms}'
refused 'there is no node or device `nobody`' '{ports: {nobody.x: all}}'
refused '`obstacle_stop` has no output `go`' '{ports: {obstacle_stop.go: all}}'
refused '`every` takes a whole number' '{ports: {obstacle_stop.stop: every 0}}'
refused 'valid: all, hash, none, `every N`, a time such as 1s, `jpeg`' '{ports: {obstacle_stop.stop: often}}'
refused '`none` and `hash` stand alone' '{ports: {front_laser.scan: "every 2, hash"}}'
refused '`jpeg` takes a quality from 1 to 100' '{ports: {front_laser.scan: jpeg 101}}'
refused 'is `every 2, jpeg`, but its messages (laser_scan) have no pictures' '{ports: {front_laser.scan: "every 2, jpeg"}}'
graph_with '{before: 1s, after: 1s, keep: 10min, ports: {obstacle_stop.stop: every 5, base.odometry: 1s, floor_laser.scan: none}}'
expect 0 "" "$takt" check "$work/graph.yaml"

# A graph with `record` keeps a ring; --ring off does not.
start_run none "$work/graph.yaml" --for 0s --ring off
expect 0 "" "$takt" stop --run $run
wait $run
[ ! -e "$work/none/flight" ] || fail "a run with --ring off has left $(ls -R "$work/none/flight")"

start_run marked "$work/graph.yaml" --for 0s --report "$work/marked.json"
sleep 1.5
expect 2 "a mark needs words" "$takt" mark "" --run $run
expect 0 "" "$takt" mark "it turned left" --run $run
said "frozen: " "$work/marked.err"
expect 0 "" "$takt" stop --run $run
wait $run
frozen=$(python3 - "$work/marked.json" "$work/marked/flight/frozen" <<'EOF'
import json, sys
flight = json.load(open(sys.argv[1]))["flight"]
assert flight["disk"]["lost"] == 0 and flight["disk"]["refused"] == "", flight["disk"]
# A busy machine may have missed a deadline just before: the mark stands among the others of that file then.
marks = [one for one in flight["frozen"] if "mark: it turned left" in [cause["what"] for cause in [one, *one["also"]]]]
assert len(marks) == 1 and marks[0]["refused"] == "", flight["frozen"]
print(f"{sys.argv[2]}/{marks[0]['file']}")
EOF
) || fail "the report's flight"
expect 0 "" "$takt" log info "$frozen"
prints "obstacle_stop.stop"
expect 0 "" "$takt" log echo "$frozen" obstacle_stop.stop

# Killed with all that belongs to it, in one process and in several.
for isolate in none subsystem; do
  start_run killed_$isolate "$work/graph.yaml" --for 0s --isolate $isolate
  sleep 3.5
  pkill -KILL -P $run
  kill -9 $run
  wait $run 2>/dev/null
  expect 0 "" "$takt" log rescue "$work/killed_$isolate/flight/ring" -o "$work/rescued.mcap"
  prints "messages of"
  expect 0 "" "$takt" log info "$work/rescued.mcap"
  expect 0 "" "$takt" log echo "$work/rescued.mcap" front_laser.scan
  [ "$(wc -l <"$work/stdout")" -ge 20 ] || fail "the rescued record has $(wc -l <"$work/stdout") scans of three seconds"
done
expect 2 "no run has left anything here" "$takt" log rescue "$work" -o "$work/nothing.mcap"
[ ! -e "$work/nothing.mcap" ] || fail "a failed rescue has left a file"
finish
