# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_allocation_counter)
set(ROOM_APART node_test.cpp)
