# SPDX-License-Identifier: Apache-2.0
# The node also runs in a graph.
set(ROOM_TEST_LIBRARIES takt_laser_fusion_evaluate takt_cloud_file takt_allocation_counter takt_compose takt_ace)
