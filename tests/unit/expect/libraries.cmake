# SPDX-License-Identifier: Apache-2.0
set(ROOM_APART expectation_watch_test.cpp)
