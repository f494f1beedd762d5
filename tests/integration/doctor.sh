# SPDX-License-Identifier: Apache-2.0
# `takt doctor`, --require-rt and `takt profile` as a user starts them, with and without privileges. What the machine
# grants is not judged: only that each command says what it found, and that all of them say the same.
source "$(dirname "$0")/lib.sh" "$@"
command -v python3 >/dev/null || { echo "NOT RUN: needs python3"; exit 0; }

# A copy that another user may run: the build can stand in a folder that is closed to others.
open=$(mktemp -d)
trap 'rm -rf "$work" "$open"' EXIT
chmod 755 "$open"
cp "$takt" "$open/takt"
cp -r "$source/graph" "$source/schedules" "$open/"
as_nobody() { # COMMAND...
  (cd "$open/home" && setpriv --reuid=65534 --regid=65534 --clear-groups env HOME="$open/home" TAKT_HOME="$open" TAKT_MACHINE= XDG_CACHE_HOME= "$@")
}

narrow() { awk 'length > 80 {print "too wide: " $0; bad = 1} END {exit bad}' "$1" || fail "$1 is wider than 80 columns"; }

check_findings() { # JSON: every check has a status, a value and a meaning; a lack has a fix
  python3 - "$1" <<'PY' || fail "findings of $1"
import json, sys
report = json.load(open(sys.argv[1]))
wanted = {"sched_deadline", "deadline_bandwidth", "sched_fifo", "rt_runtime", "cgroup_rt", "fair_server", "mlockall", "dev_shm", "swap", "tick",
          "transparent_hugepage", "cpu_dma_latency", "timer_slack", "preemption", "clocksource", "governor", "cpusets",
          "irq_affinity", "host_stall", "iceoryx", "rights", "watchdog", "cuda"}
assert {c["name"] for c in report["checks"]} == wanted, wanted ^ {c["name"] for c in report["checks"]}
for check in report["checks"]:
    assert check["status"] in ("ok", "warn", "lacks", "unknown") and check["found"] and check["meaning"], check
    assert check["status"] != "lacks" or check["fixes"], check
PY
}

lacking() { # JSON: what a run under `deadline` would be refused for
  python3 -c '
import json, sys
needs = ("sched_deadline", "mlockall", "cpu_dma_latency", "timer_slack")
print(*(c["name"] for c in json.load(open(sys.argv[1]))["checks"] if c["status"] == "lacks" and c["name"] in needs))' "$1"
}

require_rt() { # JSON RUNNER...: refused for exactly what doctor says is lacking
  local missing
  missing=$(lacking "$1")
  shift
  runs=$((${runs:-0} + 1))  # each with a folder of its own: they are of different users
  "$@" run --require-rt --policy deadline --for 1s --isolate none --output "$open/home/out$runs" >"$work/stdout" 2>"$work/stderr"
  local code=$?
  if [ -z "$missing" ]; then
    [ $code -le 1 ] || [ $code -eq 3 ] || fail "--require-rt: exit $code"  # 3: the kernel may refuse all budgets together
    grep -q "this machine lacks" "$work/stderr" && fail "--require-rt refuses what doctor finds well"
    return
  fi
  [ $code -eq 3 ] || fail "--require-rt: exit $code although $missing is lacking"
  for name in $missing; do grep -q "lacks   $name:" "$work/stderr" || fail "--require-rt does not name $name"; done
  grep -q "fix, " "$work/stderr" || fail "--require-rt tells no fix"
}

mkdir "$open/home" && chmod 777 "$open/home"
expect 0 "" "$takt" doctor
narrow "$work/stdout"
expect 0 "" "$takt" doctor --json
cp "$work/stdout" "$work/doctor.json"
check_findings "$work/doctor.json"
require_rt "$work/doctor.json" "$takt"

check_measured() { # FILE: the keys that `takt check` reads, each a number or absent
  python3 - "$1" <<'PY' || fail "figures in $1"
import json, sys
figures = json.load(open(sys.argv[1]))
print({key: value for key, value in figures.items() if key != "details"})
assert set(figures["machine"]) == {"cpu", "cores", "kernel"} and figures["measured_at"].endswith("Z")
for key in ("release_us", "switch_us", "publish_us", "take_us", "per_mb_us", "enforcement_us", "tick_us", "deadline_bandwidth"):
    assert key not in figures or figures[key] >= 0, key
for key in ("release_us", "switch_us", "publish_us", "take_us", "tick_us"):  # these need no right
    assert key in figures, key
spread = figures["details"]["release_us"]
assert spread["samples"] >= 100 and spread["p50"] <= spread["p99"] <= spread["max"], spread
PY
}
if as_nobody true 2>/dev/null; then  # next to ours: what is found is not judged, and most of it is waiting
  as_nobody "$open/takt" doctor --measure --json >"$work/nobody_measured" 2>&1 &
  nobody=$!
