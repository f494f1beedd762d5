# SPDX-License-Identifier: Apache-2.0
# The memory tests count allocations for real.
set(ROOM_TEST_LIBRARIES takt_allocation_counter)
set(ROOM_THREADS TRUE)
set(ROOM_APART enforcement_test.cpp executor_test.cpp faulty_transport_test.cpp group_keeper_test.cpp node_faults_test.cpp outward_watchdog_test.cpp quality_test.cpp sources_test.cpp stolen_time_test.cpp supervisor_test.cpp trace_assemble_test.cpp trace_blame_test.cpp transform_buffer_test.cpp virtual_run_test.cpp)
