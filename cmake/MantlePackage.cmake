# The installed package: find_package(mantle COMPONENTS ...). Every mantle_library is a component by
# itself; what it needs, of Mantle and of others, is read from what it links.

define_property(GLOBAL PROPERTY MANTLE_COMPONENTS BRIEF_DOCS "Names of the components" FULL_DOCS
  "In the order in which they were made.")

# Everything that is installed, without tests and benchmarks.
add_custom_target(mantle_installed)

# mantle_component(model FOLDER model HEADERS plant.h ... USES Eigen3::Eigen ...) installs the target
# mantle_model as component `model`, with its public headers under their folder.
function(mantle_component name)
  cmake_parse_arguments(ARG "" "FOLDER" "HEADERS;USES" ${ARGN})
  set_target_properties(mantle_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS mantle_${name} EXPORT mantle_${name}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT mantle_${name} NAMESPACE mantle:: FILE ${name}Targets.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mantle COMPONENT development)
  foreach(header IN LISTS ARG_HEADERS)
    cmake_path(GET header PARENT_PATH below)  # bus/bus.h of firmware_sim
    cmake_path(GET header FILENAME file)
    install(FILES ${PROJECT_SOURCE_DIR}/${ARG_FOLDER}/${header}
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mantle/${ARG_FOLDER}/${below} COMPONENT development)
  endforeach()
  add_dependencies(mantle_installed mantle_${name})
  set(uses "")
  foreach(use IN LISTS ARG_USES)
    if(use MATCHES "^\\$<BUILD_INTERFACE:")
      continue()
    endif()
    list(APPEND uses ${use})
  endforeach()
  set_property(GLOBAL APPEND PROPERTY MANTLE_COMPONENTS ${name})
  set_property(GLOBAL PROPERTY MANTLE_USES_${name} ${uses})
endfunction()

# Targets that a component needs, each after those that it needs itself; the component last.
function(mantle_needs name out)
  set(needs "")
  get_property(uses GLOBAL PROPERTY MANTLE_USES_${name})
  foreach(use IN LISTS uses)
    set(more ${use})
    if(use MATCHES "^mantle::(.+)$")
      mantle_needs(${CMAKE_MATCH_1} more)
    endif()
    list(APPEND needs ${more})
  endforeach()
  list(APPEND needs mantle::${name})
  list(REMOVE_DUPLICATES needs)
  set(${out} ${needs} PARENT_SCOPE)
endfunction()

# Writes and installs mantleConfig.cmake; call it when every component is made.
function(mantle_install_package)
  include(CMakePackageConfigHelpers)
  get_property(components GLOBAL PROPERTY MANTLE_COMPONENTS)
  set(component_needs "")
  foreach(name IN LISTS components)
    mantle_needs(${name} needs)
    foreach(need IN LISTS needs)
      if(NOT need MATCHES "^mantle::")
        mantle_find_dependency(${need})  # fails here where an installed package could not find it
      endif()
    endforeach()
    string(APPEND component_needs "set(mantle_${name}_NEEDS ${needs})\n")
  endforeach()
  set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/mantle)
  set(scene_dir ${CMAKE_INSTALL_DATADIR}/mantle/scenes)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/mantleConfig.cmake.in
    ${PROJECT_BINARY_DIR}/mantleConfig.cmake INSTALL_DESTINATION ${package_dir} PATH_VARS scene_dir)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/mantleConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/mantleConfig.cmake
    ${PROJECT_BINARY_DIR}/mantleConfigVersion.cmake
    ${PROJECT_SOURCE_DIR}/cmake/MantleDependencies.cmake ${PROJECT_SOURCE_DIR}/cmake/FindLCM.cmake
    DESTINATION ${package_dir} COMPONENT development)
endfunction()
