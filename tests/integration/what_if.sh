# SPDX-License-Identifier: Apache-2.0
# A record is predicted on the same schedule, on fewer cores and on a slower computer; every option that cannot be used is named.
source "$(dirname "$0")/lib.sh" "$@"
graph=$source/graph/ace.yaml record=$work/run.mcap
what_if() { # EXIT 'TEXT ON STDERR' OPTIONS...
  local code=$1 text=$2
  shift 2
  expect "$code" "$text" "$takt" replay "$record" "$@"
}
judge() { # 'EXPRESSION OF r, the report of the run, and w, that of the what-if'
  python3 -c 'import json, sys; r, w = (json.load(open(f)) for f in sys.argv[1:3]); sys.exit(not eval(sys.argv[3]))' \
    "$work/run.json" "$work/what_if.json" "$1" || fail "not so: $1"
}

expect 0 "" "$takt" run "$graph" --clock virtual --durations random --for 3s --record "$record" --output "$work/out" --report "$work/run.json"

# The same again: what the run reported is what the record says, and what is predicted from it.
what_if 0 "" --speed 1 --report "$work/what_if.json"
prints "ok: every deadline of high criticality would hold"
same='[(n["name"], n["completed"], n["deadline_misses"], n["skipped"], n["stale_inputs"], n["quality"], n["lateness_us"],
  n["response_ms"]["max"], n["exec_ms"]) for n in %s["nodes"]]'
judge "${same/\%s/r} == ${same/\%s/w[\"predicted\"]}"
ages='[[x["age_ms"][k] for k in ("p50", "p99", "max")] for x in %s["chains"]]'
judge "${ages/\%s/r} == ${ages/\%s/w[\"predicted\"]} == ${ages/\%s/w[\"recorded\"]}"
misses='[n["deadline_misses"] for n in %s["nodes"]]'
judge "${misses/\%s/r} == ${misses/\%s/w[\"recorded\"]}"
judge 'not w["what_if"]["borrowed_jobs"] and w["what_if"]["speed"] == 1 and w["ok"] and w["predicted"]["ok"]'

# Another one.
what_if 1 "" --cores 1 --speed 0.4 --json
prints '"ok": false'
what_if 1 "" --cores 1 --speed 0.4
prints "NOT OK: deadlines of high criticality would be missed"
sed "s/^policy: .*/policy: fixed\ncores: [0, 1]/; s/  picture: {rate: 2/  picture: {rate: 1/" "$source/schedules/thesis.yaml" >"$work/other.yaml"
what_if 0 "" --schedule "$work/other.yaml" --report "$work/what_if.json"
judge '[n["samples"] for n in w["predicted"]["nodes"] if n["name"] == "picture"] == [3]'
judge 'w["what_if"]["policy"] == "fixed" and w["what_if"]["cores"] == 2'
expect 0 "" "$takt" log cut "$record" -o "$work/cut.mcap" --from 1 --to 2
expect 0 "" "$takt" replay "$work/cut.mcap" --cores 2
prints "1.0 s, predicted from"

# What cannot be used, with the option at fault and the valid choices.
what_if 2 "--schedule $work/none.yaml cannot be read: No such file or directory; schedules of this graph: " --schedule "$work/none.yaml"
grep -q "schedules/thesis.yaml" "$work/stderr" || fail "no schedule is offered"
what_if 2 "--schedule $work is a folder, a file is expected; schedules of this graph: " --schedule "$work"
what_if 2 "kitti.yaml: this is no schedule of the graph of the record" --schedule "$source/schedules/kitti.yaml"
grep -q 'node `stereo_wide` has no entry in the schedule' "$work/stderr" || fail "the missing node is not named"
what_if 2 "--cores 0: choose 1 to 64" --cores 0
what_if 2 "--cores 65: choose 1 to 64" --cores 65
what_if 2 "--speed 0: choose 0.001 to 1000, how many times as fast" --speed 0
what_if 2 "--speed -2: choose" --speed -2
what_if 2 "--speed nan: choose" --speed nan
what_if 2 "--compare: --schedule, --cores and --speed ask for a what-if" --cores 1 --compare
what_if 2 "--live: --schedule" --cores 1 --live stereo
what_if 2 "--json: only a what-if has a report; add --schedule" --json
what_if 2 "--report" --report "$work/what_if.json"
expect 2 "none.mcap" "$takt" replay "$work/none.mcap" --cores 1
finish
