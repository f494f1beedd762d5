# SPDX-License-Identifier: Apache-2.0
# Records: the same run on virtual time gives the same record; a replay gives the same bytes, of one process or several;
# a changed parameter is named; a killed run and a full disk leave a record that says what it lacks.
source "$(dirname "$0")/lib.sh" "$@"

echo "=== virtual time: two runs, one content"
for i in 1 2; do
  tells 0 "nothing lost" "$takt" run --clock virtual --isolate none --for 3s --record "$work/$i.mcap" --output "$work/out"
  "$takt" log info "$work/$i.mcap" >"$work/$i.txt" || fail "log info of record $i"
done
[ "$(grep ^content "$work/1.txt")" = "$(grep ^content "$work/2.txt")" ] || fail "two virtual runs differ"
tells 0 "the same" "$takt" log diff "$work/1.mcap" "$work/2.mcap"
for seed in 5 5 6; do  # what jobs take is drawn, or taken from a record: the same again for the same seed or record
  for how in random "$work/1.mcap"; do
    tells 0 "nothing lost" "$takt" run --clock virtual --durations "$how" --seed $seed --for 1s --record "$work/d.mcap" --output "$work/out"
    "$takt" log info "$work/d.mcap" | grep ^content >>"$work/$(basename "$how").$seed"
  done
done
for same in random 1.mcap; do
  [ "$(sort -u "$work/$same.5" | wc -l)" = 1 ] || fail "two runs with durations of $same differ"
done
[ "$(head -n 1 "$work/random.5")" != "$(cat "$work/random.6")" ] || fail "two seeds gave the same"
expect 2 "add --clock virtual" "$takt" run --durations random --for 1s
expect 2 "no_such.mcap" "$takt" run --clock virtual --durations "$work/no_such.mcap" --for 1s --output "$work/out"

echo "=== real time, one process and several: every byte again"
for isolate in none subsystem; do
  # No deadline is judged here: a missed one is exit 1, and is replayed as well.
  "$takt" run --isolate "$isolate" --for 3s --record "$work/$isolate.mcap" --output "$work/out" >"$work/run.txt" 2>&1
  [ $? -le 1 ] || fail "the run: $(cat "$work/run.txt")"
  grep -q "nothing lost" "$work/run.txt" || { echo "the recorder lost something on this machine:"; grep LOST "$work/run.txt"; }
  tells 0 " 0 differ" "$takt" replay "$work/$isolate.mcap" --compare --output "$work/replayed"
done
tells 0 " 0 differ" "$takt" replay "$work/subsystem.mcap" --compare --isolate subsystem --output "$work/replayed"
[ -s "$work/replayed/disparity.png" ] || fail "the replay wrote no pictures"

echo "=== a part of it: jobs that remember nothing make the same"
tells 0 "jobs" "$takt" log cut "$work/none.mcap" --from 1 --to 2 -o "$work/cut.mcap"
tells 0 "cut: 1.000 s to 2.000 s" "$takt" log info "$work/cut.mcap"
tells 0 " 0 differ" "$takt" replay "$work/cut.mcap" --compare --live stereo,object_detection --output "$work/out"
expect 2 "is the record itself" "$takt" log cut "$work/cut.mcap" -o "$work/cut.mcap"

echo "=== a changed parameter is named"
rm -rf "$work/graph" "$work/schedules"
mkdir -p "$work/graph" "$work/schedules"
cp -r "$source"/graph/{worlds,rigs,objects,objects_3d.txt,terrain.txt,networks,signs,skeletons,ace.yaml} "$work/graph/"
cp "$source/schedules/thesis.yaml" "$work/schedules/"
tells 0 "nothing lost" "$takt" run "$work/graph/ace.yaml" --clock virtual --isolate none --for 2s \
  --record "$work/edited.mcap" --output "$work/out"
