# SPDX-License-Identifier: Apache-2.0
# Shared by the integration tests: expect EXIT 'TEXT ON STDERR' COMMAND...
takt=$1
source=$2
export TAKT_HOME=$source
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
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
  [ $got -eq "$code" ] || fail "exit $got instead of $code: $*"
  [ -z "$text" ] || grep -qF -- "$text" "$work/stderr" || fail "stderr lacks '$text': $*"
}

finish() {
  [ $failures -eq 0 ] && echo "all passed"
  exit $((failures > 0))
}
