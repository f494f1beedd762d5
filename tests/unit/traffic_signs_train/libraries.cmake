# SPDX-License-Identifier: Apache-2.0
set(ROOM_LABEL nodes)
set(ROOM_TEST_LIBRARIES opencv_objdetect)
