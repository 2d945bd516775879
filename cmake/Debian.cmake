# Debian packages (tools/package, or the target `package`): mantle, the program; libmantle-dev, libraries and
# headers; python3-mantle, the module for Python, where it is built.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME mantle)
set(CPACK_PACKAGE_VENDOR "The Mantle authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
# Who makes a package is named as Debian's own tools name them.
set(maintainer "The Mantle authors <root@localhost>")
if(DEFINED ENV{DEBEMAIL})
  set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
set(CPACK_PACKAGE_CONTACT "${maintainer}")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL program development)
if(TARGET mantle_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/StripArchives.cmake)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME mantle)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "control and simulation of soft underwater vehicles
Simulates soft robots that swim (geometrically exact arms, an axisymmetric
shell, a rigid core, the water's loads), their motor drives on a CAN bus, and
the model-predictive controller that steers them through it.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmantle-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "mantle (= ${PROJECT_VERSION}), libeigen3-dev, libfmt-dev, \
libsundials-dev, libtomlplusplus-dev, coinor-libipopt-dev, liblcm-dev, liblcm-bin, pkg-config | pkgconf")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "libraries for soft underwater vehicles
Static libraries and headers of Mantle: the full model, the reduced model, the
controller, CAN buses, drives and their master. With a CMake package.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-mantle)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "mantle (= ${PROJECT_VERSION}), ${MANTLE_PYTHON_DEPENDS}, python3-numpy")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "soft underwater vehicles from Python
Module of Mantle: runs with their results as arrays, the full and the reduced
model to step by hand, controllers and estimators written in Python, and an
environment for learning.")

# What Debian wants in /usr/share/doc, made from LICENSE and CHANGELOG.md.
file(READ LICENSE license)
string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
string(REGEX REPLACE "(^|\n)([^\n])" "\\1 \\2" license "${license}")
file(WRITE ${PROJECT_BINARY_DIR}/debian/copyright
"Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: Mantle

Files: *
Copyright: 2026 The Mantle authors
License: BSD-3-Clause

License: BSD-3-Clause
${license}")
execute_process(COMMAND sed "1,/^## /d; /^## /,$d; /^$/d; s/^- /* /" ${PROJECT_SOURCE_DIR}/CHANGELOG.md
  COMMAND fold -s -w 72 COMMAND sed "s/^/    /; s/^    [*]/  */; s/ *$//"
  OUTPUT_VARIABLE changes COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${PROJECT_BINARY_DIR}/debian/changelog "mantle (${PROJECT_VERSION}) unstable; urgency=medium

${changes}
 -- ${maintainer}  Sun, 01 Nov 2026 12:00:00 +0000
")
execute_process(COMMAND gzip -9nf ${PROJECT_BINARY_DIR}/debian/changelog COMMAND_ERROR_IS_FATAL ANY)
set(doc ${CMAKE_INSTALL_DATADIR}/doc)
set(pairs mantle:program libmantle-dev:development)
if(TARGET mantle_python)
  list(APPEND pairs python3-mantle:python)
endif()
foreach(pair IN LISTS pairs)
  string(REPLACE ":" ";" pair ${pair})
  list(GET pair 0 package)
  list(GET pair 1 component)
  install(FILES ${PROJECT_BINARY_DIR}/debian/copyright ${PROJECT_BINARY_DIR}/debian/changelog.gz
    DESTINATION ${doc}/${package} COMPONENT ${component})
endforeach()
install(FILES THIRD_PARTY_NOTICES CITATION.cff DESTINATION ${doc}/mantle COMPONENT program)
include(CPack)
