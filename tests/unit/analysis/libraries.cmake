# SPDX-License-Identifier: Apache-2.0
set(ROOM_APART simulate_test.cpp)
