# SPDX-License-Identifier: Apache-2.0
set(ROOM_LABEL nodes)  # runs every processing node
set(ROOM_TEST_LIBRARIES takt_discovery)
set(ROOM_APART ground_map_truth_test.cpp ground_truth_test.cpp raw_stereo_truth_test.cpp robot_client_test.cpp robot_pose_truth_test.cpp traversability_truth_test.cpp)
