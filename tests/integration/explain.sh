# SPDX-License-Identifier: Apache-2.0
# `takt explain` on causes that were injected: 5 ms over the budget, 9 ms of preemption by a named node, a release 3 ms late
# behind another. Each must be named, its figure as the jobs' own clocks have it (told_causes.py), and the figures of every
# sentence must add up to its miss. What else happens on this machine (host stalls) is told as parts of its own.
source "$(dirname "$0")/lib.sh" "$@"
unset TAKT_RT_STRICT  # one node sleeps in its jobs, which is to be explained

cat >"$work/injected.yaml" <<'EOF'
takt: 1
name: injected
schedule: schedule.yaml
subsystems:
  work:
    long_one: {type: load, params: {work: 5ms, extra: 5ms, every: 2}}
    victim: {type: load, params: {work: 6ms}}
    culprit: {type: load, params: {work: 9ms}}
    late_one: {type: load, params: {work: 5ms}}
    blocker: {type: load, params: {work: 3ms}}
    sleeper: {type: load, params: {work: 1ms, sleep: 4ms}}
profiles:
  sim: {}
EOF
core=$(taskset -pc $$ | sed 's/.*[ ,-]//')  # the last CPU we may use
cat >"$work/schedule.yaml" <<EOF
takt: 1
name: injected
policy: fixed
cores: [$core]
nodes:
  long_one: {rate: 2, budget: 5ms, deadline: 7ms, criticality: high}
  victim: {rate: 2, offset: 100ms, budget: 7ms, deadline: 10ms}
  culprit: {rate: 2, offset: 103ms, budget: 10ms, deadline: 9.5ms}
  late_one: {rate: 2, offset: 200ms, budget: 6ms, deadline: 6ms}
  blocker: {rate: 2, offset: 200ms, budget: 4ms, deadline: 4ms}
  sleeper: {rate: 2, offset: 300ms, budget: 2ms, deadline: 3ms}
EOF

