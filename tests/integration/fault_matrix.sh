# SPDX-License-Identifier: Apache-2.0
# Shared by the tests of fault scenarios, after lib.sh: run_matrix LEAST FILE... runs each as its first line says and prints
# what it expected and what was observed. A scenario fails if anything is unmet, but for wrong_expectation, which must be;
# the matrix if it has less than LEAST.
cd "$source"

run_matrix() {
  local least=$1 file name wanted got arguments scenarios=0
  shift
  for file in "$@"; do
    name=$(basename "$file" .yaml)
    arguments=$(sed -n '1s/^# run: //p' "$file")
    wanted=0
    [ "$name" = wrong_expectation ] && wanted=1
    # shellcheck disable=SC2086  # the arguments are words
    "$takt" run ${arguments//RECORD/$work/record.mcap} --faults "$file" --output "$work/out" --report "$work/$name.json" \
      >"$work/$name.out" 2>"$work/$name.err"
    got=$?
    scenarios=$((scenarios + 1))
    sed -n '/^scenario /,/^scenario met\|^SCENARIO NOT MET/p' "$work/$name.out"
    [ $got -eq $wanted ] || { cat "$work/$name.err"; fail "$name: exit $got instead of $wanted"; }
  done
  echo "$scenarios scenarios"
  [ $scenarios -ge "$least" ] || fail "only $scenarios scenarios were found"
}
