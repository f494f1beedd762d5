# SPDX-License-Identifier: Apache-2.0
# bin/takt finds share/takt beside itself.
include(GNUInstallDirs)
install(DIRECTORY graph/objects graph/signs graph/worlds graph/rigs graph/schema graph/skeletons graph/networks DESTINATION ${CMAKE_INSTALL_DATADIR}/takt/graph)
install(FILES graph/objects_3d.txt graph/terrain.txt DESTINATION ${CMAKE_INSTALL_DATADIR}/takt/graph)
install(DIRECTORY schedules DESTINATION ${CMAKE_INSTALL_DATADIR}/takt)
file(GLOB graphs ${PROJECT_SOURCE_DIR}/graph/*.yaml)
install(FILES ${graphs} DESTINATION ${CMAKE_INSTALL_DATADIR}/takt/graph)
install(DIRECTORY packaging/python/takt DESTINATION lib/python3/dist-packages FILES_MATCHING PATTERN *.py)