# Every sentence of $work/stdout: the figures after the colon make up the miss, `less` counted off, to 5 % and what
# rounding each of them to its last digit can make.
adds_up() {
  awk 'function rounding(figure) { return 0.5 / 10 ^ (length(figure) - index(figure, ".")) }
    / missed job / {
    miss = $0; sub(/^[^:]* by /, "", miss); sub(/ .*/, "", miss)
    text = $0; sub(/^[^:]*: /, "", text); sub(/ \((switches|no source).*/, "", text)
    n = split(text, parts, ", "); sum = 0; allowed = 0.05 * miss + rounding(miss)
    for (i = 1; i <= n; i++) {
      match(parts[i], /[0-9]+\.[0-9]+/); v = substr(parts[i], RSTART, RLENGTH)
      sum += parts[i] ~ /^less/ ? -v : v; allowed += rounding(v)
    }
    if (sum - miss > allowed || miss - sum > allowed) { print "parts make " sum ": " $0; bad = 1 }
    lines++ } END { exit bad || !lines }' "$work/stdout" || fail "figures that do not add up"
}

# told TRACE CAUSE...: each of them by its figure.
told() { python3 "$source/tests/integration/told_causes.py" "$1" "$work/stdout" "$core" "${@:2}" || fail "causes in ${1##*/}"; }

# forget_switches TRACE: as if there had been no source of switches.
forget_switches() {
  python3 -c 'import json, sys
trace = json.load(open(sys.argv[1]))
trace["traceEvents"] = [e for e in trace["traceEvents"] if e.get("cat") != "cpu"]
trace["otherData"]["source_of_preemption"] = "none"
json.dump(trace, sys.stdout)' "$1"
}

run() { "$takt" run "$work/injected.yaml" --unchecked --output "$work/out" "$@" >"$work/run.stdout" 2>"$work/run.stderr"; }

if run --for 8s --isolate none --trace "$work/t.json" --report "$work/r.json" --require-rt || [ $? -eq 1 ]; then
  expect 0 "" "$takt" explain "$work/t.json"
  adds_up
  told "$work/t.json" over asleep preempted
  if grep -q "switches from tracefs" "$work/stdout"; then
    told "$work/t.json" behind
  else
    told "$work/t.json" late
    echo "NOT RUN: behind whom a job was late needs tracefs: $(grep note: "$work/stdout")"
  fi
  grep -q '"preempted\|"asleep' "$work/t.json" || fail "the trace holds no switches"
  expect 0 "" "$takt" explain "$work/t.json" victim --svg "$work/victim.svg"
  grep -q "^late_one" "$work/stdout" && fail "another node was explained"
  grep -q "victim job" "$work/victim.svg" || fail "no picture of the victim"
  expect 0 "" "$takt" explain "$work/r.json"
  grep -q "victim missed .* no cause is attributed" "$work/stdout" || fail "the report says too little, or too much"

  # Two processes: the same causes through rings that they share. Less privilege: nobody is named.
  if run --for 3s --isolate subsystem --trace "$work/t2.json" --require-rt || [ $? -eq 1 ]; then
    expect 0 "" "$takt" explain "$work/t2.json"
    adds_up
    told "$work/t2.json" over
  else
    fail "in processes of their own: $(tail -n 1 "$work/run.stderr")"
  fi
  run --for 3s --isolate none --trace "$work/t3.json" --trace-source perf
  expect 0 "" "$takt" explain "$work/t3.json"
  adds_up
  if grep -q "switches from perf" "$work/stdout"; then
    told "$work/t3.json" preempted
    # The same jobs without the switches: all of it is unattributed.
    forget_switches "$work/t3.json" >"$work/forgotten.json"
    expect 0 "" "$takt" explain "$work/forgotten.json" victim
    adds_up
    told "$work/forgotten.json" unattributed
  else
    echo "NOT RUN: the same from perf: $(grep note: "$work/stdout")"
  fi
  run --for 3s --isolate none --trace "$work/t4.json" --trace-source none
  expect 0 "" "$takt" explain "$work/t4.json" victim
  adds_up
  grep -q preempted "$work/stdout" && fail "somebody is named whom nobody saw: $(cat "$work/stdout")"
  told "$work/t4.json" unattributed
elif grep -q -- "--require-rt" "$work/run.stderr"; then
  echo "NOT RUN: injected causes need SCHED_FIFO and locked memory; run as root"
else
  fail "the run with injected causes: $(tail -n 3 "$work/run.stderr")"
fi

# In virtual time everything is known exactly.
run --clock virtual --for 1s --trace "$work/v.json"
expect 0 "" "$takt" explain "$work/v.json" victim
grep -q "^victim missed job 0 by 7.00 ms: preempted 10.00 by culprit on cpu $core, less 3.00 of slack (switches as sim" \
  "$work/stdout" || fail "what was simulated is not what is told: $(cat "$work/stdout")"
expect 0 "" "$takt" explain "$work/v.json" culprit
grep -q "^culprit missed job 0 by 0.500 ms: 0.500 of its budget beyond its deadline (switches as sim" "$work/stdout" ||
  fail "a budget above its deadline is not told: $(cat "$work/stdout")"
expect 0 "" "$takt" explain "$work/v.json" blocker
grep -q "no job of blocker missed" "$work/stdout" || fail "a job that was in time is said to have missed"
expect 2 "valid are: long_one" "$takt" explain "$work/v.json" nobody
expect 2 "cannot be read" "$takt" explain "$work/none.json"
expect 2 "is no trace" "$takt" explain "$source/README.md"
head -c 2000 "$work/v.json" >"$work/cut.json"
expect 2 "is no trace" "$takt" explain "$work/cut.json"
expect 2 "choose another place" "$takt" run "$work/injected.yaml" --trace "$work/none/t.json"
finish
