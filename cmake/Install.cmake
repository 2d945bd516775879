# What `cmake --install` puts where; the program and its modules are installed in tools/.
mantle_install_package()
install(FILES ${PROJECT_BINARY_DIR}/include/mantle/version.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mantle/mantle COMPONENT development)
install(DIRECTORY scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/mantle/scenes COMPONENT program)
include(cmake/Debian.cmake)
