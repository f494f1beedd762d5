# SPDX-License-Identifier: Apache-2.0
# Objects are seen in generated rooms, and by object_3d in a graph.
set(ROOM_TEST_LIBRARIES takt_semantic_evaluate takt_object_3d_evaluate takt_compose takt_ace takt_allocation_counter)
