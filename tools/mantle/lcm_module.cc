#include "mantle/version.h"
#include "tools/mantle/lcm_functions.h"

// What the program looks up in mantle_lcm.so (tools/mantle/module.h).
extern "C" {

const char* mantle_module_version() { return mantle::kVersion; }

const mantle::tools::LcmFunctions* mantle_lcm_functions() {
  using namespace mantle::tools;
  static constexpr LcmFunctions kFunctions{OpenLcm, ReadEventLog, DecodeTelemetry};
  return &kFunctions;
}

}  // extern "C"
