# mantle_library(model SOURCES ... PUBLIC ... PRIVATE ...) makes the target mantle_model, alias
# mantle::model, whose headers are included as "model/name.h". FOLDER: where the headers are, unless
# that is the name. HEADERS: the public ones, which are installed (default: all of the folder).
# Each library is a component of the package (cmake/MantlePackage.cmake).

add_library(mantle_flags INTERFACE)
target_compile_options(mantle_flags INTERFACE -Wall -Wextra -Wconversion -Wno-sign-conversion
  $<$<BOOL:${MANTLE_WERROR}>:-Werror>)
if(MANTLE_SANITIZE)
  target_compile_options(mantle_flags INTERFACE -fsanitize=${MANTLE_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  target_link_options(mantle_flags INTERFACE -fsanitize=${MANTLE_SANITIZE})
endif()

# Every module there is; the program is built with them.
add_custom_target(mantle_modules)

function(mantle_library name)
  cmake_parse_arguments(ARG "" "FOLDER" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  if(NOT ARG_FOLDER)
    set(ARG_FOLDER ${name})
  endif()
  add_library(mantle_${name} STATIC ${ARG_SOURCES})
  add_library(mantle::${name} ALIAS mantle_${name})
  target_include_directories(mantle_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/mantle>)
  target_compile_features(mantle_${name} PUBLIC cxx_std_20)
  mantle_use_precompiled(mantle_${name} libraries)
  target_link_libraries(mantle_${name} PUBLIC ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:mantle_flags>)
  if(NOT ARG_HEADERS)
    file(GLOB ARG_HEADERS CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/${ARG_FOLDER}
      ${PROJECT_SOURCE_DIR}/${ARG_FOLDER}/*.h)
  endif()
  mantle_component(${name} FOLDER ${ARG_FOLDER} HEADERS ${ARG_HEADERS}
    USES ${ARG_PUBLIC} ${ARG_PRIVATE})
endfunction()

# mantle_test_program(target file.cc LIBS mantle::model): a GoogleTest program. What takes time runs in
# the libraries; optimised test code only takes longer to compile.
function(mantle_test_program target)
  cmake_parse_arguments(ARG "" "" "LIBS;SOURCES" ${ARGN})
  add_executable(${target} ${ARG_UNPARSED_ARGUMENTS} ${ARG_SOURCES})
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE mantle_test_paths ${ARG_LIBS} GTest::gtest_main fmt::fmt mantle_flags)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  mantle_use_precompiled(${target} tests)
endfunction()

# mantle_label(firmware_sim.pdo [LABEL...]): a ctest entry is labelled with the folder that its name
# begins with, and with what else is given: vcan, slow.
function(mantle_label name)
  string(REGEX REPLACE "\\..*" "" folder ${name})
  set_property(TEST ${name} APPEND PROPERTY LABELS ${folder} ${ARGN})
endfunction()

# What tools/test runs under sanitizers, label `sanitized`, built by the target sanitized_tests: buses
# and drives, which read what others send and cost little to compile. Under TSan, where there are threads.
# tools/test --full runs everything.
add_custom_target(sanitized_tests)
if(MANTLE_SANITIZE MATCHES thread)
  set(sanitized bus_properties fault_injecting_bus loop_bus recording_bus udp_multicast_bus)
elseif(MANTLE_SANITIZE)
  set(sanitized bus_load candump_log canopen_node drive drive_supervision emergency fault_injecting_bus fuzz
    log_player loop_bus master motion multicast_frame object_dictionary open_bus pdo recording_bus release
    sdo_client sdo_server state_machine traffic winch winding)
endif()
list(TRANSFORM sanitized PREPEND firmware_sim. OUTPUT_VARIABLE MANTLE_SANITIZED_TESTS)
if(MANTLE_SANITIZE MATCHES thread)
  list(APPEND MANTLE_SANITIZED_TESTS loop.between_threads)
endif()

# mantle_test(model.lie lie_test.cc LIBS mantle::model [TIMEOUT s]): one GoogleTest program, one ctest entry.
function(mantle_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  string(REPLACE "." "_" target "test_${name}")
  mantle_test_program(${target} ${ARG_UNPARSED_ARGUMENTS})
  add_test(NAME ${name} COMMAND ${target})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  mantle_label(${name})
  if(name IN_LIST MANTLE_SANITIZED_TESTS)
    mantle_label(${name} sanitized)
    add_dependencies(sanitized_tests ${target})
  endif()
endfunction()

# mantle_module(ipopt SOURCES ... LIBS ...): mantle_ipopt.so, which the program opens when it first
# needs it (tools/mantle/module.h); beside the program under lib/mantle/modules, built and installed alike.
function(mantle_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_library(mantle_${name}_module MODULE ${ARG_SOURCES})
  set_target_properties(mantle_${name}_module PROPERTIES
    PREFIX "" OUTPUT_NAME mantle_${name} LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/mantle/modules)
  mantle_use_precompiled(mantle_${name}_module libraries)
  target_link_libraries(mantle_${name}_module PRIVATE ${ARG_LIBS} mantle_flags)
  # What the module holds of Mantle's own libraries is its own copy, and nobody else's business.
  target_link_options(mantle_${name}_module PRIVATE LINKER:--exclude-libs,ALL)
  install(TARGETS mantle_${name}_module LIBRARY DESTINATION lib/mantle/modules COMPONENT program)
  add_dependencies(mantle_modules mantle_${name}_module)
endfunction()
