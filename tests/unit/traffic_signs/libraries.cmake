# SPDX-License-Identifier: Apache-2.0
# The node also runs in a graph.
set(ROOM_TEST_LIBRARIES takt_traffic_signs_train takt_compose opencv_objdetect)
