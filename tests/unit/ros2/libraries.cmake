# SPDX-License-Identifier: Apache-2.0
set(ROOM_LABEL nodes)  # above the floor, as the program that it is part of
