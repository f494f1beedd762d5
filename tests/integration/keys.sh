# SPDX-License-Identifier: Apache-2.0
# Keys of machines: who has none, or those of another authority, is not listened to and named. As root, with two network
# namespaces; without the right to make them it says so.
source "$(dirname "$0")/lib.sh" "$@"
graph=$source/graph/two_machines.yaml

command -v openssl >/dev/null || not_run "openssl is missing"
expect 2 'has no `machines`' "$takt" keys "$source/graph/lasers.yaml" --out "$work/none"
tells 0 "copy it to that machine only" "$takt" keys "$graph" --out "$work/keys" --days 30
[ "$(stat -c %a "$work/keys/robot/key.pem" "$work/keys/ca/ca.key" | uniq)" = 600 ] || fail "others can read a key"
tells 0 "there already, kept" "$takt" keys "$graph" --out "$work/keys"
expect 0 "" "$takt" keys "$graph" --out "$work/foreign"
sed 's/domain: 93/domain: 92/' "$graph" >"$source/graph/.domain_$$.yaml"
trap 'rm -rf "$source/graph/.domain_$$.yaml" "$work"' EXIT
expect 2 "Nothing is overwritten" "$takt" keys "$source/graph/.domain_$$.yaml" --out "$work/keys"

refused() { # TEXT KEYS [OPTIONS...]: before anything starts
  expect 2 "$1" "$takt" run "$graph" --for 1s --policy cooperative --output "$work/none" --keys "${@:2}"
}
refused "--keys belongs to --machine" "$work/keys/robot"
refused "has the keys of all machines: give --keys $work/keys/robot" "$work/keys" --machine robot
refused "has keys for machine vision, this is robot" "$work/keys/vision" --machine robot
cp -r "$work/keys/robot" "$work/open" && chmod 644 "$work/open/key.pem"
refused "others can read $work/open/key.pem (mode 644); run:  chmod 600" "$work/open" --machine robot
rm "$work/open/governance.p7s"
refused "open/governance.p7s" "$work/open" --machine robot

[ -e "$(dirname "$takt")/../../rt/libtakt_dds.so" ] || not_run "built without cyclonedds-dev and cyclonedds-tools"
two_machines 10.93.0 'rm -f "$source/graph/.domain_$$.yaml"'

on() { # on SPACE NAME MACHINE SECONDS OPTIONS...: a run in the background
  beside "$2" ip netns exec "$1" "$takt" run "$graph" --machine "$3" --policy cooperative --for "$4s" --ring off \
    --output "$work/$2" --report "$work/$2.json" "${@:5}"
}

# Both have keys. Nothing of a message or a topic can be read on the cable.
on $one robot robot 10 --keys "$work/keys/robot"
robot=$!
on $two vision vision 5 --keys "$work/keys/vision"
vision=$!
ip netns exec $two python3 - <<'PY' || fail "what goes over the cable is not encrypted"
import socket, time
cable = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
cable.bind(("cable", 0))
cable.settimeout(0.1)
kinds, plain, end = set(), 0, time.monotonic() + 5
while time.monotonic() < end:
    try:
        frame = cable.recv(1 << 17)
    except TimeoutError:
        continue
    plain += b"takt/two_machines" in frame or b"TKt1" in frame
    packet = frame[42:]
    at = 20
    while packet[:4] == b"RTPS" and at + 4 <= len(packet):
        kinds.add(packet[at])
        size = int.from_bytes(packet[at + 2:at + 4], "little" if packet[at + 1] & 1 else "big")
        at += 4 + (size or len(packet))
assert plain == 0, plain
assert 0x31 in kinds, kinds  # SEC_PREFIX: what follows is encrypted
PY
wait $vision || fail "vision: exit $?: $(tail -n 5 "$work/vision.err" "$work/vision.out")"
wait $robot
python3 - "$work/vision.json" "$work/robot.json" <<'PY' || fail "with keys on both sides: $(cat "$work/vision.err")"
import json, sys
for name in sys.argv[1:]:
    assert json.load(open(name))["unauthenticated"] is False
report = json.load(open(sys.argv[1]))
edge = next(e for e in report["edges"] if e["from"] == "base.odometry")
assert 30 <= edge["received"] <= 77, edge  # 15 Hz for 5 s, once both have shaken hands
device = next(d for d in report["devices"] if d["name"] == "base")
assert device["damaged"] == device["missing"] == 0, device
PY
grep -q "is not listened to" "$work/robot.err" "$work/vision.err" && fail "a machine with keys is refused: $(cat "$work/robot.err" "$work/vision.err")"

# A robot that had a machine of its own, then has strangers in its place.
on $one host robot 24 --keys "$work/keys/robot"
host=$!
on $two guest vision 3 --keys "$work/keys/vision"
wait $!
stranger() { # NAME WHY-HERE WHY-THERE OPTIONS...
  on $two "$1" vision 3 "${@:4}"
  local vision=$!
  said "10.93.0.2 is not listened to: $2" "$work/host.err"
  said "10.93.0.1 is not listened to: $3" "$work/$1.err"
  kill -INT $vision  # it waits for a machine that it would listen to
  wait $vision
}
stranger unknown "it runs without keys" "it has keys, and this machine runs without --keys"
stranger foreign "its keys are of another authority" "its keys are of another authority" --keys "$work/foreign/vision"
wait $host
grep -q "not listened to in this run: 10.93.0.2 (.*), 10.93.0.2 (" "$work/host.err" || fail "not said at the end: $(cat "$work/host.err")"
python3 - "$work/host.json" <<'PY' || fail "a stranger was listened to: $(cat "$work/host.err")"
import json, sys
report = json.load(open(sys.argv[1]))
device = next(d for d in report["devices"] if d["name"] == "traversability")
assert 20 <= device["received"] <= 50, device  # 15 Hz of the 3 s of the guest
assert report["modes"][-1]["name"] == "alone", report["modes"]
PY

# Without keys that is said in the report.
on $one free_robot robot 4
robot=$!
on $two free_vision vision 2
wait $!
wait $robot
python3 -c 'import json, sys; assert json.load(open(sys.argv[1]))["unauthenticated"] is True' "$work/free_vision.json" ||
  fail "without keys a report does not say so"
finish
