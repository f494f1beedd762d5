# SPDX-License-Identifier: Apache-2.0
# SIGTERM, SIGINT and SIGHUP to each process of a run and to all at once, once or twice in a row, at random instants:
# every process ends in order. The run tells its summary, nodes finish() (here they write pictures), the report is
# whole, nobody was killed, and nothing is left. What is only meant for a member or a nursery changes nothing.
#   TAKT_SIGNALS=50 signals.sh TAKT SOURCE     so many signals (default: 12); TAKT_SEED=N repeats a failure
source "$(dirname "$0")/lib.sh" "$@"
signals=${TAKT_SIGNALS:-12}
RANDOM=${TAKT_SEED:=$((16#$(od -An -N2 -tx2 /dev/urandom | tr -d ' ')))}
echo "TAKT_SIGNALS=$signals TAKT_SEED=$TAKT_SEED"

cat >"$work/graph.yaml" <<YAML
takt: 1
name: signals
schedule: schedule.yaml
isolation: subsystem
default_profile: sim
devices:
  floor_laser: {kind: laser_scanner, model: lms400, rate: 15, mount: {x: 0.0m, y: 0.25m, z: 1.0m, pitch: -34deg},
                beams: 281, fov: 70deg, range: 3m, noise: 4mm}
  base: {kind: mobile_base, rate: 15}
profiles:
  sim: {default: {driver: sim, world: $source/graph/worlds/lab.xml}}
subsystems:
  mapping:
    exports: [traversability.traversability]
    traversability:
      type: traversability
      in: {scan: {from: floor_laser.scan, depth: 4, max_age: 300ms}, odometry: {from: base.odometry, depth: 16, max_age: 300ms}}
    near: {type: picture, in: {traversability: traversability.traversability}, params: {directory: near}}
  keeping:
    far: {type: picture, in: {traversability: traversability.traversability}, params: {directory: far}}
YAML
cat >"$work/schedule.yaml" <<'YAML'
takt: 1
name: signals
policy: cooperative
nodes:
  floor_laser: {rate: 15, budget: 2ms, deadline: 66ms}
  base: {rate: 15, budget: 1ms, deadline: 66ms}
  traversability: {rate: 15, budget: 5ms, deadline: 66ms, criticality: high}
  near: {rate: 5, budget: 5ms, deadline: 200ms}
  far: {rate: 5, budget: 5ms, deadline: 200ms}
YAML

children() { pgrep -P "$1" -d ' '; }
# Of everything that belongs to the run; over iceoryx there is a keeper before the supervisor.
supervisor() { [ $transport = iceoryx ] && pgrep -P $run | head -n 1 || echo $run; }
everybody() { echo $run $(for p in $(children $run); do echo $p $(children $p); done); }
named() { pgrep -x "$1" -P "$(supervisor)" | head -n 1; }
targets_of() { # WHO: process ids
  case $1 in
    group) everybody ;;
    keeper) echo $run ;;
    supervisor) supervisor ;;
    member) named "$(shuf -e -n 1 --random-source=<(yes $RANDOM) devices mapping keeping)" ;;
    nursery) named takt-nursery ;;
  esac
}

send() { # SIGNAL TIMES PIDS...: to all at once, as a service manager does
  local signal=$1 times=$2
  shift 2
  for ((k = 0; k < times; ++k)); do kill -s "$signal" "$@" 2>/dev/null; done
}

whole() { # CODE: everything that an end in order leaves
  local code=$1
  [ -s "$work/report.json" ] || { fail "$round: no report"; return; }
  grep -q "signals on signals" "$work/run.out" || fail "$round: no summary"
  grep -qE "was ended by signal|is started again|did not end|outage" "$work/run.err" "$work/report.json" &&
    { grep -hE "was ended by|started again|did not end" "$work/run.err"; fail "$round: a process did not end in order"; }
  local ok
  ok=$(sed -n 's/^  "ok": \([a-z]*\),*$/\1/p' "$work/report.json")
  [ "$ok:$code" = true:0 ] || [ "$ok:$code" = false:1 ] || fail "$round: exit $code, but ok is $ok"
  local pictures
  pictures=$(find "$work/out" -name traversability.png | wc -l)
  [ "$pictures" -eq 2 ] || fail "$round: $pictures of 2 nodes finished"
}

signal_round() { # TRANSPORT WHO SIGNAL TIMES DELAY_MS
  transport=$1
  local who=$2 signal=$3 times=$4 delay_ms=$5 before=$failures
  round="$times x SIG$signal to $who after $delay_ms ms ($transport)"
  rm -rf "$work/out" "$work/report.json"
  env --default-signal=HUP "$takt" run "$work/graph.yaml" --for 0s --transport $transport --output "$work/out" --report "$work/report.json" \
    >"$work/run.out" 2>"$work/run.err" &
  run=$!
  local begun=
  for ((i = 0; i < 600; ++i)); do
    "$takt" top --once --run $run >/dev/null 2>&1 && { begun=yes; break; }
    kill -0 $run 2>/dev/null || break
    sleep 0.05
  done
  [ -n "$begun" ] || { cat "$work/run.err"; fail "$round: the run did not begin"; return; }
  sleep 1  # until every node has something to finish
  sleep "$((delay_ms / 1000)).$(printf %03d $((delay_ms % 1000)))"
  local all
  all=$(everybody)
  send "$signal" "$times" $(targets_of "$who")
  case $who in
    member | nursery)
      sleep 0.3
      [ "$all" = "$(everybody)" ] || fail "$round: a process has gone"
      send TERM 1 $run
      ;;
  esac
  wait $run
  whole $?
  for pid in $all; do kill -0 $pid 2>/dev/null && fail "$round: process $pid is left"; done
  echo "$round: $([ $failures -eq $before ] && echo "in order" || echo "NOT in order")"
}

# SIGHUP ends a run unless it was started with nohup, as this script may be.
# A signal that comes while the run is prepared: nothing has begun, and that is what is told.
for delay in 0.05 0.2 0.4; do
  transport=local round="SIGTERM to all while the run is prepared"
  rm -rf "$work/report.json"
  env --default-signal=HUP "$takt" run "$work/graph.yaml" --for 0s --output "$work/out" --report "$work/report.json" >"$work/run.out" 2>"$work/run.err" &
  run=$!
  sleep $delay
  send TERM 2 $(everybody)
  wait $run
  code=$?
  # 143: before it could listen. A report: it had begun already.
  [ $code -eq 143 ] || [ -s "$work/report.json" ] || { [ $code -eq 0 ] && grep -q "stopped before the run began" "$work/run.err"; } ||
    { cat "$work/run.err"; fail "$round: exit $code after $delay s"; }
done

locally=(group supervisor member nursery)
over_iceoryx=(group keeper supervisor member)
kinds=(TERM INT HUP)
for ((n = 0; n < signals; ++n)); do
  # Every fourth one over iceoryx, which takes longer to come up; every kind comes round.
  if ((n % 4 == 3)); then transport=iceoryx who=${over_iceoryx[n / 4 % 4]}; else transport=local who=${locally[(n - n / 4) % 4]}; fi
  signal_round $transport $who ${kinds[n % 3]} $((1 + RANDOM % 2)) $((RANDOM % 700))
done
finish
