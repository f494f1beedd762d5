# SPDX-License-Identifier: Apache-2.0
# The main graph in several processes, some of which are killed at random and inside a message while values are set: its
# record replays without a difference, in one process and in several. The full run has 60 s of it (.ci/steps/91_records).
source "$(dirname "$0")/lib.sh" "$@"
TAKT=$takt RUN_OPTIONS="--policy cooperative" "$source/bench/scenarios/record_restarts.sh" 14 5 2 1 || fail "see above"
finish
