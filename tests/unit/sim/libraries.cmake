# SPDX-License-Identifier: Apache-2.0
set(ROOM_THREADS TRUE)  # a camera renders ahead on a thread of its own
set(ROOM_TEST_LIBRARIES takt_semantic)  # a world is the one that a network describes
set(ROOM_APART actions_test.cpp failures_test.cpp objects_test.cpp states_test.cpp)
