# SPDX-License-Identifier: Apache-2.0
# Stereo matching and image files for the recorded drive; the room itself needs neither.
set(ROOM_TEST_LIBRARIES takt_opencv takt_allocation_counter)
