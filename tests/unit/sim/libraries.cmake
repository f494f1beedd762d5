# SPDX-License-Identifier: Apache-2.0
set(ROOM_THREADS TRUE)  # a camera renders ahead on a thread of its own
set(ROOM_TEST_LIBRARIES takt_semantic)  # a world is the one that a network describes
