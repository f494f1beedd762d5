# SPDX-License-Identifier: Apache-2.0
set(ROOM_APART replay_drive_test.cpp replay_test.cpp)
