# SPDX-License-Identifier: Apache-2.0
set(ROOM_TEST_LIBRARIES takt_ace PkgConfig::TINYXML2)
set(ROOM_LABEL nodes)  # the page knows every node type
