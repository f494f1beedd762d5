# SPDX-License-Identifier: Apache-2.0
# Ways are planned so that the guard lets the robot drive them.
set(ROOM_TEST_LIBRARIES takt_obstacle_stop)
