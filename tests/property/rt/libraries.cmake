# SPDX-License-Identifier: Apache-2.0
set(ROOM_THREADS TRUE)
set(ROOM_APART latch_properties.cpp long_day_test.cpp quality_properties.cpp transform_properties.cpp)