tells 0 " 0 differ" "$takt" replay "$work/edited.mcap" --compare --output "$work/out"
sed -i 's/params: {save: map, map/params: {share: 0.6, save: map, map/' "$work/graph/ace.yaml"
grep -q "share: 0.6" "$work/graph/ace.yaml" || fail "the edit of the graph changed nothing"
tells 1 "first difference: mapping_3d.obstacles, job" "$takt" replay "$work/edited.mcap" --compare --output "$work/out"
tells 1 "mapping_3d.share is 0.6 instead of 0.15" "$takt" replay "$work/edited.mcap" --compare --output "$work/out"

echo "=== the reference reader of the format"
tells 0 "messages" "$takt" log export "$work/edited.mcap" -o "$work/export.mcap"
if command -v node >/dev/null && command -v npm >/dev/null && cp -r "$source/tests/tools/mcap_reader" "$work/reader" &&
  (cd "$work/reader" && npm install --no-audit --no-fund >"$work/npm.txt" 2>&1); then
  "$takt" log info "$work/edited.mcap" --json >"$work/info.json"
  for file in edited export; do
    (cd "$work/reader" && node read.mjs "$work/$file.mcap") >"$work/$file.json" || fail "the reference reader refuses $file.mcap"
  done
  python3 - "$work" <<'PY' || fail "the reference reader sees something else"
import json, sys
work = sys.argv[1]
info, read, exported = (json.load(open(f"{work}/{name}.json")) for name in ("info", "edited", "export"))
ports = {port["port"]: port["messages"] for port in info["ports"]}
jobs = sum(node["jobs"] for node in info["nodes"])
events = sum(info["events"].values())
assert {c: v["messages"] for c, v in read["channels"].items()} == ports | {"takt/jobs": jobs, "takt/events": events}, read["channels"]
assert read["attachments"].keys() == {"graph.yaml", "schedule.yaml", "plan.json", "assets.json"}, read["attachments"]
assert read["metadata"].keys() == {"takt", "takt end"}, read["metadata"]
schemas = {c: v["schema"] for c, v in exported["channels"].items()}
assert schemas["head_camera.pair.left"] == "foxglove.RawImage" and schemas["front_laser.scan"] == "foxglove.LaserScan", schemas
assert schemas["mapping_3d.obstacles"] == "foxglove.Grid" and schemas["semantic.status"] == "foxglove.Log", schemas
assert exported["channels"]["front_laser.scan"]["messages"] == ports["front_laser.scan"]
print(f"{len(ports) + 2} channels, {sum(ports.values()) + jobs} messages, every CRC; export: {len(schemas)} channels")
PY
  # Number by number, by the layouts in the record and the schemas of the export.
  tells 0 "nothing lost" "$takt" run --clock virtual --isolate none --for 300ms --record "$work/whole.mcap" --record-port all \
    --output "$work/out"
  tells 0 "messages" "$takt" log export "$work/whole.mcap" -o "$work/whole_export.mcap"
  (cd "$work/reader" && node compare.mjs "$work/whole.mcap" "$work/whole_export.mcap") >"$work/compared.json" ||
    fail "the export holds other numbers than the record"
  for topic in stereo.cloud stereo.disparity head_camera.pair.left ground_map.grid front_laser.scan; do
    grep -q "\"$topic\":[1-9]" "$work/compared.json" || fail "no number of $topic was compared"
  done
  echo "numbers compared: $(cat "$work/compared.json")"
else
  echo "NOT RUN: the reference reader needs node, npm and its registry: $(tail -n 1 "$work/npm.txt" 2>/dev/null)"
fi

echo "=== pictures as JPEG"
sed 's/^record:.*/record: {ports: {head_camera.pair: jpeg, ground_camera.pair: jpeg 95}}/' "$work/graph/ace.yaml" >"$work/graph/jpeg.yaml"
cmp -s "$work/graph/ace.yaml" "$work/graph/jpeg.yaml" && fail "the edit of record changed nothing"
for name in ace jpeg; do
  tells 0 "nothing lost" "$takt" run "$work/graph/$name.yaml" --clock virtual --isolate none --for 400ms --record "$work/$name.mcap" \
    --output "$work/out"
