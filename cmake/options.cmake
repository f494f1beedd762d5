# SPDX-License-Identifier: Apache-2.0
# Flags that every target of the project shares.

find_program(TAKT_CCACHE ccache)
if(TAKT_CCACHE)
  set(CMAKE_C_COMPILER_LAUNCHER ${TAKT_CCACHE})
  # One cache serves all checkouts: paths below the source are hashed relative, and a precompiled header by what it was
  # made from (parsed_once.cmake). Not pch_defines: precompiled headers themselves do not come from the cache.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=time_macros CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}
    CCACHE_NOHASHDIR=1 CCACHE_PCH_EXTSUM=1 ${TAKT_CCACHE})
endif()

# Highway compiles each kernel once per processor generation. With SSE4.2 and AES as the floor, its emulated vectors, the
# slowest to compile by far, are left out.
set(TAKT_CPU x86-64-v2 CACHE STRING "Oldest x86 processor to run on: x86-64-v2 (with AES; since 2010) or x86-64")
set_property(CACHE TAKT_CPU PROPERTY STRINGS x86-64-v2 x86-64)
set(TAKT_CPU_FLAGS)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL x86_64)
  if(TAKT_CPU STREQUAL x86-64-v2)
    set(TAKT_CPU_FLAGS -march=x86-64-v2 -maes -mpclmul)  # rt/machine/required_cpu.cpp checks for these
  elseif(NOT TAKT_CPU STREQUAL x86-64)
    message(FATAL_ERROR "TAKT_CPU is `${TAKT_CPU}`; it must be x86-64-v2 or x86-64")
  endif()
elseif(CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64)
  # What Highway calls NEON has AES. SVE has vectors of no fixed size, and kernels keep vectors in classes and arrays.
  set(TAKT_CPU_FLAGS -march=armv8-a+crypto)
  add_compile_definitions("HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
add_compile_options(${TAKT_CPU_FLAGS})

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
set(TAKT_SUPPRESSIONS)  # linked into programs
if(TAKT_SANITIZE)
  set(TAKT_SUPPRESSIONS takt_suppressions)
  add_library(takt_suppressions OBJECT ${PROJECT_SOURCE_DIR}/tests/sanitizer_suppressions.cpp)
endif()

option(TAKT_FUZZ "Fuzz targets (tests/fuzz/run); needs Clang" OFF)
option(TAKT_ONE_SIMD_TARGET "Compile SIMD kernels for the baseline CPU only: quicker where they are not what is tested" OFF)
if(TAKT_ONE_SIMD_TARGET)
  add_compile_definitions(HWY_COMPILE_ONLY_STATIC)
endif()

# For a directory whose code runs in no job: half the optimiser's time is half the time of a first build.
macro(takt_build_quickly)
  add_compile_options($<$<CONFIG:Release>:-O1>)
  set(TAKT_PARSED)  # GCC 12 takes no precompiled header of another level; it crashes on one
endmacro()

# Most of a file's compile time are the headers it reads. Off: every file apart, for edits and for tools that read
# compile_commands.json.
option(TAKT_UNITE "Compile several files of a target as one: a first build in half the time" ON)
set(TAKT_FILES_AT_ONCE 12 CACHE STRING "How many; 0: all of a target")

# The sources of a target of this directory. Those given behind it stay apart: they share a name with another one, inside
# their anonymous namespaces.
function(takt_unite target)
  if(NOT TAKT_UNITE)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  set(apart ${ARGN})
  list(TRANSFORM apart PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  foreach(source ${sources})
    file(REAL_PATH ${source} path)
    file(STRINGS ${path} reads_itself REGEX "hwy/foreach_target.h" LIMIT_COUNT 1)
    if(reads_itself)
      list(APPEND apart ${path})
    endif()
  endforeach()
  set_source_files_properties(${apart} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${TAKT_FILES_AT_ONCE})
endfunction()

# One library per room: takt_room(stereo SOURCES a.cpp b.cpp APART b.cpp USES takt_rt opencv_core REGISTERS stereo). It is
# an archive, or what its second word says: SHARED or OBJECT.
# REGISTERS NAME: the room has `void register_NAME(NodeTypes&)`, or what its floor calls TAKT_REGISTRY_PART: the type, and
# the member of a Registry. takt_registry() makes the function that calls them all.
function(takt_room name)
  cmake_parse_arguments(ARG "SHARED;OBJECT" "" "SOURCES;APART;USES;REGISTERS" ${ARGN})
  set(kind STATIC)
  if(ARG_SHARED)
    set(kind SHARED)
  elseif(ARG_OBJECT)
    set(kind OBJECT)
  endif()
  add_library(takt_${name} ${kind} ${ARG_SOURCES})
  target_link_libraries(takt_${name} PUBLIC ${ARG_USES})
  takt_unite(takt_${name} ${ARG_APART})
  takt_use_parsed(takt_${name})
  foreach(thing ${ARG_REGISTERS})
    list(GET TAKT_REGISTRY_PART 0 type)
    list(GET TAKT_REGISTRY_PART 1 member)
    set_property(GLOBAL APPEND PROPERTY TAKT_REGISTER_DECLARED "void register_${thing}(${type}&)")
    set_property(GLOBAL APPEND PROPERTY TAKT_REGISTER_CALLS "register_${thing}(registry.${member})")
    set_property(GLOBAL APPEND PROPERTY TAKT_REGISTER_ROOMS takt_${name})
  endforeach()
endfunction()

# Adds every folder of this one that holds a CMakeLists.txt.
macro(takt_rooms)  # also one whose CMakeLists.txt comes later than its folder
  file(GLOB rooms CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*/CMakeLists.txt)
  foreach(room ${rooms})
    cmake_path(GET room PARENT_PATH room)
    add_subdirectory(${room})
  endforeach()
endmacro()

# From a template with @DECLARED@ and @CALLS@, a source in which every room so far registers; `rooms`: those to link.
function(takt_registry template source rooms)
  foreach(list DECLARED CALLS)
    get_property(lines GLOBAL PROPERTY TAKT_REGISTER_${list})
    list(JOIN lines ";\n" text)
    set(${list} "${text};")
  endforeach()
  string(REPLACE "\n" "\n  " CALLS "${CALLS}")
  configure_file(${template} ${source} @ONLY)
  get_property(found GLOBAL PROPERTY TAKT_REGISTER_ROOMS)
  list(REMOVE_DUPLICATES found)
  set(${rooms} ${found} PARENT_SCOPE)
endfunction()
