# SPDX-License-Identifier: Apache-2.0
# The matrix of fault scenarios in real time (tests/faults) but for those of the main graph.
source "$(dirname "$0")/lib.sh" "$@"
source "$(dirname "$0")/fault_matrix.sh"

# shellcheck disable=SC2046  # names without blanks
run_matrix 15 $(grep -l '^# run: ' tests/faults/real_*.yaml | grep -v /real_ace_)
finish
