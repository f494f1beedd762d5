# SPDX-License-Identifier: Apache-2.0
# The simulated robot drives at a wall; the room itself knows no device.
set(ROOM_TEST_LIBRARIES takt_sim takt_base takt_laser takt_allocation_counter)
