# SPDX-License-Identifier: Apache-2.0
# Libraries that others would use instead. None is needed: the benchmark says which it does not have.
function(takt_bench_peer name)
  target_sources(takt-bench PRIVATE peers/${name}.cpp)
  string(TOUPPER ${name} upper)
  target_compile_definitions(takt-bench PRIVATE TAKT_BENCH_${upper})
  target_link_libraries(takt-bench PRIVATE ${ARGN})
endfunction()

find_package(TBB QUIET)
if(TBB_FOUND)
  takt_bench_peer(onetbb TBB::tbb)
endif()

pkg_check_modules(ZEROMQ QUIET IMPORTED_TARGET libzmq)
if(ZEROMQ_FOUND)
  takt_bench_peer(zeromq PkgConfig::ZEROMQ)
endif()

pkg_check_modules(ROSCPP QUIET IMPORTED_TARGET roscpp)
find_path(STD_MSGS std_msgs/UInt8MultiArray.h)
if(ROSCPP_FOUND AND STD_MSGS)
  takt_bench_peer(roscpp PkgConfig::ROSCPP)
endif()

find_package(CycloneDDS QUIET)
find_program(IDLC idlc)
if(CycloneDDS_FOUND AND IDLC)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/idl)
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${folder}/payload.c ${folder}/payload.h
    COMMAND ${IDLC} -o ${folder} ${CMAKE_CURRENT_SOURCE_DIR}/peers/payload.idl DEPENDS peers/payload.idl VERBATIM)
  add_library(takt_bench_payload STATIC ${folder}/payload.c ${folder}/payload.h)
  target_compile_options(takt_bench_payload PRIVATE -w)
  target_link_libraries(takt_bench_payload PUBLIC CycloneDDS::ddsc)
  target_include_directories(takt_bench_payload SYSTEM PUBLIC ${folder})
  takt_bench_peer(cyclonedds takt_bench_payload)
endif()
