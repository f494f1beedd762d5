# SPDX-License-Identifier: Apache-2.0
# Faults of the main graph in virtual time: tests/faults/ace_*.
source "$(dirname "$0")/lib.sh" "$@"
source "$(dirname "$0")/fault_matrix.sh"

run_matrix 23 tests/faults/ace_*.yaml
finish
