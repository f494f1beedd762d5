# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_object_3d_evaluate takt_allocation_counter)
