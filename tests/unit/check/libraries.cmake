# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES nlohmann_json::nlohmann_json)
set(ROOM_APART ages_test.cpp check.cpp doctor_test.cpp lane_pieces_test.cpp)
