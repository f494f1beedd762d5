#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What a command may claim to have done: nothing compared and a damaged record are exit 1, a file has one writer and is
# whole or the older one, and a limit of files or a reader that goes away ends no run.
source "$(dirname "$0")/lib.sh"

echo "=== nothing compared, nothing read"
"$takt" run "$source/graph/lasers.yaml" --clock virtual --for 2s --record "$work/lasers.mcap" --output "$work/out" >/dev/null 2>&1
tells 0 "compared 30 of 30 messages" "$takt" replay "$work/lasers.mcap" --compare --output "$work/out"
size=$(stat -c %s "$work/lasers.mcap")
head -c $((size - 100)) "$work/lasers.mcap" >"$work/cut_off.mcap"
for ((left = size / 4; left > 0; left -= 500)); do
  head -c $left "$work/lasers.mcap" >"$work/without_jobs.mcap"
  "$takt" log info --allow-damage --json "$work/without_jobs.mcap" 2>/dev/null | grep -q '"jobs": [1-9]' || break
done
for command in "replay --output $work/out" "replay --compare --output $work/out" "log info" "log echo"; do
  expect 1 "$work/cut_off.mcap is not whole" "$takt" $command "$work/cut_off.mcap"
  expect 0 "" "$takt" $command --allow-damage "$work/cut_off.mcap"
done
expect 1 "is not whole" "$takt" log diff "$work/cut_off.mcap" "$work/cut_off.mcap"
for command in export cut; do
  expect 1 "is not whole" "$takt" log $command "$work/cut_off.mcap" -o "$work/again.mcap"
  [ -s "$work/again.mcap" ] || fail "log $command did not write what is left"
  rm "$work/again.mcap"
  expect 1 "without_jobs.mcap: has no" "$takt" log $command --allow-damage "$work/without_jobs.mcap" -o "$work/again.mcap"
  [ ! -e "$work/again.mcap" ] || fail "log $command wrote an empty file"
done
expect 1 "nothing was replayed" "$takt" replay "$work/without_jobs.mcap" --compare --allow-damage --output "$work/out"
expect 1 "nothing was compared" "$takt" log diff --allow-damage "$work/without_jobs.mcap" "$work/without_jobs.mcap"
expect 1 "has no job between" "$takt" log cut "$work/lasers.mcap" --from 100 -o "$work/again.mcap"

echo "=== one writer for one file"
start_run writer "$source/graph/lasers.yaml" --for 0s --record "$work/one.mcap" --report "$work/one.json" --trace "$work/one_trace.json"
for option in --record=one.mcap --report=one.json --trace=one_trace.json --html=one.json --report=one.mcap; do
  expect 2 "process $run writes to it" "$takt" run "$source/graph/lasers.yaml" --for 1s --output "$work/out" "${option%=*}" "$work/${option#*=}"
done
expect 2 "process $run writes to it" "$takt" run "$source/graph/lasers.yaml" --for 1s --output "$work/writer"
expect 2 "process $run writes to it" "$takt" log cut "$work/lasers.mcap" -o "$work/one.mcap"
kill -INT $run
wait $run
code=$?
[ $code -le 1 ] || fail "the first run: exit $code"  # 1: a deadline was missed, as ordinary threads may
expect 0 "" "$takt" log info "$work/one.mcap"
[ -s "$work/one.json" ] && [ -s "$work/one_trace.json" ] && [ ! -e "$work/one.json.part" ] || fail "the files of the first run: $(ls "$work")"
expect 2 "this command itself, for another option," "$takt" run "$source/graph/lasers.yaml" --for 1s --clock virtual --output "$work/out" --report "$work/x.json" --html "$work/x.json"

echo "=== limits of files, readers that go away"
sed "s|worlds/|$source/graph/worlds/|; s|\.\./schedules|$source/schedules|" "$source/graph/lasers.yaml" >"$work/small.yaml"
echo 'record: {snapshots: none}' >>"$work/small.yaml"  # pools lie in files, too
expect 0 "" bash -c "ulimit -f 1000; '$takt' run '$work/small.yaml' --clock virtual --for 60s --record '$work/limited.mcap' --output '$work/out'"
prints "not written"
prints "(File too large)"
expect 1 "is not whole" "$takt" log info "$work/limited.mcap"
bash -c "'$takt' run '$source/graph/lasers.yaml' --policy cooperative --for 6s --output '$work/out' --report '$work/unread.json' 2> >(sleep 0.5) >'$work/stdout'"
code=$?
[ $code -le 1 ] && prints "ok" || fail "a run whose stderr nobody reads: exit $code"
grep -q '"unsaid_lines": [1-9]' "$work/unread.json" || fail "what stderr did not take is not counted"
if mkdir "$work/small" && mount -t tmpfs -o size=64k none "$work/small" 2>/dev/null; then
  echo old | tee "$work/small/r.json" >"$work/small/t.json"
  dd if=/dev/zero of="$work/small/fill" bs=1k count=64 2>/dev/null
  expect 3 "r.json: No space left on device" "$takt" run "$source/graph/lasers.yaml" --clock virtual --for 1s --output "$work/out" \
    --report "$work/small/r.json" --trace "$work/small/t.json"
  [ "$(cat "$work/small/r.json" "$work/small/t.json" | tr -d '\n')" = oldold ] || fail "a full disk took the older report"
  [ "$(ls "$work/small" | tr '\n' ' ')" = "fill r.json t.json " ] || fail "left behind: $(ls "$work/small")"
  umount "$work/small"
else
  echo "NOT RUN: a full disk needs the right to mount a tmpfs"
fi
finish
