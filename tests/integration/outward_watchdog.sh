#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What a service manager hears of a run: a datagram socket stands for systemd's.
. "$(dirname "$0")/lib.sh"

cat >"$work/graph.yaml" <<'YAML'
takt: 1
name: guarded
schedule: schedule.yaml
subsystems:
  work:
    load: {type: load, params: {work: 2ms}}
YAML
cat >"$work/schedule.yaml" <<'YAML'
takt: 1
name: guarded
policy: cooperative
nodes:
  load: {rate: 5, budget: 20ms, deadline: 150ms, criticality: high}
YAML

listen() { # NAME: writes "SECONDS TEXT" for each notification, until it is killed
  python3 - "$work/notify" "$work/$1.heard" <<'PY' &
import socket, sys, time
listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
listener.bind(sys.argv[1])
with open(sys.argv[2], "w", buffering=1) as out:
    while True:
        text = listener.recv(4096).decode()
        print(f"{time.monotonic():.3f} {text}", file=out)
PY
  listener=$!
  until [ -S "$work/notify" ]; do sleep 0.05; done
}
hush() { # All that was sent has been written: the socket holds nothing any more.
  sleep 0.3
  kill $listener
  wait $listener 2>/dev/null
  rm -f "$work/notify"
}
count() { grep -c " $2" "$work/$1.heard"; }

# All is well: ready once, fed twice a timeout, told at the end. Without a socket nothing of it happens.
listen good
NOTIFY_SOCKET=$work/notify WATCHDOG_USEC=2000000 timeout 60 "$takt" run "$work/graph.yaml" --isolate none --for 5s --output "$work/out" \
  >"$work/good.out" 2>"$work/good.err" || { cat "$work/good.out" "$work/good.err"; fail "the good run is not ok"; }
hush
cat "$work/good.heard"
[ "$(count good READY=1)" -eq 1 ] || fail "not ready, or twice"
[ "$(count good STOPPING=1)" -eq 1 ] || fail "the end is not told"
[ "$(tail -n 1 "$work/good.heard" | cut -d' ' -f2)" = STOPPING=1 ] || fail "something is told after the end"
[ "$(count good WATCHDOG=1)" -ge 5 ] && [ "$(count good WATCHDOG=1)" -le 7 ] || fail "not fed each second"
grep -q "STATUS=mode full" "$work/good.heard" || fail "no status"
awk '/WATCHDOG=1/ { if (last && $1 - last > 1.5) exit 1; last = $1 }' "$work/good.heard" || fail "too long without a feed"
expect 0 "" timeout 60 "$takt" run "$work/graph.yaml" --isolate none --for 1s --output "$work/out"

# A trace that takes three seconds to be written, since nobody reads it before: the last judgement counts until the end.
for isolation in none subsystem; do
  listen late
  rm -f "$work/read"
  exec 9> >(python3 -c 'import fcntl; fcntl.fcntl(0, 1031, 4096)'; until [ -e "$work/read" ]; do sleep 0.1; done; cat >/dev/null)  # F_SETPIPE_SZ
  NOTIFY_SOCKET=$work/notify WATCHDOG_USEC=1000000 timeout 60 "$takt" run "$work/graph.yaml" --isolate $isolation --for 3s --output "$work/out" \
    --trace /dev/fd/9 >"$work/late.out" 2>"$work/late.err" &
  run=$!
  until grep -q READY=1 "$work/late.heard" || ! kill -0 $run 2>/dev/null; do sleep 0.05; done
  sleep 6
  grep -q STOPPING=1 "$work/late.heard" && fail "isolation $isolation: the end is told before it is there"
  touch "$work/read"
  wait $run || { cat "$work/late.err"; fail "isolation $isolation: the run with a slow trace is not ok"; }
  exec 9>&-
  hush
  [ "$(count late WATCHDOG=1)" -ge 8 ] || { cat "$work/late.heard"; fail "isolation $isolation: not fed while the trace is written"; }
  [ "$(count late STOPPING=1)" -eq 1 ] || fail "isolation $isolation: the end is not told"
done

# Over iceoryx the process that was started only keeps the one that speaks: what is meant for it is meant for that one.
over_iceoryx() { # NAME WHOM: as the service manager starts it, which means the process WHOM ($$: that one)
  listen $1
  NOTIFY_SOCKET=$work/notify WATCHDOG_USEC=1000000 timeout 60 bash -c "WATCHDOG_PID=$2"' exec "$0" "$@"' "$takt" run "$work/graph.yaml" \
    --isolate subsystem --transport iceoryx --for 3s --output "$work/out" >"$work/$1.out" 2>"$work/$1.err" ||
    { cat "$work/$1.err"; fail "the run $1 is not ok"; }
  hush
  [ "$(count $1 READY=1)" -eq 1 ] && [ "$(count $1 STOPPING=1)" -eq 1 ] || { cat "$work/$1.heard"; fail "$1: not ready, or no end"; }
}
over_iceoryx kept '$$'
[ "$(count kept WATCHDOG=1)" -ge 5 ] || { cat "$work/kept.heard"; fail "not fed over iceoryx"; }
over_iceoryx another 1
[ "$(count another WATCHDOG=1)" -eq 0 ] || fail "fed although another process is to feed"

# A high-criticality node that begins to miss its deadlines: no feed any more, although the run goes on.
listen bad
export NOTIFY_SOCKET=$work/notify WATCHDOG_USEC=1000000
start_run bad "$work/graph.yaml" --isolate none --for 0s
unset NOTIFY_SOCKET WATCHDOG_USEC
sleep 2
expect 0 "" "$takt" set --run $run load.work 180ms
sleep 1.5  # a job of 180 ms misses its deadline of 150 within 0.4 s, and the feed that was due by then is over
fed=$(count bad WATCHDOG=1)
[ "$fed" -ge 3 ] || fail "fed $fed times only while all was well"
sleep 2
[ "$(count bad WATCHDOG=1)" -eq "$fed" ] || fail "fed although a high-criticality node misses its deadlines"
grep -q "STATUS=mode full; not fed: load missed a deadline" "$work/bad.heard" || fail "the status does not say why"
expect 0 "" "$takt" stop --run $run
wait $run
hush
cat "$work/bad.heard"

# A watchdog device: what cannot be opened, what is none, and virtual time.
expect 3 "watchdog $work/none: cannot be opened: No such file or directory; fix: " \
  "$takt" run "$work/graph.yaml" --isolate none --for 1s --output "$work/out" --watchdog "$work/none"
touch "$work/file"
expect 3 "takes no timeout: Inappropriate ioctl for device; fix: name a watchdog device" \
  "$takt" run "$work/graph.yaml" --isolate none --for 1s --output "$work/out" --watchdog "$work/file"
expect 2 "--watchdog $work/none: systemd watches this run (WatchdogSec=); leave --watchdog out" \
  env NOTIFY_SOCKET="$work/notify" WATCHDOG_USEC=1000000 "$takt" run "$work/graph.yaml" --for 1s --output "$work/out" --watchdog "$work/none"
expect 2 "--watchdog: a run in virtual time" "$takt" run "$work/graph.yaml" --clock virtual --for 1s --output "$work/out" --watchdog "$work/none"
finish