fi
expect 0 "measuring" env TAKT_MACHINE="$work/deep/machine.json" "$takt" doctor --measure
narrow "$work/stdout"
check_measured "$work/deep/machine.json"
expect 3 "set TAKT_MACHINE" env TAKT_MACHINE=/proc/none/machine.json "$takt" doctor --measure

if [ -n "${nobody:-}" ]; then
  wait "$nobody" && grep -q measuring "$work/nobody_measured" || { cat "$work/nobody_measured"; fail "nobody cannot measure"; }
  expect 0 "" as_nobody "$open/takt" doctor
  narrow "$work/stdout"
  grep -q "lacks   sched_deadline: refused: Operation not permitted" "$work/stdout" || fail "nobody has SCHED_DEADLINE"
  grep -q "setcap cap_sys_nice,cap_ipc_lock+ep" "$work/stdout" && grep -q "chmod 0750" "$work/stdout" || fail "no fix for nobody"
  expect 0 "" as_nobody "$open/takt" doctor --json
  cp "$work/stdout" "$work/nobody.json"
  check_findings "$work/nobody.json"
  as_nobody_takt() { as_nobody "$open/takt" "$@"; }
  require_rt "$work/nobody.json" as_nobody_takt
  check_measured "$open/home/.cache/takt/machine.json"
else
  echo "NOT RUN: doctor without privileges; run as root with setpriv"
fi

# A profile of the simulated robot into a copy of its schedule: budgets and nothing else change.
schedule=$open/schedules/thesis.yaml
profile() { expect "$1" "$2" env TAKT_HOME="$open" "$takt" profile "$open/graph/ace.yaml" --for 3s "${@:3}"; }
profile 0 "each job alone" --write "$open/written.yaml"
narrow "$work/stdout"
grep -q "stereo " "$work/stdout" || fail "the profile does not show stereo"
cmp -s "$schedule" "$source/schedules/thesis.yaml" || fail "--write changed the schedule"
without_budgets() { sed '/^measured:/,$d; s/budget: [^,}]*/budget: X/' "$1"; }
diff <(without_budgets "$schedule") <(without_budgets "$open/written.yaml") || fail "more than budgets changed"
grep -q "^  nodes:$" "$open/written.yaml" || fail "no block measured"
env TAKT_HOME="$open" "$takt" check "$open/graph/ace.yaml" --schedule "$open/written.yaml" >"$work/stdout" 2>"$work/stderr"
[ $? -le 1 ] || { cat "$work/stderr"; fail "the written schedule cannot be read"; }
profile 0 "" --write "$open/kept.yaml" --keep-budgets
diff <(sed '/^measured:/,$d' "$open/kept.yaml") "$schedule" || fail "--keep-budgets changed a budget"
grep -q "^  nodes:$" "$open/kept.yaml" || fail "--keep-budgets: no block measured"
# Which node has become slower is a matter of unit tests; here stands nothing that a job could exceed, then what none can meet.
sed -E 's/exec: [0-9.]*ms/exec: 9000ms/; s/budget: [^,}]*, deadline: ([^,}]*)/budget: \1, deadline: \1/' "$open/kept.yaml" >"$open/written.yaml"
profile 0 "" --policy cooperative --compare "$open/written.yaml"
sed -i 's/exec: [0-9.]*ms/exec: 0.001ms/' "$open/written.yaml"
profile 1 "" --compare "$open/written.yaml"
grep -q "ABOVE stored" "$work/stdout" || fail "drift is not told"
cp "$open/written.yaml" "$schedule"
profile 0 "" --in-place
[ "$(grep -c '^measured:' "$schedule")" -eq 1 ] || fail "the block is there twice"
grep -q "exec: 0.001ms" "$schedule" && fail "the block was not replaced"

expect 2 "excludes" "$takt" profile --in-place --write "$work/x.yaml"
expect 2 "--tolerance" "$takt" profile --compare "$schedule" --tolerance much
expect 2 "needs an end" "$takt" profile --for 0s
expect 2 "none.yaml" "$takt" profile "$work/none.yaml"
expect 2 "--compare" "$takt" profile --compare "$schedule" --schedule "$schedule"
finish
