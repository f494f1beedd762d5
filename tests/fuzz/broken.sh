#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# broken.sh PROGRAM: whether a replay names each input that breaks its target, goes on behind it, and refuses to run none.
set -u
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/some" "$work/none"
for input in 1:fine 2:trap 3:fine 4:exit 5:fine; do printf %s "${input#*:}" >"$work/some/${input%:*}"; done
printf fine >"$work/fine"

expect() { # CODE TEXT PATH...
  local code=$1 text=$2
  shift 2
  "$program" "$@" >"$work/said" 2>&1
  local got=$?
  cat "$work/said"
  [ $got -eq "$code" ] && grep -qF -- "$text" "$work/said" && return
  echo "FAILED: exit $got instead of $code, or '$text' is missing: $*"
  failed=1
}
program=$1 failed=0
expect 0 "1 inputs, 0 broke the target" "$work/fine"
expect 1 "FAILED: $work/some/2: Illegal instruction" "$work/fine" "$work/some"
expect 1 "FAILED: $work/some/4: exit 0" "$work/some"
expect 1 "6 inputs, 2 broke the target" "$work/fine" "$work/some"
expect 2 "there is no input" "$work/some" "$work/none"
expect 2 "there is no input" "$work/missing"
expect 2 "name files or folders"
exit $failed
