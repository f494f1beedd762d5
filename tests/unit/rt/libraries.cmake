# SPDX-License-Identifier: Apache-2.0
# The memory tests count allocations for real.
if(NOT TARGET takt_allocation_counter)
  add_subdirectory(${PROJECT_SOURCE_DIR}/rt/memory/counter ${PROJECT_BINARY_DIR}/rt/memory/counter)
endif()
set(ROOM_TEST_LIBRARIES takt_allocation_counter)
