# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_stereo_evaluate takt_allocation_counter takt_opencv)
set(ROOM_APART memory_test.cpp monitor_on_matches_test.cpp oracles_test.cpp rectification_monitor_test.cpp)
