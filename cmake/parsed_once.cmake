# SPDX-License-Identifier: Apache-2.0
# Headers of the system that most files read, parsed once for all targets of the same flags. No header of the project is
# among them: an edit compiles only the files that read it.

# takt_parse_once(NAME [PROGRAM] HEADERS <vector> ... USES targets): NAME is then what takt_use_parsed(TARGET NAME) takes.
# PROGRAM: for the files of executables, whose code is position-independent in another way than that of libraries.
function(takt_parse_once name)
  cmake_parse_arguments(ARG "PROGRAM" "" "HEADERS;USES" ${ARGN})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Nothing but its headers.\n")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${source})
  if(ARG_PROGRAM)
    set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${name} PRIVATE -fPIE)
  endif()
  target_link_libraries(${name} PRIVATE ${ARG_USES})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  takt_sum_parsed(${name} ${ARG_HEADERS})
endfunction()

# A precompiled header is another file in each build folder. The compiler cache takes this sum for it: of the compiler
# and of every line that it reads. (The flags of an object are in the cache's key as they are.)
function(takt_sum_parsed name)
  list(TRANSFORM ARGN REPLACE "(.+)" "#include \\1\n" OUTPUT_VARIABLE lines)
  string(JOIN "" text ${lines})
  set(probe ${CMAKE_CURRENT_BINARY_DIR}/${name}.probe.cpp)
  file(WRITE ${probe} "${text}")
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -std=c++20 -E -P ${probe} OUTPUT_VARIABLE read
    COMMAND_ERROR_IS_FATAL ANY)
  string(SHA256 sum "${CMAKE_CXX_COMPILER_VERSION} ${read}")
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.dir/cmake_pch.hxx.gch.sum CONTENT "${sum}\n")
endfunction()

# For all files of TARGET, the headers that this directory parses once (TAKT_PARSED names them; empty: none).
function(takt_use_parsed target)
  if(NOT TAKT_PARSED)
    return()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${TAKT_PARSED})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    # GCC bug 105651 again: in what it inlines from a precompiled header, optimised. The sanitizer presets keep them.
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Wno-stringop-overflow -Wno-array-bounds>)
  endif()
endfunction()
