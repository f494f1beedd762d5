# SPDX-License-Identifier: Apache-2.0
# Shared by the integration tests: expect EXIT 'TEXT ON STDERR' COMMAND...
takt=$1
source=$2
export TAKT_HOME=$source
export TAKT_RT_STRICT=1  # a job that allocates, blocks or writes ends its run: exit by a signal, with its name
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export XDG_RUNTIME_DIR=$work/runtime
mkdir "$XDG_RUNTIME_DIR"
export TAKT_STATE_DIR=$work/state  # never what this user has kept
failures=0

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

expect() {
  local code=$1 text=$2
  shift 2
  "$@" >"$work/stdout" 2>"$work/stderr"
  local got=$?
  echo "--- ${*##*/}"
  head -n 12 "$work/stderr"
  [ $got -eq "$code" ] || { tail -n 20 "$work/stdout" "$work/stderr"; fail "exit $got instead of $code: $*"; }
  [ -z "$text" ] || grep -qF -- "$text" "$work/stderr" || fail "stderr lacks '$text': $*"
}

# prints TEXT: the last command did, on stdout.
prints() { grep -qF -- "$1" "$work/stdout" || { cat "$work/stdout"; fail "stdout lacks '$1'"; }; }

# tells EXIT TEXT COMMAND...: as expect, with what it prints on stdout.
tells() {
  local code=$1 text=$2
  shift 2
  expect "$code" "$text" bash -c '"$@" >&2' takt "$@"
}

# figure KEY: the first one of that name in the JSON of the last command; those of variants and baseline come later.
figure() { sed -n "s/^ *\"$1\": \([-0-9.e]*\),*$/\1/p" "$work/stdout" | head -n 1; }
at_most() { awk "BEGIN {exit !($(figure "$1") <= $2)}" || fail "$1 is $(figure "$1"), more than $2"; }
at_least() { awk "BEGIN {exit !($(figure "$1") >= $2)}" || fail "$1 is $(figure "$1"), less than $2"; }

# recordings FOLDER: $recordings is that folder of $data, the folder of recordings; without $data the test is skipped.
recordings() {
  data=${TAKT_DATA:-$source/../shared/data}
  [ -d "$data" ] || { echo "NOT RUN: the folder of recordings $data is missing; set TAKT_DATA to it"; exit 77; }
  recordings=$data/$1
  [ -d "$recordings" ] || { echo "FAILED: $recordings is missing (TAKT_DATA names the folder of recordings)"; exit 1; }
}

# beside NAME COMMAND... : in the background, its process in $!, what it says in NAME.out and NAME.err of $work. What an
# earlier one of that name said is gone before this returns: nobody waits for a word and reads the one of before.
beside() {
  : >"$work/$1.out"
  : >"$work/$1.err"
  "${@:2}" >"$work/$1.out" 2>"$work/$1.err" &
}

# start_run NAME OPTIONS... : in the background, its process in $run; returns once it can be attached to. However long
# that takes: under a sanitizer it is many seconds. Under $policy; empty: that of the schedule, where the kernel grants it.
policy=cooperative
start_run() {
  local name=$1
  shift
  beside "$name" "$takt" run ${policy:+--policy "$policy"} --output "$work/$name" "$@"
  run=$!
  attachable $run "$name"
}

# attachable PID NAME: waits until that run or replay can be asked.
attachable() {
  while kill -0 $1 2>/dev/null; do
    "$takt" top --once --run $1 >"$work/top" 2>/dev/null && return
    sleep 0.1
  done
  cat "$work/$2.err"
  fail "$2 ended before it could be attached to"
}

# The process NAME of the run. Over iceoryx there is a keeper in front of the supervisor.
member() { pgrep -x "$1" -P "$run$(pgrep -P $run | sed 's/^/,/' | tr -d '\n')"; }

# said TEXT FILE [TIMES]: waits until the text stands there so often.
said() {
  for ((i = 0; i < 600; ++i)); do
    [ "$(grep -cF -- "$1" "$2")" -ge "${3:-1}" ] && return
    sleep 0.1
  done
  cat "$2"
  fail "${2##*/} never said '$1'"
}

# end_run CODES: the run $run, started as $name, ends as it is told to, with one of these.
end_run() {
  expect 0 "" "$takt" stop --run $run
  wait $run
  local got=$?
  [[ " $* " == *" $got "* ]] || { tail -n 30 "$work/$name.out"; fail "run $name: exit $got instead of $*"; }
}

# not_run WHY: ends the test as one that was skipped, unless something has failed already.
not_run() {
  echo "NOT RUN: $1"
  [ $failures -eq 0 ] && exit 77
  exit 1
}

# two_machines NETWORK ['COMMAND']: network namespaces $one and $two with a cable between them, NETWORK.1 and NETWORK.2; the end of the
# cable is named `cable` in both. The command is carried out at the end, before they are gone. As root; otherwise the test is skipped.
two_machines() {
  command -v ip >/dev/null || not_run "ip is missing (iproute2)"
  one=takt-one-$$ two=takt-two-$$
  ip netns add $one 2>/dev/null && ip netns add $two && ip -n $one link add cable type veth peer name cable netns $two ||
    not_run "no right to make network namespaces"
  # shellcheck disable=SC2064
  trap "${2:-:}; ip netns del $one; ip netns del $two; rm -rf '$work'" EXIT
  local space host=0
  for space in $one $two; do
    ip -n "$space" addr add "$1.$((host += 1))/24" dev cable
    ip -n "$space" link set cable up
    ip -n "$space" link set lo up
  done
}

finish() {
  [ $failures -eq 0 ] && echo "all passed"
  exit $((failures > 0))
}
