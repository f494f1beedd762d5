# SPDX-License-Identifier: Apache-2.0
# The node also runs in a graph.
set(ROOM_TEST_LIBRARIES takt_traffic_signs_train takt_compose takt_ace opencv_objdetect)
