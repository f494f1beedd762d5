#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The SICK drivers in a running graph, with doubles at the other ends of their lines: a pseudo terminal and a connection.
# Everything is on the real clock, so counts are judged, and what happened, but no times.
. "$(dirname "$0")/lib.sh"

# A double that obeys words, each with its line: double NAME ARGUMENTS...; order NAME WORD
double() {
  local name=$1
  shift
  mkfifo "$work/$name.orders"
  "$takt" double "$@" <"$work/$name.orders" >"$work/$name.where" 2>"$work/$name.err" &
  doubles="$doubles $!"
  exec {pipe}>"$work/$name.orders"
  pipes[$name]=$pipe
  for _ in $(seq 200); do [ -s "$work/$name.where" ] && return; sleep 0.05; done
  cat "$work/$name.err"
  fail "the double $name did not start"
}
declare -A pipes
doubles=
order() { echo "$2" >&"${pipes[$1]}"; }
trap 'kill $doubles 2>/dev/null; rm -rf "$work"' EXIT

port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
sed -e "s|/tmp/front_laser|$work/front|; s|127.0.0.1:2111|127.0.0.1:$port|; s|: worlds/|: $source/graph/worlds/|; s|\.\./schedules|$source/schedules|" \
  "$source/graph/lasers.yaml" >"$work/lasers.yaml"

expect 3 "ls /dev/serial/by-id" "$takt" run "$work/lasers.yaml" --profile robot --for 1s --output "$work/out"
expect 2 "known: head, base, lms200, lms400" "$takt" double lms500 --pty "$work/front"
expect 2 "--pty PATH or --tcp PORT" "$takt" double lms200
expect 2 "--video PATH" "$takt" double camera --can vcan0
expect 3 "modprobe v4l2loopback" "$takt" double camera --video "$work/none"

expect 2 "none cannot be read: No such file" "$takt" eval lms200 --rx "$work/none" --index "$work/none"

double front lms200 --pty "$work/front"
double floor lms400 --tcp "$port"

# What they say, asked for scans meanwhile: taken from the file as it was from the line.
expect 0 "" "$takt" capture "$work/front" "$work/front.rx.bin" --scanner lms200 --baud 500000 --for 5s
cat "$work/stdout"
echo 'time,direction,offset,length,command,crc' >"$work/none.csv"  # of a capture
expect 0 "" "$takt" eval lms200 --rx "$work/front.rx.bin" --index "$work/none.csv" --json
python3 -c 'import json, sys; r = json.load(open(sys.argv[1])); print(r); sys.exit(r["scans"] < 10)' "$work/stdout" || fail "the captured bytes hold no scans"
expect 0 "" "$takt" capture "127.0.0.1:$port" "$work/floor.rx.bin" --scanner lms400 --for 5s
cat "$work/stdout"
grep -q " [1-9][0-9]* scans" "$work/stdout" || fail "no scans of the lms400 were captured"

"$takt" run "$work/lasers.yaml" --profile robot --policy cooperative --for 24s --output "$work/out" --report "$work/report.json" \
  >"$work/run.out" 2>"$work/run.err" &
run=$!
sleep 7
order front unplugged
order floor silent
sleep 3
order front none
order floor none
wait $run
code=$?
grep -E '^(mode|device)|_laser|obstacle_stop|traversability' "$work/run.out"
[ $code -le 1 ] || { tail -n 5 "$work/run.err"; fail "exit $code"; }
python3 - "$work/report.json" <<'PY' || fail "the report is not as it should be"
import json, sys
report = json.load(open(sys.argv[1]))
devices = {d["name"]: d for d in report["devices"]}
nodes = {n["name"]: n for n in report["nodes"]}
sent = {e["from"]: e["sent"] for e in report["edges"]}
print({n: (d["losses"], d["state"]) for n, d in devices.items()}, sent)
# Some 3 s to begin with, 3 s and what it takes to come back are without scans.
assert 100 < sent["front_laser.scan"] < 330 and 100 < sent["floor_laser.scan"] < 350
for name in ("front_laser", "floor_laser"):
    assert devices[name]["losses"] >= 1 and devices[name]["state"] == "ok"
assert [m["name"] for m in report["modes"]][-2:] == ["safe_stop", "full"]
assert all(nodes[n]["allocations"] == 0 for n in ("front_laser", "floor_laser"))
PY
finish
