# find_package(mantle) gives mantle::model and mantle::firmware_sim; the program goes to bin/.
include(CMakePackageConfigHelpers)
install(EXPORT mantleTargets NAMESPACE mantle:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mantle)
configure_package_config_file(cmake/mantleConfig.cmake.in ${CMAKE_BINARY_DIR}/mantleConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mantle)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/mantleConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/mantleConfig.cmake ${CMAKE_BINARY_DIR}/mantleConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mantle)
# For editors that complete and check scenes.
add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/scene.schema.json
  COMMAND mantle check --json-schema > ${CMAKE_BINARY_DIR}/scene.schema.json
  DEPENDS mantle VERBATIM)
add_custom_target(scene_schema ALL DEPENDS ${CMAKE_BINARY_DIR}/scene.schema.json)
install(FILES ${CMAKE_BINARY_DIR}/scene.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/mantle)
install(DIRECTORY scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/mantle/scenes)
