# SPDX-License-Identifier: Apache-2.0
# own_message.sh TAKT SOURCE KITCHEN: a record with a message type that only the program KITCHEN of examples/own_message was
# built with. The stock takt shows all of it, and so do the Python reader and the reference reader of the format.
source "$(dirname "$0")/lib.sh" "$@"
kitchen=$3


record() { # record NAME LIMIT
  tells 0 "nothing lost" "$kitchen" run "$source/examples/own_message/kitchen.yaml" --clock virtual --for 3s \
    --set "alarm.limit=$2" --record "$work/$1.mcap" --output "$work/out"
}

echo "=== takt log info|echo|export|diff|cut"
record run 30degC
record lower 29degC
tells 2 "type" "$takt" replay "$work/run.mcap" --output "$work/out"  # this takt does not have the nodes
"$takt" log info "$work/run.mcap" --json >"$work/info.json" || fail "log info"
"$takt" log echo "$work/run.mcap" --items 1000000000 >"$work/lines" || fail "log echo"
tells 0 '"message":{"celsius":30.5,"number":21}' "$takt" log echo "$work/run.mcap" alarm.hot
tells 2 'did you mean `alarm.hot`' "$takt" log echo "$work/run.mcap" alarm.hat
tells 0 "temperature" "$takt" log export "$work/run.mcap" -o "$work/export.mcap"
grep -q "cannot be read\|hash only" "$work/stderr" && fail "the export leaves messages out"
tells 0 "the same" "$takt" log diff "$work/run.mcap" "$work/run.mcap"
tells 1 "alarm.hot: 9 of 9 common messages differ, 0 only in the first, 2 only in the second; first 1: stamp" \
  "$takt" log diff "$work/run.mcap" "$work/lower.mcap"
tells 0 "jobs" "$takt" log cut "$work/run.mcap" --from 1 --to 2 -o "$work/cut.mcap"
"$takt" log echo "$work/cut.mcap" oven.inside >"$work/cut"
"$takt" log echo "$work/cut.mcap" oven.inside | grep -vxFf "$work/lines" && fail "the cut holds messages that the record does not"
[ "$(wc -l <"$work/cut")" -ge 10 ] && [ "$(wc -l <"$work/cut")" -lt 30 ] || fail "the cut has $(wc -l <"$work/cut") temperatures"
python3 - "$work" <<'PY' || fail "something of the record is not shown"
import json, sys
work = sys.argv[1]
ports = {port["port"]: port for port in json.load(open(f"{work}/info.json"))["ports"] if port["type"] != "takt.node_state"}
lines = [line for line in map(json.loads, open(f"{work}/lines")) if line["type"] != "node_state"]
assert {name: port["type"] for name, port in ports.items()} == {"oven.inside": "takt.temperature", "alarm.hot": "takt.temperature"}, ports
assert {name: port["messages"] for name, port in ports.items()} == {"oven.inside": 30, "alarm.hot": 9}, ports
inside = [line["message"] for line in lines if line["port"] == "oven.inside"]
assert inside == [{"celsius": 20 + 0.5 * i, "number": i} for i in range(30)], inside
assert len(lines) == 39
PY

echo "=== the readers"
PYTHONPATH=$source/packaging/python python3 "$source/tests/tools/same_as_reader.py" "$work/run.mcap" <"$work/lines" ||
  fail "the Python reader sees something else"
if command -v node >/dev/null && command -v npm >/dev/null && cp -r "$source/tests/tools/mcap_reader" "$work/reader" &&
  (cd "$work/reader" && npm install --no-audit --no-fund >"$work/npm.txt" 2>&1); then
  (cd "$work/reader" && node compare.mjs "$work/run.mcap" "$work/export.mcap") >"$work/compared.json" || fail "the export holds other numbers"
  grep -q '"oven.inside":60' "$work/compared.json" || fail "the reference reader compared $(cat "$work/compared.json")"
else
  echo "NOT RUN: the reference reader needs node, npm and its registry: $(tail -n 1 "$work/npm.txt" 2>/dev/null)"
fi

echo "=== a live port"
"$kitchen" run "$source/examples/own_message/kitchen.yaml" --for 0s --policy cooperative --output "$work/live" >/dev/null 2>&1 &
run=$!
until "$takt" top --once --run $run >/dev/null 2>&1; do
  kill -0 $run 2>/dev/null || { fail "the run ended before it could be attached to"; break; }
  sleep 0.1
done
tells 0 '"celsius":' "$takt" echo oven.inside --run $run
expect 0 "" "$takt" stop --run $run
wait $run || [ $? -eq 1 ] || fail "the live run failed"  # 1: a deadline was missed, as ordinary threads may
finish
