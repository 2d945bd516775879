# LCM as Debian and Ubuntu package it: without a CMake configuration, and with a pkg-config file that
# asks for glib's, which a user of the library does not need.
#
#   LCM::lcm            the library with its headers, <lcm/lcm.h>
#   LCM_GEN_EXECUTABLE  lcm-gen; LCM_LOGPLAYER_EXECUTABLE  lcm-logplayer
find_program(LCM_GEN_EXECUTABLE lcm-gen)
find_program(LCM_LOGPLAYER_EXECUTABLE lcm-logplayer)
find_path(LCM_INCLUDE_DIR lcm/lcm.h)
find_library(LCM_LIBRARY lcm)
if(LCM_GEN_EXECUTABLE)
  execute_process(COMMAND ${LCM_GEN_EXECUTABLE} --version OUTPUT_VARIABLE LCM_VERSION)
  string(REGEX MATCH "[0-9]+(\\.[0-9]+)+" LCM_VERSION "${LCM_VERSION}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LCM
  REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN_EXECUTABLE LCM_LOGPLAYER_EXECUTABLE
  VERSION_VAR LCM_VERSION
  REASON_FAILURE_MESSAGE "tools/setup installs it (packages liblcm-dev and liblcm-bin)")
mark_as_advanced(LCM_GEN_EXECUTABLE LCM_LOGPLAYER_EXECUTABLE LCM_INCLUDE_DIR LCM_LIBRARY)

if(LCM_FOUND AND NOT TARGET LCM::lcm)
  add_library(LCM::lcm UNKNOWN IMPORTED)
  set_target_properties(LCM::lcm PROPERTIES IMPORTED_LOCATION ${LCM_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${LCM_INCLUDE_DIR})
endif()
