# SPDX-License-Identifier: Apache-2.0
set(ROOM_APART read_test.cpp verdict_test.cpp)
