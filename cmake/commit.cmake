# SPDX-License-Identifier: Apache-2.0
cmake_minimum_required(VERSION 3.25)
# Writes OUTPUT with the commit of SOURCE, only if it changed, so that a report can name what was measured. A tree without
# its history has it in a file .commit (packaging/debian/build).
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 OUTPUT_VARIABLE commit
  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(EXISTS ${SOURCE}/.commit)
  file(STRINGS ${SOURCE}/.commit commit LIMIT_COUNT 1)
elseif(NOT commit)
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT
"#include \"rt/abi.hpp\"
takt::Version takt::version() { return {\"@NUMBER@\", \"@commit@\", kAbi}; }
" @ONLY)
