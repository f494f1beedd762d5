# SPDX-License-Identifier: Apache-2.0
# The memory tests count allocations for real.
set(ROOM_TEST_LIBRARIES takt_allocation_counter takt_with_iceoryx)
set(ROOM_THREADS TRUE)