done
[ $((4 * $(stat -c %s "$work/jpeg.mcap"))) -lt "$(stat -c %s "$work/ace.mcap")" ] || fail "JPEG is not a quarter: $(ls -l "$work"/*.mcap)"
tells 0 "jpeg 85" "$takt" log info "$work/jpeg.mcap"
tells 1 "ground_camera.pair was recorded as jpeg 95" "$takt" replay "$work/jpeg.mcap" --compare --output "$work/out"
tells 0 '"width":640' "$takt" log echo "$work/jpeg.mcap" head_camera.pair
# The hashes are those of the run, so all that was not made into JPEG is the same.
tells 0 "the same" "$takt" log diff "$work/ace.mcap" "$work/jpeg.mcap"

echo "=== a killed run"
"$takt" run --isolate none --policy cooperative --for 20s --record "$work/killed.mcap" --output "$work/out" >/dev/null 2>&1 &
run=$!
until [ "$(stat -c %s "$work/killed.mcap" 2>/dev/null || echo 0)" -gt 20000000 ]; do
  kill -0 "$run" 2>/dev/null || fail "the run ended before it was killed"
  read -rt 0.1 <> <(:) || true
done
kill -9 "$run"
wait "$run" 2>/dev/null
tells 1 "the record lacks the end of its run" "$takt" log info "$work/killed.mcap"
tells 0 "the record lacks the end of its run" "$takt" log info --allow-damage "$work/killed.mcap"
"$takt" replay "$work/killed.mcap" --compare --allow-damage --output "$work/out" >"$work/replay.txt" 2>&1
grep -q " 0 differ" "$work/replay.txt" || fail "a cut record has other bytes: $(cat "$work/replay.txt")"

echo "=== a record that is deleted while it is written"
"$takt" run --isolate none --policy cooperative --for 2s --record "$work/deleted.mcap" --output "$work/out" >"$work/run.txt" 2>&1 &
run=$!
until [ -s "$work/deleted.mcap" ]; do kill -0 "$run" 2>/dev/null || break; read -rt 0.1 <> <(:) || true; done
rm "$work/deleted.mcap"
wait "$run"
code=$?
[ $code -eq 3 ] || fail "exit $code of a run whose record was deleted"
grep -q "deleted.mcap: the file was deleted" "$work/run.txt" || fail "a deleted record is not told: $(cat "$work/run.txt")"

echo "=== a full disk"
if mkdir "$work/small" && mount -t tmpfs -o size=20m none "$work/small" 2>/dev/null; then
  "$takt" run --isolate none --policy cooperative --for 3s --record "$work/small/run.mcap" --output "$work/out" >"$work/run.txt" 2>&1
  code=$?
  cp "$work/small/run.mcap" "$work/full.mcap"
  umount "$work/small"
  [ $code -le 1 ] || fail "the run did not go on with a full disk: $(cat "$work/run.txt")"
  grep -q "not written.*No space left on device" "$work/run.txt" || fail "the loss is not stated: $(grep record "$work/run.txt")"
  "$takt" log info --allow-damage "$work/full.mcap" >/dev/null || fail "the record on the full disk cannot be read"
else
  echo "NOT RUN: a full disk needs the right to mount a tmpfs"
fi

echo "=== bad input"
expect 2 "/nowhere/run.mcap No such file or directory" "$takt" run --record /nowhere/run.mcap
expect 2 "did you mean \`stereo.cloud\`" "$takt" run --for 1s --record "$work/x.mcap" --record-port stereo.clod
expect 2 "is no MCAP file" "$takt" replay "$source/README.md"
expect 2 "nothing.mcap" "$takt" log info "$work/nothing.mcap"
finish
