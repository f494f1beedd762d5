# SPDX-License-Identifier: Apache-2.0
# Objects are detected, placed and kept in a graph on the simulated robot's drive.
set(ROOM_TEST_LIBRARIES takt_compose takt_ace takt_allocation_counter)
