# SPDX-License-Identifier: Apache-2.0
# takt up: the machines of a graph started, followed and ended from one place. A stand-in of ssh enters network namespaces.
# As root; without the right to make them it says so.
source "$(dirname "$0")/lib.sh" "$@"
graph=graph/two_machines.yaml
cd "$source" || exit 1

expect 2 "has no \`machines\`: \`takt run\` runs it" "$takt" up graph/lasers.yaml --output "$work/none"
expect 2 "--host vision: write MACHINE=HOST" "$takt" up $graph --host vision --output "$work/none"
expect 2 "has no machine \`arm\`; machines: robot, vision" "$takt" up $graph --host arm=one --output "$work/none"
expect 2 "machine \`robot\` has one already" "$takt" up $graph --host robot=one --host robot=two --output "$work/none"
expect 2 "--for" "$takt" up $graph --for fast --output "$work/none"
[ ! -e "$work/none" ] || fail "a folder was made for nothing"

[ -e "$(dirname "$takt")/../../rt/libtakt_dds.so" ] || not_run "built without cyclonedds-dev and cyclonedds-tools"
two_machines 10.93.0
cat >"$work/ssh" <<'END'
#!/bin/sh
# As ssh: what is between here and there may be cut.
host=$1
shift
[ "$host" != gone ] || exit 255
cat | ip netns exec "$host" "$@" | cat
END
chmod +x "$work/ssh"
up=(--ssh "$work/ssh" --program "$takt" --folder "$source")
hosts=(--host "robot=$one" --host "vision=$two")
quietly="--policy cooperative --ring off"

echo "=== both parts, their reports and records"
"$takt" up $graph "${up[@]}" "${hosts[@]}" --options "$quietly" --output "$work/both" --for 4s --record >"$work/both.out" 2>"$work/both.err"
code=$?
[ $code -le 1 ] || fail "exit $code: $(tail -n 5 "$work/both.out" "$work/both.err")"
for machine in robot vision; do
  grep -q "^\[$machine\] " "$work/both.out" || fail "$machine said nothing"
  grep -q "^$machine on .*: exit [01], [34]\.[0-9] s" "$work/both.out" || fail "what became of $machine: $(tail -n 2 "$work/both.out")"
  tells 0 " 0 differ" "$takt" replay "$work/both/$machine.mcap" --compare --output "$work/again"
done
python3 - "$work/both/report.json" $code <<'PY' || fail "the report of both"
import json, sys
report = json.load(open(sys.argv[1]))
assert list(report["machines"]) == ["robot", "vision"], report.keys()
codes = [part["exit"] for part in report["machines"].values()]
assert max(codes) == int(sys.argv[2]), codes
other, = report["machines"]["vision"]["report"]["machines"]
assert other["name"] == "robot" and other["outputs"][0]["received"] > 20, other
PY

echo "=== one that is not reached ends the others"
expect 3 "" timeout 60 "$takt" up $graph "${up[@]}" --host "robot=$one" --host vision=gone --options "$quietly" --output "$work/alone"
prints "vision on gone: the connection to gone has ended"
prints "robot on $one: exit"

echo "=== one that refuses ends the others, and says why"
expect 2 "" timeout 60 "$takt" up $graph "${up[@]}" "${hosts[@]}" --options "$quietly --set traversability.nothing=1" --output "$work/refused"
grep -q "^\[vision\] .*nothing" "$work/stdout" || fail "it does not say why: $(cat "$work/stdout")"

begin() { # begin NAME: a run in the background, its process in $up_pid, until both parts run
  beside "$1" "$takt" up $graph "${up[@]}" "${hosts[@]}" --options "$quietly" --output "$work/$1"
  up_pid=$!
  for _ in $(seq 200); do
    [ "$(find "$XDG_RUNTIME_DIR/takt" -name '*.sock' 2>/dev/null | wc -l)" = 2 ] && return
    sleep 0.1
  done
  fail "the parts do not run: $(cat "$work/$1.out" "$work/$1.err")"
}
echo "=== Ctrl-C ends all"
begin asked
sleep 1
kill -INT $up_pid
wait $up_pid
code=$?
[ $code -le 1 ] || fail "exit $code: $(tail -n 4 "$work/asked.out")"
[ -s "$work/asked/robot.json" ] && [ -s "$work/asked/vision.json" ] || fail "a report is missing"

echo "=== with its connection a part ends; the others go on"
begin cut
vision=$(pgrep -f "run '?$graph'? --machine vision" -n)
ssh=$(pgrep -P $up_pid -f "ssh $two")
pkill -KILL -P "$ssh" -x cat
kill -KILL "$ssh"
for _ in $(seq 100); do kill -0 "$vision" 2>/dev/null || break; sleep 0.1; done
kill -0 "$vision" 2>/dev/null && fail "the part whose connection is gone runs on"
sleep 1
grep -q "^\[robot\] ok" "$work/cut.out" && fail "the other part has ended, too"
kill -TERM $up_pid
wait $up_pid
code=$?
[ $code -eq 3 ] || fail "exit $code instead of 3: $(tail -n 3 "$work/cut.out")"
grep -q "^vision on $two: the connection to $two has ended" "$work/cut.out" || fail "$(tail -n 3 "$work/cut.out")"

finish
