# The drives: each file of firmware_sim has its test; what fuzzes, ships or is typed stands below.
foreach(name IN ITEMS
    canopen_node cia402 command_drives drive drive_supervision drive_watchdog emergency motion
    object_dictionary pdo power_stage release sdo_server state_machine winch winding)
  mantle_test(firmware_sim.${name} ${name}_test.cc LIBS mantle::firmware_sim)
endforeach()
add_dependencies(test_firmware_sim_command_drives mantle)
mantle_test(firmware_sim.eds eds_test.cc LIBS mantle::firmware_sim)
mantle_test(firmware_sim.no_allocation no_allocation_test.cc LIBS mantle::firmware_sim)
mantle_test(firmware_sim.fuzz fuzz_test.cc LIBS mantle::firmware_sim)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
add_test(NAME firmware_sim.eds_file
  COMMAND Python3::Interpreter ${CMAKE_CURRENT_SOURCE_DIR}/eds_test.py
    ${PROJECT_SOURCE_DIR}/firmware_sim/canopen/mantle_drive.eds)
mantle_label(firmware_sim.eds_file)

# The same frames against a copy of the drive under ASan and UBSan, in every build.
if(NOT MANTLE_SANITIZE)
  set(drive_sources)
  foreach(part IN ITEMS bus canopen drive master)
    get_target_property(part_sources mantle_${part} SOURCES)
    list(TRANSFORM part_sources PREPEND ${PROJECT_SOURCE_DIR}/firmware_sim/)
    list(APPEND drive_sources ${part_sources})
  endforeach()
  mantle_test(firmware_sim.fuzz_sanitized fuzz_test.cc SOURCES ${drive_sources} LIBS fmt::fmt)
  set(sanitize -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  set_target_properties(test_firmware_sim_fuzz_sanitized PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
  target_compile_features(test_firmware_sim_fuzz_sanitized PRIVATE cxx_std_20)
  target_compile_options(test_firmware_sim_fuzz_sanitized PRIVATE ${sanitize} -O1 -UNDEBUG)
  target_link_options(test_firmware_sim_fuzz_sanitized PRIVATE ${sanitize})
endif()
