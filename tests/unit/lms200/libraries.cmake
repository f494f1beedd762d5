# SPDX-License-Identifier: Apache-2.0
set(ROOM_THREADS TRUE)  # the driver has a thread of its own
