# SPDX-License-Identifier: Apache-2.0
# The memory tests count allocations for real.
set(ROOM_TEST_LIBRARIES takt_allocation_counter)
set(ROOM_THREADS TRUE)
