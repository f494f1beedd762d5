# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_traffic_signs_train opencv_objdetect)
