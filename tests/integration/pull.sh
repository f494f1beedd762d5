# SPDX-License-Identifier: Apache-2.0
# What a run keeps is taken off the robot: frozen files over a connection that breaks anywhere, the ring as it grows.
source "$(dirname "$0")/lib.sh" "$@"
cd "$source" || exit 1
robot=$work
out="it's the \$HOME of \"one\""
here="$work/pulled here"
mkdir "$work/bin"

# Stand-ins for ssh: HOST COMMAND. The second one breaks after $CUT bytes.
cat >"$work/bin/near" <<'EOF'
#!/bin/sh
shift
cd "$ROBOT" && exec sh -c "$*"
EOF
cat >"$work/bin/breaks" <<'EOF'
#!/bin/sh
shift
cd "$ROBOT" && sh -c "$*" | { dd bs=1 count="$CUT" 2>/dev/null; kill -9 $$; }
EOF
chmod +x "$work/bin/near" "$work/bin/breaks"
export ROBOT=$robot
near=$work/bin/near
pull() { "$takt" log pull "user@robot:$out" --output "$here" --ssh "$near" "$@"; }
# whole: each file under its name is the robot's.
whole() {
  local file
  for file in "$here"/*.mcap; do
    [ ! -e "$file" ] || cmp "$file" "$frozen/${file##*/}" || fail "$file is not what the robot has: $*"
  done
}
# all_here: and none is missing, or left in part.
all_here() {
  whole "$@"
  [ "$(cd "$frozen" && ls -- *.mcap)" = "$(ls "$here")" ] || { ls -l "$here"; fail "not all is here: $*"; }
}
graph() { # RECORD
  sed "s|worlds/|$source/graph/worlds/|; s|\.\./schedules|$source/schedules|" graph/lasers.yaml >"$work/graph.yaml"
  echo "record: $1" >>"$work/graph.yaml"
}
has_file() { [ -n "$(find "$1" -name "$2" -size +0 2>/dev/null)" ]; }  # FOLDER NAME

# has_ring OUTPUT: waits until the run there has written something.
has_ring() { until has_file "$1/flight/ring" "*.mcap" || ! kill -0 $run; do sleep 0.1; done; }

# A run that freezes something, and is served meanwhile.
graph '{before: 1s, after: 200ms}'
start_run "$out" "$work/graph.yaml" --for 0s --ring on
has_ring "$robot/$out"
"$takt" log serve "$robot/$out" >"$work/served.mcap" 2>"$work/served.err" &
server=$!
for word in one two three; do
  sleep 0.7
  expect 0 "" "$takt" mark "$word" --run $run
done
sleep 0.5
expect 0 "stopped" "$takt" log serve "$robot/$out/flight/ring" --for 1s
cp "$work/stdout" "$work/second.mcap"
expect 0 "" "$takt" log info "$work/second.mcap"
bash -c '"$1" log serve "$2" 2>"$3" | head -c 5000 >/dev/null; exit ${PIPESTATUS[0]}' - "$takt" "$robot/$out" "$work/gone.err" ||
  fail "serve whose reader goes ends with $?"
grep -q "the reader has gone" "$work/gone.err" || fail "stderr does not tell that the reader has gone"
expect 0 "" "$takt" stop --run $run
wait $run
wait $server || fail "serve ends with $?: $(cat "$work/served.err")"
grep -q "the run has ended: .*; gaps: 0" "$work/served.err" || fail "$(cat "$work/served.err")"
expect 0 "" "$takt" log info "$work/served.mcap"
expect 0 "" "$takt" log echo "$work/served.mcap" front_laser.scan
expect 0 "" "$takt" log rescue "$robot/$out/flight/ring" -o "$work/rescued.mcap"
expect 0 "" "$takt" log diff "$work/served.mcap" "$work/rescued.mcap"
prints "the same"

