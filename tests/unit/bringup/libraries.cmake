# SPDX-License-Identifier: Apache-2.0
set(ROOM_LABEL nodes)  # links every processing node
set(ROOM_TEST_LIBRARIES takt_ace)
