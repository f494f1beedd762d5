# SPDX-License-Identifier: Apache-2.0
# `takt show` and `takt report` as a user starts them: what they write, and what they refuse.
source "$(dirname "$0")/lib.sh" "$@"

expect 0 "" "$takt" show "$source/graph/ace.yaml"
grep -q "<- head_camera.pair (stereo_pair)" "$work/stdout" || fail "the listing does not say what stereo reads"
awk 'length > 80 {exit 1}' "$work/stdout" || fail "the listing is wider than 80 columns"
expect 0 "" "$takt" show --dot --mode no_stereo
grep -q '^digraph "ace"' "$work/stdout" || fail "no Graphviz text"
grep -q '"stereo"' "$work/stdout" && fail "the mode's nodes are drawn all the same"
expect 0 "" "$takt" show --svg "$work/ace.svg"
grep -q 'data-id="mapping_3d"' "$work/ace.svg" || fail "mapping_3d is not in the picture"
[ -s "$work/stdout" ] && fail "stdout is not empty"

# Without a device or a recording: nothing is opened.
expect 0 "" env TAKT_DATA="$work/nothing" "$takt" show "$source/graph/kitti.yaml"

expect 2 "excludes" "$takt" show --dot --svg "$work/x.svg"
expect 2 "choose another place" "$takt" show --svg "$work/none/x.svg"
expect 2 "does-not-exist" "$takt" show "$work/does-not-exist.yaml"
mkdir -p "$work/graph" && cp -r "$source/schedules" "$work/"
sed 's/type: stereo,/type: stereoo,/; s/max_age: 350ms/max_age: 250/' "$source/graph/ace.yaml" >"$work/graph/bad.yaml"
expect 2 "stereoo" "$takt" show "$work/graph/bad.yaml" --svg "$work/bad.svg"
grep -q "max_age" "$work/stderr" || fail "only the first problem was reported"
[ -e "$work/bad.svg" ] && fail "a picture of a bad graph was written"

"$takt" run --clock virtual --for 1s --output "$work/out" --report "$work/report.json" >/dev/null 2>&1 || fail "the run to report"
expect 0 "" "$takt" report "$work/report.json" --output "$work/out" --html "$work/report.html"
for words in "ace on thesis" "<td>ego_motion</td>" "data:image/png;base64," "track.png" "stop: front_laser.scan"; do
  grep -q "$words" "$work/report.html" || fail "the page lacks $words"
done
grep -q "not recorded" "$work/report.html" && fail "the page lacks something that runs record"
"$takt" run --clock virtual --for 1s --output "$work/out" --html "$work/at_once.html" >/dev/null 2>&1
grep -q "<td>ego_motion</td>" "$work/at_once.html" || fail "run --html wrote no page"
expect 2 "of graph ace" "$takt" report <(sed 's/"profile": "sim"/"profile": "replay"/' "$work/report.json") "$source/graph/kitti.yaml" --html "$work/x.html"
expect 2 "--schedule" "$takt" report <(sed 's/"schedule": "thesis"/"schedule": "other"/' "$work/report.json") --html "$work/x.html"
expect 2 "no report of a run" "$takt" report "$source/README.md" --html "$work/x.html"
expect 2 "cannot be read" "$takt" report "$work/none.json" --html "$work/x.html"
expect 2 "--html" "$takt" report "$work/report.json"
[ -e "$work/x.html" ] && fail "a page was written all the same"
finish
