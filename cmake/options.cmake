# SPDX-License-Identifier: Apache-2.0
# Flags that every target of the project shares.

find_program(TAKT_CCACHE ccache)
if(TAKT_CCACHE)
  set(CMAKE_C_COMPILER_LAUNCHER ${TAKT_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${TAKT_CCACHE})
endif()

# Contraction off: results must not depend on whether the compiler found an FMA (bit-exact replay).
add_compile_options(-Wall -Wextra -Wpedantic -Wconversion -Werror -ffp-contract=off -fno-math-errno)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  add_compile_options(-Wno-restrict)  # GCC 12 reports std::string concatenation falsely (GCC bug 105651)
endif()
include_directories(${PROJECT_SOURCE_DIR})

set(TAKT_SANITIZE "" CACHE STRING "Sanitizers to build with: address,undefined or thread")
if(TAKT_SANITIZE)
  add_compile_options(-fsanitize=${TAKT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    add_compile_options(-Wno-maybe-uninitialized)  # GCC 12 misjudges its own instrumented library code (GCC bug 105562)
  endif()
  add_link_options(-fsanitize=${TAKT_SANITIZE})
endif()
set(TAKT_TSAN_SUPPRESSIONS)  # linked into programs
if(TAKT_SANITIZE MATCHES thread)
  set(TAKT_TSAN_SUPPRESSIONS takt_tsan_suppressions)
  add_library(takt_tsan_suppressions OBJECT ${PROJECT_SOURCE_DIR}/tests/tsan_suppressions.cpp)
endif()

# For a directory whose code runs in no job: half the optimiser's time is half the time of a first build.
macro(takt_build_quickly)
  add_compile_options($<$<CONFIG:Release>:-O1>)
endmacro()

# One library per room: takt_room(stereo SOURCES a.cpp b.cpp USES takt_rt opencv_core)
function(takt_room name)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES" ${ARGN})
  add_library(takt_${name} STATIC ${ARG_SOURCES})
  target_link_libraries(takt_${name} PUBLIC ${ARG_USES})
endfunction()
