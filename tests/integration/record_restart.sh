# SPDX-License-Identifier: Apache-2.0
# The main graph in several processes, some of which are killed at random and inside a message while values are set: its
# record replays without a difference, in one process and in several. The full run has 60 s of it (.ci/steps/91_records).
# Where other programs kept the recorder's thread from the CPU, it is another run's turn.
source "$(dirname "$0")/lib.sh" "$@"
for attempt in 1 2 3; do
  TAKT=$takt RUN_OPTIONS="--policy cooperative" "$source/bench/scenarios/record_restarts.sh" 14 5 2 $attempt
  code=$?
  [ $code -eq 3 ] || break
done
[ $code -eq 0 ] || fail "exit $code, see above"
finish
