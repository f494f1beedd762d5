# SPDX-License-Identifier: Apache-2.0
# The network between two machines: measured by `takt doctor --measure --peer`, and proven to be enough by `takt check`.
source "$(dirname "$0")/lib.sh" "$@"
graph=$source/graph/.peer_$$.yaml
trap 'rm -rf "$graph" "$work"' EXIT

with() { sed "$1" "$source/graph/two_machines.yaml" >"$graph"; }
tells 0 'note: the network is not proven to carry this: `network` has no `bandwidth`' "$takt" check "$source/graph/two_machines.yaml" --machine robot
with 's/domain: 93/domain: 93, bandwidth: 100Mbit/'
tells 0 "of 100.00 Mbit/s each way" "$takt" check "$graph" --machine robot
with 's/domain: 93/domain: 93, bandwidth: 5kbit/'
tells 1 'and `bandwidth` of `network` is' "$takt" check "$graph" --machine robot
with 's/domain: 93/domain: 93, bandwidth: fast/'
expect 2 'write a number above 0 with kbit, Mbit or Gbit' "$takt" check "$graph"
with 's/address: 10.93.0.2/address: 203.0.113.2/'
tells 0 "machine \`vision\` has the address 203.0.113.2, which is not of a private network" "$takt" check "$graph" --machine robot

expect 2 "add --measure" "$takt" doctor --peer 10.93.4.2
expect 3 "\`robot\` is no IP address" env TAKT_MACHINE="$work/machine.json" "$takt" doctor --measure --peer robot

two_machines 10.93.4 'rm -f "$graph"'
limited=no
tc -n $one qdisc add dev cable root tbf rate 100mbit burst 16kb latency 50ms 2>/dev/null && limited=yes
for end in "$one 10.93.4.2" "$two 10.93.4.1"; do
  read -r space peer <<<"$end"
  TAKT_MACHINE=$work/$space.json ip netns exec "$space" "$takt" doctor --measure --peer "$peer" >"$work/$space.out" 2>"$work/$space.err" &
done
wait
sed -n '/there and back/,$p' "$work/$one.out"
grep -q '^network: {latency: [0-9]*ms, clock_error: [0-9]*ms, bandwidth: [0-9]*Mbit}$' "$work/$one.out" || fail "no line for the graph: $(cat "$work/$one.err")"
python3 - "$work/$one.json" "$work/$two.json" $limited <<'PY' || fail "what was measured is wrong"
import json, sys
one, two = (next(iter(json.load(open(name))["peers"].items())) for name in sys.argv[1:3])
assert one[0] == "10.93.4.2" and two[0] == "10.93.4.1"
one, two = one[1], two[1]
for side in (one, two):
    spread = side["there_and_back_us"]
    assert spread["samples"] + side["lost"] >= 500 and spread["p50"] <= spread["p99"] <= spread["max"], side
    assert abs(side["clock_offset_ms"]) <= side["clock_error_ms"], side  # both have one clock
    assert side["mtu"] == 1500, side
assert abs(one["sends_mbit_s"] - two["receives_mbit_s"]) <= 0.2 * two["receives_mbit_s"], (one, two)
if sys.argv[3] == "yes":
    assert 70 <= one["sends_mbit_s"] <= 130, one
    assert two["sends_mbit_s"] > 130, two
PY
finish
