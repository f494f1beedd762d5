# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_object_detection_evaluate takt_opencv)
