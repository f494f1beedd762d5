# SPDX-License-Identifier: Apache-2.0
set(ROOM_APART global_non_preemptive_properties.cpp part_properties.cpp per_core_properties.cpp)