# All of it, and nothing twice.
frozen=$robot/$out/flight/frozen
cp "$frozen"/*-0001-*.mcap "$frozen/with space's \$x.mcap"
total=$(stat -c %s "$frozen"/*.mcap | awk '{sum += $1} END {print sum}')
expect 0 "" pull --list
prints "on the robot"
expect 0 "" pull
all_here "the first pull"
prints "fetched"
expect 0 "" pull
prints "already here"
expect 0 "" pull --json
[ "$(figure fetched_bytes)" = 0 ] || fail "a second pull fetched something"
for file in "$here"/*-mark.mcap; do expect 0 "" "$takt" log info "$file"; done

# Cut off at twenty places.
for i in $(seq 20); do
  rm -rf "$here"
  CUT=$((i * total / 20 - 50)) near=$work/bin/breaks expect 3 "" pull --json
  first=$(figure fetched_bytes)
  whole "cut off at $i"
  expect 0 "" pull --json
  all_here "cut off at $i"
  [ $((first + $(figure fetched_bytes))) = "$total" ] || fail "cut off at $i: some bytes were fetched twice"
done

# What an earlier pull left: damaged, right, and another file under the name itself.
file=$(cd "$frozen" && ls -- *-mark.mcap | head -n 1)
half=$(($(stat -c %s "$frozen/$file") / 2))
rm "$here/$file"
head -c $half "$frozen/$file" | tr '\0-\7' '\1-\10' >"$here/$file.part"
expect 0 "" pull
prints "fetched again, as its .part was damaged"
all_here "a damaged part"
rm "$here/$file"
head -c $half "$frozen/$file" >"$here/$file.part"
expect 0 "" pull
prints "MB on"
all_here "a part"
echo more >>"$here/$file"
expect 1 "is another file than that of user@robot" pull
cp "$frozen/$file" "$here"

# The disk is full: by a limit, and, where there is the right to make one, a small disk.
rm -rf "$here"
expect 3 "make room" bash -c 'ulimit -f 16; exec "$@"' - "$takt" log pull "robot:$out" -o "$here" --ssh "$near"
whole "a limit of the file size"
expect 0 "" pull
prints "MB on"
all_here "after the limit"
mkdir "$work/small"
if mount -t tmpfs -o size=64k tmpfs "$work/small" 2>/dev/null; then
  expect 3 "are to be fetched; make room" "$takt" log pull "robot:$out" -o "$work/small" --ssh "$near"
  [ -z "$(ls "$work/small")" ] || fail "a pull that finds no room has left $(ls "$work/small")"
  umount "$work/small"
else
  echo "NOT RUN: a small disk, for lack of the right to mount one"
fi

# A link that is left to others, and an interruption.
rm -rf "$here"
began=$(date +%s%N)
expect 0 "" pull --limit "$((total / 2))B/s"
[ $((($(date +%s%N) - began) / 1000000)) -ge 1500 ] || fail "--limit did not keep the pull back"
rm -rf "$here"
pull --limit 1kB/s >"$work/out" 2>"$work/err" &
pid=$!
until has_file "$here" "*.part"; do sleep 0.1; done
pkill -TERM -P $pid takt || kill $pid  # bash may have a process of its own for the function
wait $pid
got=$?
[ $got = 1 ] || fail "an interrupted pull ends with $got"
grep -q "interrupted; the same command goes on" "$work/err" || fail "interrupted: $(cat "$work/err")"
expect 0 "" pull
prints "MB on"
all_here "interrupted"

# A file that goes once the first one is asked for; files of the ring; what cannot be had.
mkdir -p "$work/vanishing/flight/frozen" "$work/fake"
for name in a b c; do cp "$frozen/$file" "$work/vanishing/flight/frozen/$name.mcap"; done
printf '#!/bin/sh\nrm -f "%s"\nexec /usr/bin/tail "$@"\n' "$work/vanishing/flight/frozen/b.mcap" >"$work/fake/tail"
chmod +x "$work/fake/tail"
PATH=$work/fake:$PATH expect 0 "" "$takt" log pull "robot:$work/vanishing" -o "$work/left" --ssh "$near"
prints "gone"
[ "$(ls "$work/left" | tr '\n' ' ')" = "a.mcap c.mcap " ] || fail "of a robot that removes b.mcap there is $(ls "$work/left")"
ring=$robot/$out/flight/ring
head -c 3000 "$(find "$ring" -name "*-000001.mcap")" >"$ring/open-000001.mcap"
expect 0 "" "$takt" log pull "robot:$out" --all -o "$work/ring" --ssh "$near"
prints "left out"
[ ! -e "$work/ring/open-000001.mcap" ] || fail "a file of the ring was fetched that is open"
rm "$ring/open-000001.mcap"
for file in "$ring"/*.mcap; do cmp "$file" "$work/ring/${file##*/}" || fail "of the ring: $file"; done
out=none expect 2 "has no folder ./none" pull
expect 2 "is no HOST:FOLDER" "$takt" log pull "$work" -o "$here"
expect 3 "apt-get install openssh-client" "$takt" log pull robot:out -o "$here" --ssh "$work/no-ssh"
expect 3 "robot cannot be reached (exit 255 of ssh" "$takt" log pull robot:out -o "$here" --ssh "sh -c 'exit 255'"
expect 2 "write 3B/s" pull --limit 3

# A run that is killed while it is served.
start_run killed "$work/graph.yaml" --for 0s --ring on
has_ring "$work/killed"
"$takt" log serve "$work/killed" >"$work/served.mcap" 2>"$work/served.err" &
server=$!
sleep 2.5
kill -9 $run
wait $run 2>/dev/null
wait $server || fail "serve of a killed run ends with $?"
grep -q "the run was killed" "$work/served.err" || fail "$(cat "$work/served.err")"
expect 0 "" "$takt" log info "$work/served.mcap"
prints "what was lost is not known"

# A reader that sleeps until the ring has gone on without it: two files are removed, as the ring does in its time.
start_run slow "$work/graph.yaml" --for 0s --ring on
ring=$work/slow/flight/ring
has_ring "$work/slow"
mkfifo "$work/pipe"
"$takt" log serve "$work/slow" >"$work/pipe" 2>"$work/served.err" &
server=$!
exec 3<"$work/pipe"
until [ -n "$(find "$ring" -name "*-000001.mcap" -size +150k)" ] || ! kill -0 $run; do sleep 0.1; done  # a pipe has 64 KB
for number in 2 3 4; do
  expect 0 "" "$takt" mark "part $number" --run $run
  until has_file "$ring" "*-00000$number.mcap" || ! kill -0 $run; do sleep 0.1; done
done
rm "$ring"/*-00000[23].mcap
cat <&3 >"$work/slow.mcap" &
reader=$!
exec 3<&-
said "a gap of" "$work/served.err"
expect 0 "" "$takt" stop --run $run
wait $run
wait $server
got=$?
[ $got = 1 ] || fail "serve with a gap ends with $got"
wait $reader
cat "$work/served.err"
grep -q "the run has ended: .*; gaps: 1" "$work/served.err" || fail "the gaps are not counted"
expect 0 "" "$takt" log info "$work/slow.mcap"
prints "2 files of the ring were gone before they were read"
expect 0 "" "$takt" log echo "$work/slow.mcap" base.odometry
finish
