# SPDX-License-Identifier: Apache-2.0
set(ROOM_LABEL nodes)  # describes every processing node
set(ROOM_TEST_LIBRARIES takt_ace takt_check)
