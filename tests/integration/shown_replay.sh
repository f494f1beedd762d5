# SPDX-License-Identifier: Apache-2.0
# A replay at the pace of its record is looked at as a run is, its messages are those of the record, and it is never taken for
# the run that somebody wants to stop or to change.
source "$(dirname "$0")/lib.sh" "$@"

graph=$source/graph/lasers.yaml
expect 0 "" "$takt" run "$graph" --clock virtual --for 20s --record "$work/run.mcap" --output "$work/out"

# begin OPTIONS... : a replay in the background, its process in $replay; returns once it can be looked at.
begin() {
  beside replay "$takt" replay "$work/run.mcap" --output "$work/replayed" "$@"
  replay=$!
  attachable $replay replay
}

echo "=== its messages, jobs and time"
begin --recorded-pace --from 5 --compare
expect 0 "" "$takt" echo front_laser.scan --count 20 --run $replay
cp "$work/stdout" "$work/scans"
expect 0 "" "$takt" echo obstacle_stop.stop --count 5 --run $replay
expect 0 "" "$takt" top --once --json --run $replay
cp "$work/stdout" "$work/top.json"
for change in "set obstacle_stop.margin 0.4m" "mode safe_stop" "mark words" "fault front_laser silent on"; do
  expect 2 "this is a replay of run.mcap" "$takt" $change --run $replay
done
"$takt" log echo "$work/run.mcap" front_laser.scan >"$work/recorded" || fail "takt log echo"
python3 - "$work" <<'PY' || fail "what is seen of the replay"
import json, sys
work = sys.argv[1]
recorded = [json.loads(line)["message"] for line in open(f"{work}/recorded")]
seen = [json.loads(scan) for scan in open(f"{work}/scans").read().replace("\n}\n{", "\n}\0{").split("\0")]
assert len(seen) == 20, len(seen)
at = [recorded.index(scan["message"]) for scan in seen]  # with all its fields
assert at == sorted(set(at)), at
assert at[0] >= 5 * 15 - 15, at  # it began after 5 s
ages = [scan["age_ms"] for scan in seen]
assert 0 < min(ages) and max(ages) < 1000, ages
print(f"scans {at[0]} to {at[-1]} of {len(recorded)}")
top = json.load(open(f"{work}/top.json"))
assert 5 < top["running_s"] < 20, top["running_s"]
assert all(node["completed"] > 0 for node in top["nodes"] if node["rate_hz"]), top["nodes"]
PY

echo "=== beside a run it is not the one that is meant"
start_run live "$graph" --for 0s
expect 0 "" "$takt" top --once --json
grep -q '"running_s": *[0-4]\.' "$work/stdout" || fail "takt top showed the replay instead of the run: $(head -c 300 "$work/stdout")"
expect 0 "" "$takt" stop
wait $run
kill -0 $replay || fail "takt stop ended the replay instead of the run"
expect 0 "" "$takt" stop --run $replay
wait $replay
[ $? = 0 ] || fail "the replay: $(cat "$work/replay.err")"
grep -q " 0 differ" "$work/replay.out" || fail "a replay that is looked at is another one: $(cat "$work/replay.out")"

echo "=== a record of all that is not run"
begin --recorded-pace --live obstacle_stop
expect 0 "" "$takt" echo base.odometry --count 3 --run $replay
expect 0 "" "$takt" stop --run $replay
wait $replay
expect 2 "excludes" "$takt" replay "$work/run.mcap" --web --isolate subsystem

if [ -x "${takt%/*}/takt-web" ]; then
  echo "=== with a page of its own"
  begin --web
  said "#token=" "$work/replay.err"
  port=$(sed -n 's|^http://127.0.0.1:\([0-9]*\)/#token=.*|\1|p' "$work/replay.err")
  python3 - "$port" <<'PY' || fail "the page of the replay"
import http.client, sys
connection = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]), timeout=10)
connection.request("GET", "/")
assert connection.getresponse().status == 200
for path in ("/frozen/x.mcap", "/frozen/", "/frozen/../x", "/frozen/x.mcap?ticket=", "/frozen/x.mcap?ticket=abc"):
    other = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]), timeout=10)
    other.request("GET", path)
    assert other.getresponse().status in (403, 404), path
PY
  expect 0 "" "$takt" stop --run $replay
  wait $replay
  for ((i = 0; i < 50; ++i)); do pgrep -f "takt-web --with-run $replay" >/dev/null || break; sleep 0.1; done
  pgrep -f "takt-web --with-run $replay" && fail "its server outlives it"
else
  echo "NOT RUN: takt-web is not built"
fi
finish
