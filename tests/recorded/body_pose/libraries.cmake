# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_body_pose_evaluate takt_opencv)
