# SPDX-License-Identifier: Apache-2.0
# Faults of the main graph in real time, one process for each subsystem, under the policy of its schedule where the kernel
# grants it: tests/faults/real_ace_*. The guard misses nothing, and everybody is back within two seconds.
source "$(dirname "$0")/lib.sh" "$@"
source "$(dirname "$0")/fault_matrix.sh"

run_matrix 6 tests/faults/real_ace_*.yaml
finish
