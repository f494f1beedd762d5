# SPDX-License-Identifier: Apache-2.0
# takt_other_program(TARGET NAMES...): a program that `takt NAME` becomes, by a link takt-NAME beside `takt`, and in
# libexec/takt of an installation. No NAMES: it is called takt-NAME itself, and stands there.
function(takt_other_program target)
  set(folder ${CMAKE_INSTALL_LIBEXECDIR}/takt)
  install(TARGETS ${target} RUNTIME DESTINATION ${folder} OPTIONAL)
  foreach(name ${ARGN})
    add_custom_command(TARGET ${target} POST_BUILD
      COMMAND ${CMAKE_COMMAND} -E make_directory $<TARGET_FILE_DIR:takt>
      COMMAND ${CMAKE_COMMAND} -E create_symlink $<TARGET_FILE:${target}> $<TARGET_FILE_DIR:takt>/takt-${name})
    if(NOT target STREQUAL takt-${name})
      install(CODE "set(folder \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${folder})
        if(EXISTS \${folder}/${target})
          file(CREATE_LINK ${target} \${folder}/takt-${name} SYMBOLIC)
        endif()")
    endif()
  endforeach()
endfunction()
