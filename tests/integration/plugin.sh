# SPDX-License-Identifier: Apache-2.0
# Plug-ins in the stock command: found, refused with the reason, tried before they are loaded, contained in their jobs.
source "$(dirname "$0")/lib.sh" "$@"
built=$3

cp "$source"/tests/integration/plugin/*.yaml "$built/libblink.so" "$work/"
graph=$work/blink.yaml
run() { "$takt" run "$graph" --for 1s --clock virtual --output "$work/out" "$@"; }

# By the graph, by the command line, and from the plug-in folder of an installation.
expect 0 "" run --report "$work/report.json" --record "$work/blink.mcap"
python3 - "$work/report.json" <<'PY' || fail "the nodes of the plug-in did not run"
import json, sys
nodes = {n["name"]: n["completed"] for n in json.load(open(sys.argv[1]))["nodes"]}
assert nodes == {"blinker": 20, "watcher": 20}, nodes
PY
expect 0 "" "$takt" check "$graph"
expect 0 "" "$takt" show "$graph"
expect 0 "" "$takt" nodes blinker --plugin "$work/libblink.so"
grep -q "says on and off in turn" "$work/stdout" || fail "takt nodes --plugin does not know blinker"
expect 2 "blinker" "$takt" nodes blinker
grep -v "^plugins:" "$graph" >"$work/bare.yaml"
expect 2 "blinker" "$takt" check "$work/bare.yaml"
expect 0 "" "$takt" check "$work/bare.yaml" --plugin "$work/libblink.so"
expect 0 "" "$takt" check "$graph" --plugin "$work/libblink.so"  # twice is once
mkdir -p "$work/prefix/bin" "$work/prefix/lib/takt/plugins"
cp "$takt" "$work/prefix/bin/takt"
mv "$work/libblink.so" "$work/prefix/lib/takt/plugins/"
expect 0 "" "$work/prefix/bin/takt" check "$graph"
expect 2 "blink.yaml:5:11: error: plug-in libblink.so: no such file; looked in $work" run
cp "$built/libblink.so" "$work/"

# By a file that the graph includes: beside that file, and its errors point there.
mkdir -p "$work/whole/parts"
cp "$work/blink.yaml" "$work/blink_schedule.yaml" "$work/libblink.so" "$work/whole/parts/"
printf 'takt: 1\nname: whole\ninclude: [parts/blink.yaml]\n' >"$work/whole/whole.yaml"
expect 0 "" "$takt" check "$work/whole/whole.yaml"
rm "$work/whole/parts/libblink.so"
expect 2 "whole/parts/blink.yaml:5:11: error: plug-in libblink.so: no such file; looked in $work/whole/parts" \
  "$takt" check "$work/whole/whole.yaml"

# A record says which plug-ins it was made with.
expect 0 "" "$takt" replay "$work/blink.mcap" --compare --output "$work/out"
grep -qE "compared ([0-9]+) of \1 messages.* 0 differ" "$work/stdout" || fail "replay: $(cat "$work/stdout")"
expect 0 "" "$takt" log info "$work/blink.mcap"
rm "$work/libblink.so"
expect 2 "libblink.so" "$takt" replay "$work/blink.mcap" --compare --output "$work/out"
expect 0 "" "$takt" replay "$work/blink.mcap" --compare --output "$work/out" --plugin "$built/libblink.so"
cp "$built/libblink.so" "$work/"
printf 'x' >>"$work/libblink.so"  # runs as before, but is another file
expect 0 "libblink.so is not what it was when the record was made" "$takt" replay "$work/blink.mcap" --compare --output "$work/out"
cp "$built/libblink.so" "$work/"

# What is no plug-in, or one for another Takt.
refused() { # refused TEXT COMMAND...: exit 2, and nothing was started
  local text=$1
  shift
  rm -rf "$work/out"
  expect 2 "$text" "$@"
  [ ! -e "$work/out" ] || fail "it was started: $*"
}
echo "words" >"$work/words.so"
refused "is no plug-in of Takt: TAKT_PLUGIN is missing" run --plugin "$work/words.so"
: >"$work/empty.so"
refused "is empty" run --plugin "$work/empty.so"
refused "no such file" run --plugin "$work/none.so"
refused "was built for another Takt: " run --plugin "$built/libblink_avx.so"
grep -qE "another Takt: (vectors is AVX, here|EIGEN_MAX_ALIGN_BYTES is)" "$work/stderr" || fail "it does not say what differs"
sed -E 's/(takt plug-in, ABI: [^\x00]*compiler=[a-z]* )1/\19/' "$built/libblink.so" >"$work/other.so"
refused "compiler is" run --plugin "$work/other.so"
cp "$built/libblink.so" "$work/half.so"
printf 'XXXX' | dd of="$work/half.so" conv=notrunc status=none
refused "cannot be loaded: " run --plugin "$work/half.so"

# What goes wrong while it is loaded goes wrong in a child.
while read -r trouble text; do
  BLINK=${trouble//_/ } refused "$text" run
  BLINK=${trouble//_/ } refused "$text" "$takt" check "$graph"
done <<'END'
crash crashes while it is loaded: signal 6
throw_early crashes while it is loaded: signal 6
exit ends the process while it is loaded (exit 0)
throw registers nothing: the lamp is missing
taken registers nothing: 
thread leaves 1 thread behind
END
BLINK=loop refused "is still not loaded after 10 s" run
BLINK=fork refused "registers nothing: the lamp is missing" run
[ -z "$(pgrep -f "^$takt run $graph")" ] || fail "a process of the plug-in's trial lives on"

# Any command but `run` has it in a child only: what a setup does there is told by node, and nothing is left behind.
blinker=$work/blink.yaml:$(awk '/^    blinker:/ {print NR}' "$graph")
none_left() { sleep 0.1; [ -z "$(pgrep -f "^$takt ")" ] || fail "a process is left behind: $(pgrep -af "^$takt ")"; }
commands=("check $graph" "profile $graph --for 1s" "replay $work/blink.mcap --output $work/out")
while read -r trouble text; do
  for words in "${commands[@]}"; do
    # shellcheck disable=SC2086
    BLINK=${trouble//_/ } expect 2 "$blinker" "$takt" $words
    grep -qF "error: blinker: its setup $text; plug-ins: libblink.so" "$work/stderr" || fail "not said: $text"
    none_left
  done
done <<'END'
setup_crash crashes: signal 6 (Aborted)
setup_exit ends the process (exit 0)
END
BLINK="setup loop" expect 2 "error: blinker: its setup does not return within 30 s" "$takt" check "$graph"
none_left
for trouble in "setup fork" "setup handlers"; do
  BLINK=$trouble expect 0 "" "$takt" check "$graph"
  none_left
done
diff <("$takt" check "$graph" 2>&1) <(BLINK="setup handlers" "$takt" check "$graph" 2>&1) || fail "check prints something else"

# ended TROUBLE SIGNAL CODE TEXT: a check whose setup never returns ends by the signal, with its child.
ended() {
  BLINK=$1 "$takt" check "$graph" >"$work/stdout" 2>"$work/stderr" &
  local check=$!
  until pgrep -P $check >/dev/null && grep -q libblink.so "/proc/$(pgrep -n -P $check)/maps" 2>/dev/null; do sleep 0.1; done
  sleep 0.5  # by now it is in the setup
  grep -q libblink.so /proc/$check/maps && fail "the parent has loaded the plug-in"
  kill -s "$2" $check
  wait $check
  local got=$?
  [ $got -eq "$3" ] || fail "exit $got instead of $3 after $2"
  [ -z "$4" ] || grep -qF "$4" "$work/stderr" || fail "not said: $4"
  none_left
}
ended "setup loop" TERM 143 ""
ended "setup fork loop" TERM 143 ""
ended "setup deaf" TERM 143 "error: blinker: its setup did not end within 10 s of signal 15 and was killed"
BLINK="setup loop" timeout -s INT 2 "$takt" check "$graph"
none_left
BLINK="setup loop" timeout -s KILL 2 "$takt" check "$graph"
none_left
"$takt" profile "$graph" --for 20s >"$work/stdout" 2>"$work/stderr" &
profile=$!
until grep -q "takt profile: each job alone" "$work/stderr"; do sleep 0.1; done
sleep 1
kill -TERM $profile
wait $profile
[ $? -eq 1 ] && grep -q "stopped: nothing was written" "$work/stderr" || fail "a profile does not end as it is told to"
none_left

# A run in several processes: supervisor and nursery know it by its description, the processes for its nodes load it.
loaded_in() { grep -q libblink.so "/proc/$1/maps"; }
apart() { # apart NAME: such a run of $work/NAME.yaml
  name=$1
  start_run "$name" "$work/$name.yaml" --isolate subsystem --for 0s --record "$work/$name.mcap" --report "$work/$name.json"
  loaded_in "$run" && fail "the supervisor has loaded the plug-in"
  local nurseries lamp
  nurseries=$(pgrep -x takt-nursery -P "$run")
  [ -n "$nurseries" ] || fail "there is no nursery"
  for nursery in $nurseries; do loaded_in "$nursery" && fail "a nursery has loaded the plug-in"; done
  lamp=$(member lamp)
  loaded_in "$lamp" || fail "the process lamp has not loaded the plug-in"
  loaded_in "$(member eye)" || fail "the process eye has not loaded the plug-in"
  expect 0 "" "$takt" echo blinker.light --count 2 --run $run
  prints '"words": "o'
  expect 2 "is no picture" "$takt" echo blinker.light --png "$work/glow.png" --run $run
  expect 0 "" "$takt" set blinker.brightness 200 --run $run
  expect 2 "must lie in 0..255" "$takt" set blinker.brightness 256 --run $run
  expect 2 "must lie in -3.14159..3.14159" "$takt" set blinker.angle 181deg --run $run
  kill -KILL "$lamp"
  said "process lamp is back" "$work/$name.err"
  lamp=$(member lamp)
  loaded_in "$lamp" || fail "the process lamp has not loaded the plug-in again"
  expect 0 "" "$takt" echo blinker.light --run $run
  prints '"brightness": 200'
  end_run "0 1"
  expect 0 "" "$takt" log echo "$work/$name.mcap" watcher.seen
  said '"words":"yes"' "$work/stdout"
  for isolate in none subsystem; do
    expect 0 "" "$takt" replay "$work/$name.mcap" --compare --isolate $isolate --output "$work/out"
    grep -qE "compared ([0-9]+) of \1 messages.* 0 differ" "$work/stdout" || fail "replay: $(cat "$work/stdout")"
  done
  "$takt" replay "$work/$name.mcap" --isolate subsystem --recorded-pace --output "$work/out" >"$work/stdout" 2>&1 &
  run=$!
  until lamp=$(member lamp) && loaded_in "$lamp"; do kill -0 $run || break; sleep 0.1; done
  loaded_in $run && fail "the process that supervises a replay has loaded the plug-in"
  wait $run || fail "replay --isolate subsystem: $(cat "$work/stdout")"
}
cp "$graph" "$work/several.yaml"
apart several
sed 's/^  lamp:/&\n    spare: true/' "$graph" >"$work/spared.yaml"
apart spared
python3 - "$work/several.json" "$work/report.json" <<'PY' || fail "the plan of several processes is another one"
import json, sys
several, whole = (json.load(open(name)) for name in sys.argv[1:])
assert several["isolation"] == "subsystem", several["isolation"]
sizes = lambda report: {pool["port"]: pool["bytes"] for pool in report["memory"]["pools"]}
assert sizes(several) == sizes(whole), (sizes(several), sizes(whole))
PY

# A node may take longer to save its files than a process may to end.
BLINK="finish slowly" expect 0 "" "$takt" run "$graph" --for 1s --isolate subsystem --policy cooperative --output "$work/out"

# In its jobs it is contained as every node is.
for trouble in throw crash loop; do
  "$takt" run "$graph" --for 3s --isolate subsystem --policy cooperative --set blinker.trouble=$trouble --output "$work/out" \
    --report "$work/$trouble.json" >"$work/stdout" 2>"$work/stderr"
  code=$?
  echo "--- $trouble: exit $code"
  python3 - "$work/$trouble.json" $trouble <<'PY' || { tail -n 20 "$work/stderr"; fail "$trouble of a plug-in's node is not contained"; }
import json, sys
report = json.load(open(sys.argv[1]))
nodes = {n["name"]: n for n in report["nodes"]}
assert nodes["watcher"]["completed"] >= nodes["watcher"]["released"] - 1 >= 50, nodes["watcher"]
assert report["faults"], "nothing is said of it"
PY
done
finish
