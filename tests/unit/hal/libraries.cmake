# SPDX-License-Identifier: Apache-2.0
set(ROOM_APART device_loss_test.cpp hardware_test.cpp)
