# SPDX-License-Identifier: Apache-2.0
# Faults of the main graph in real time, one process for each subsystem, under the policy of its schedule where the kernel
# grants it: tests/faults/real_ace_*. The guard misses nothing, and everybody is back within two seconds.
source "$(dirname "$0")/lib.sh" "$@"
cd "$source"

scenarios=0
for file in tests/faults/real_ace_*.yaml; do
  name=$(basename "$file" .yaml)
  # shellcheck disable=SC2046  # the arguments are words
  "$takt" run $(sed -n '1s/^# run: //p' "$file") --faults "$file" --output "$work/out" --report "$work/$name.json" \
    >"$work/$name.out" 2>"$work/$name.err" || { cat "$work/$name.err"; fail "$name: exit $?"; }
  scenarios=$((scenarios + 1))
  sed -n '/^scenario /,/^scenario met\|^SCENARIO NOT MET/p' "$work/$name.out"
done
[ $scenarios -ge 6 ] || fail "only $scenarios scenarios were found"
finish
