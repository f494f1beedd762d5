#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What it costs to change the database of known objects while the robot runs: reload.sh [CHANGES]. The same run twice, without
# and with CHANGES (100) of object_detection's database, seven a second as its jobs: two lists, with other names of their entries,
# are published, and `takt set object_detection:revision` asks for them in turn. Every message is read beside it: the classes in one must be of one list. Exit 1 if a node of high criticality misses, if object_detection misses or skips more than
# without the changes, or if a message mixes two lists or none shows the change.
# POLICY=cooperative where the kernel refuses the schedule's.
set -eu
root=$(readlink -f "$(dirname "$0")/../..")
takt=${TAKT:-$root/takt}
changes=${1:-100}
seconds=$((changes / 5 + 10))
work=$(mktemp -d)
trap 'rm -rf "$work"; kill $(jobs -p) 2>/dev/null || true' EXIT

cp -r "$root/graph/objects" "$work/objects"
cp "$work/objects/objects.txt" "$work/list_0"
sed 's/^object /&other_/' "$work/list_0" >"$work/list_1"
publish() { # 0 or 1: prints the revision
  cp "$work/list_$1" "$work/list" && mv "$work/list" "$work/objects/objects.txt"
  "$takt" objects publish "$work/objects" | head -n 1
}
revisions[1]=$(publish 1)  # before the run, so that changes come as fast as jobs take them
revisions[0]=$(publish 0)

for with in without with; do
  "$takt" run ${POLICY:+--policy "$POLICY"} --for "${seconds}s" --set "object_detection.database=$work/objects" --output "$work/out" \
    --report "$work/$with.json" >"$work/$with.log" 2>&1 & run=$!
  until "$takt" top --once >/dev/null 2>&1; do
    kill -0 $run 2>/dev/null || { tail -n 5 "$work/$with.log"; exit 3; }
    sleep 0.2
  done
  "$takt" echo object_detection.detections --count $((7 * seconds)) >"$work/$with.echo" 2>/dev/null & echo=$!
  if [ $with = with ]; then
    begin=$(date +%s.%N)
    sets=()
    for ((i = 1; i <= changes; ++i)); do  # none waits for the one before, which takes until the node's next job
      "$takt" set object_detection:revision "${revisions[i % 2]}" & sets+=($!)
      sleep "$(echo "$begin $(date +%s.%N) $i" | awk '{ d = $3 / 7 - ($2 - $1); print (d > 0 ? d : 0) }')"
    done
    for set in "${sets[@]}"; do wait "$set"; done
    echo "$changes changes, $(echo "$changes $begin $(date +%s.%N)" | awk '{ printf "%.1f", $1 / ($3 - $2) }') a second"
  fi
  wait $run || true
  wait $echo 2>/dev/null || true
done

python3 - "$work" "$changes" <<'PY'
import json, sys
work, changes = sys.argv[1], int(sys.argv[2])
late, failed = {}, []
for run in ("without", "with"):
    report = json.load(open(f"{work}/{run}.json"))
    node = next(n for n in report["nodes"] if n["name"] == "object_detection")
    high = {n["name"]: n["deadline_misses"] for n in report["nodes"] if n["criticality"] == "high" and n["deadline_misses"]}
    late[run] = node["deadline_misses"] + node["skipped"]
    text, messages, decoder = open(f"{work}/{run}.echo").read(), [], json.JSONDecoder()
    while text.strip():
        try: message, end = decoder.raw_decode(text.lstrip())
        except json.JSONDecodeError: break  # the run's end cut it off
        messages.append(message)
        text = text.lstrip()[end:]
    known = len([l for l in open(f"{work}/list_0") if l.startswith("object ")])
    lists = []
    for message in messages:
        classes = {int(box[0]) // known for box in message["message"]["boxes"]["first"]}
        if len(classes) > 1: failed.append(f"{run}: a message has classes of two lists: {message}")
        lists += classes
    turns = sum(a != b for a, b in zip(lists, lists[1:]))
    if high: failed.append(f"{run}: missed: {high}")
    if run == "without" and turns: failed.append("without a change the lists changed")
    if run == "with" and not turns: failed.append("no message shows a change")
    print(f"{run:<8} {node['released']} jobs of object_detection, {node['deadline_misses']} late, {node['skipped']} skipped; "
          f"{len(messages)} messages read, {len(lists)} with objects, {turns} changes seen in them; high nodes missed {sum(high.values())}; "
          f"policy {report['policy_granted']}, host stall {report['host_stall_ms']} ms")
if late["with"] > late["without"]: failed.append(f"object_detection was late {late['with']} times, {late['without']} without changes")
for line in failed: print("FAILED:", line)
sys.exit(bool(failed))
PY
