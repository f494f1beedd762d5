# SPDX-License-Identifier: Apache-2.0
cmake_minimum_required(VERSION 3.25)
# Which headers are public, and how they read once installed. A public header says so below its licence line:
#
#   // Installed as <takt/node.hpp>: core, stable.
#
# with its package and stable or experimental (docs: "What may change when"). Every other header is internal.
# As a script it only checks: cmake -DTAKT_ROOT=. -P cmake/public_headers.cmake

# Sets OUT to the public headers, relative to ROOT, and for each HEADER: takt_name_HEADER to what it is installed as,
# takt_package_HEADER to its package.
macro(takt_find_public_headers root out)
  set(${out})
  foreach(floor rt hal graph nodes)
    file(GLOB_RECURSE takt_headers RELATIVE ${root} ${takt_watched} ${root}/${floor}/*.hpp)
    foreach(header ${takt_headers})
      file(STRINGS ${root}/${header} line REGEX "^// Installed as " LIMIT_COUNT 1)
      if(NOT line)
        continue()
      endif()
      if(NOT line MATCHES "^// Installed as <(takt/[a-z0-9_/]+\\.hpp)>: (core|record|graph|hal|ace), (stable|experimental)\\.")
        message(FATAL_ERROR "${header}: `${line}` must read `// Installed as <takt/NAME.hpp>: PACKAGE, stable.`; "
          "packages are core, record, graph, hal and ace; in place of stable stands experimental")
      endif()
      set(takt_name_${header} ${CMAKE_MATCH_1})
      set(takt_package_${header} ${CMAKE_MATCH_2})
      set(takt_word_${header} ${CMAKE_MATCH_3})
      list(APPEND ${out} ${header})
    endforeach()
  endforeach()
endmacro()

# In the build tree <takt/node.hpp> is a file that includes rt/node.hpp.
function(takt_forward_headers root folder)
  set(takt_watched CONFIGURE_DEPENDS)
  takt_find_public_headers(${root} headers)
  foreach(header ${headers})
    file(CONFIGURE OUTPUT ${folder}/${takt_name_${header}} CONTENT "#include \"${header}\"\n" @ONLY)
  endforeach()
endfunction()

# Writes each public header to FOLDER, empty: nowhere, with <takt/...> for what it includes of the project.
function(takt_write_public_headers root folder)
  takt_find_public_headers(${root} headers)
  set(arrows_core core)
  set(arrows_record core record)
  set(arrows_hal core hal)
  set(arrows_graph core record hal graph)
  set(arrows_ace core record hal graph ace)
  foreach(header ${headers})
    file(READ ${root}/${header} text)
    string(REGEX MATCHALL "#include \"[^\"]+\"" includes "${text}")
    foreach(include ${includes})
      string(REGEX REPLACE "#include \"(.+)\"" "\\1" wanted "${include}")
      if(NOT DEFINED takt_name_${wanted})
        message(FATAL_ERROR "${header} is public and includes ${wanted}, which is not: mark that one, too, or forward-declare")
      endif()
      set(package ${takt_package_${wanted}})
      if(NOT package IN_LIST arrows_${takt_package_${header}})
        message(FATAL_ERROR "${header} (${takt_package_${header}}) includes ${wanted} (${package}): against the arrows")
      endif()
      string(REPLACE "${include}" "#include <${takt_name_${wanted}}>" text "${text}")
    endforeach()
    if(takt_word_${header} STREQUAL stable AND text MATCHES "#include [<\"](Eigen|opencv2)/")
      message(FATAL_ERROR "${header} is stable and includes ${CMAKE_MATCH_1}")
    endif()
    if(folder)
      file(WRITE ${folder}/${takt_name_${header}} "${text}")
    endif()
  endforeach()
endfunction()

if(TAKT_ROOT)
  file(REAL_PATH ${TAKT_ROOT} root)
  takt_write_public_headers(${root} "${TAKT_INCLUDE}")
endif()
