# SPDX-License-Identifier: Apache-2.0
# A record that another writer of MCAP has written again, in each way that the reference writer knows, is the same record to
# every reader: info, echo, export, diff, cut, replay, and the reader in Python.
source "$(dirname "$0")/lib.sh" "$@"

if ! { command -v node >/dev/null && command -v npm >/dev/null && cp -r "$source/tests/tools/mcap_reader" "$work/reader" &&
  (cd "$work/reader" && npm install --no-audit --no-fund >"$work/npm.txt" 2>&1); }; then
  echo "NOT RUN: the reference writer needs node, npm and its registry: $(tail -n 1 "$work/npm.txt" 2>/dev/null)"
  exit 77
fi
mkdir "$work/again"
tells 0 "nothing lost" "$takt" run "$source/graph/lasers.yaml" --clock virtual --isolate none --for 1s --record "$work/run.mcap" \
  --output "$work/out"
written=$(cd "$work/reader" && node rewrite.mjs "$work/run.mcap" "$work/again") || fail "the reference writer"
[ "$written" = 96 ] || fail "$written files instead of 96"

# seen FILE NAME: what every command of the record sees, in $work/NAME.*
seen() {
  "$takt" log info "$1" 2>"$work/$2.left" | grep ^content >"$work/$2.content"
  "$takt" log echo "$1" >"$work/$2.echo" && "$takt" log export "$1" -o "$work/$2.mcap" >"$work/$2.export" || fail "$1 cannot be read"
  cat "$work/$2.mcap" >>"$work/$2.export"
  "$takt" log cut "$1" --from 0.2 --to 0.6 -o "$work/$2.mcap" >/dev/null || fail "$1 cannot be cut"
  "$takt" log info "$work/$2.mcap" | grep ^content >"$work/$2.cut"
}

seen "$work/run.mcap" original
[ "$(wc -l <"$work/original.echo")" -gt 50 ] || fail "echo prints $(wc -l <"$work/original.echo") messages"
for file in "$work"/again/*.mcap; do
  name=$(basename "$file" .mcap)
  seen "$file" again
  for what in content echo export cut; do
    cmp -s "$work/original.$what" "$work/again.$what" || fail "$name: $what differs"
  done
  "$takt" log diff "$work/run.mcap" "$file" >"$work/diff" 2>&1 && grep -q "^the same" "$work/diff" || fail "$name: diff: $(cat "$work/diff")"
  "$takt" replay "$file" --compare --output "$work/out" >"$work/replay" 2>&1
  code=$?
  { [ $code = 0 ] && grep -q " 0 differ" "$work/replay"; } || { [ $code = 2 ] && grep -q "SIMD target" "$work/replay"; } ||
    fail "$name: replay: exit $code, $(cat "$work/replay")"
done
tells 0 "left out: 2 records of kind 144" "$takt" log info "$work/again/unknown.mcap"
PYTHONPATH=$source/packaging/python python3 "$source/tests/tools/record_digest.py" "$work/run.mcap" "$work"/again/*.mcap >"$work/python" ||
  fail "the reader in Python"
[ "$(cut -d' ' -f1 "$work/python" | sort -u | wc -l)" = 1 ] && [ "$(wc -l <"$work/python")" = 98 ] ||
  fail "in Python the records differ: $(sort "$work/python" | awk '{print $1}' | uniq -c)"
grep -q "unknown.mcap.*2 records of kind 144" "$work/python" || fail "Python does not report records of an unknown kind"
echo "97 files of the reference writer, each with $(cat "$work/original.content"), in 7 readers"
finish
