# Precompiled headers, one for each set of flags: libraries, test programs, the program. Their
# contents are in cmake/precompiled/.
option(MANTLE_PRECOMPILE "Precompile the headers that most files include" ON)

# mantle_precompiled(name LIBS ...): mantle_precompiled_<name>, of cmake/precompiled/<name>.h.
function(mantle_precompiled name)
  cmake_parse_arguments(ARG "" "" "LIBS;OPTIONS" ${ARGN})
  if(NOT MANTLE_PRECOMPILE OR TARGET mantle_precompiled_${name})
    return()
  endif()
  set(source ${PROJECT_BINARY_DIR}/precompiled_${name}.cc)
  file(CONFIGURE OUTPUT ${source} CONTENT "")
  add_library(mantle_precompiled_${name} OBJECT EXCLUDE_FROM_ALL ${source})
  target_include_directories(mantle_precompiled_${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_options(mantle_precompiled_${name} PRIVATE ${ARG_OPTIONS})
  target_link_libraries(mantle_precompiled_${name} PRIVATE Eigen3::Eigen fmt::fmt ${ARG_LIBS} mantle_flags)
  # By a relative name, so that the compiler cache knows it again in another clone.
  target_precompile_headers(mantle_precompiled_${name} PRIVATE <cmake/precompiled/${name}.h>)
  # Position-independent code of an executable is another than that of a library.
  if(NOT name STREQUAL libraries)
    set_target_properties(mantle_precompiled_${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(mantle_precompiled_${name} PRIVATE -fPIE)
  endif()
endfunction()

# mantle_use_precompiled(target name)
function(mantle_use_precompiled target name)
  if(MANTLE_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM mantle_precompiled_${name})
    # Lets ccache hash the precompiled header instead of what it holds.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
  endif()
endfunction()
