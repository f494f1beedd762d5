# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_scan_matching_evaluate takt_allocation_counter)
