# No sanitizer runs inside User-Mode Linux: its address space is too small for their shadow memory.
if(MANTLE_SANITIZE)
  return()
endif()

# mantle_vcan_test(name file.cc LIMIT s LIBS ...): a program that needs vcan0, run through
# tools/vcan_run, directly or inside User-Mode Linux. LIMIT counts inside. It has the machine to
# itself: its time limits are those of the wall clock.
function(mantle_vcan_test name)
  cmake_parse_arguments(ARG "" "LIMIT" "" ${ARGN})
  string(REPLACE "." "_" target "test_${name}")
  mantle_test_program(${target} ${ARG_UNPARSED_ARGUMENTS})
  add_test(NAME ${name}
    COMMAND ${PROJECT_SOURCE_DIR}/tools/vcan_run -t ${ARG_LIMIT} -- $<TARGET_FILE:${target}>)
  math(EXPR limit "${ARG_LIMIT} + 40")
  set_tests_properties(${name} PROPERTIES TIMEOUT ${limit} RUN_SERIAL TRUE)
  mantle_label(${name} vcan)
endfunction()

mantle_vcan_test(firmware_sim.socket_can_bus socket_can_bus_test.cc LIMIT 60
  LIBS mantle::firmware_sim)
mantle_vcan_test(firmware_sim.vcan_drives vcan_drives_test.cc LIMIT 150
  LIBS mantle::firmware_sim)
add_dependencies(test_firmware_sim_vcan_drives mantle)
mantle_vcan_test(firmware_sim.python_can python_can_test.cc LIMIT 60 LIBS mantle::firmware_sim)
add_dependencies(test_firmware_sim_python_can mantle)
add_test(NAME firmware_sim.vcan_run COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/vcan_run_test.sh)
set_tests_properties(firmware_sim.vcan_run PROPERTIES TIMEOUT 150)
mantle_label(firmware_sim.vcan_run vcan)
