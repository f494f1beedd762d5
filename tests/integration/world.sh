# SPDX-License-Identifier: Apache-2.0
# The export as CDR: other programs' decoders read every message by the definitions in the file, and find in it what the
# export as JSON says.
source "$(dirname "$0")/lib.sh" "$@"

echo "=== a run, exported twice"
ports=()
for port in stereo.cloud stereo.disparity stereo.rectified semantic_map.objects semantic_map.reports ground_map.mask mapping_3d.map; do
  ports+=(--record-port "$port")
done
tells 0 "nothing lost" "$takt" run "$source/graph/ace.yaml" --clock virtual --for 2s --record "$work/run.mcap" "${ports[@]}" \
  --output "$work/out"
tells 0 "messages" "$takt" log export "$work/run.mcap" -o "$work/json.mcap"
tells 0 "messages" "$takt" log export "$work/run.mcap" -o "$work/cdr.mcap" --encoding cdr
[ "$(grep -o '^[0-9]* messages,' "$work/stderr")" = "$("$takt" log export "$work/run.mcap" -o "$work/json.mcap" --encoding json |
  grep -o '^[0-9]* messages,')" ] || fail "the two exports have different numbers of messages"
[ $((4 * $(stat -c %s "$work/cdr.mcap"))) -lt "$(stat -c %s "$work/json.mcap")" ] || fail "CDR is not a quarter of JSON: $(ls -l "$work"/*.mcap)"

echo "=== the decoders of others"
if command -v node >/dev/null && command -v npm >/dev/null && cp -r "$source/tests/tools/mcap_reader" "$work/reader" &&
  (cd "$work/reader" && npm install --no-audit --no-fund >"$work/npm.txt" 2>&1); then
  (cd "$work/reader" && node cdr.mjs "$work/cdr.mcap" "$work/json.mcap") >"$work/compared.json" || fail "CDR and JSON differ"
  for schema in CompressedImage RawImage CameraCalibration PointCloud LaserScan Grid PoseInFrame FrameTransform Log SceneUpdate; do
    grep -q "\"foxglove_msgs/msg/$schema\":[1-9]" "$work/compared.json" || fail "no $schema was compared"
  done
  for schema in Objects3d BodyPoses ObjectReports HeadState Detections; do
    grep -q "\"takt_msgs/msg/$schema\":[1-9]" "$work/compared.json" || fail "no $schema was compared"
  done
  echo "compared: $(cat "$work/compared.json")"
else
  echo "NOT RUN: the decoders need node, npm and its registry: $(tail -n 1 "$work/npm.txt" 2>/dev/null)"
fi

echo "=== bad input"
expect 2 "--encoding: xml not in {json,cdr}" "$takt" log export "$work/run.mcap" -o "$work/x.mcap" --encoding xml
[ ! -e "$work/x.mcap" ] || fail "a refused export left a file"
finish
