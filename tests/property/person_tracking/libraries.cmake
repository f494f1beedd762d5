# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_person_tracking_evaluate takt_allocation_counter takt_opencv)
