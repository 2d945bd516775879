#include "mantle/version.h"
#include "tools/live/live_server.h"

// What the program looks up in mantle_live.so (tools/mantle/module.h).
extern "C" {

const char* mantle_module_version() { return mantle::kVersion; }

const mantle::tools::LiveFunctions* mantle_live_functions() {
  static constexpr mantle::tools::LiveFunctions kFunctions{mantle::tools::StartLiveServer};
  return &kFunctions;
}

}  // extern "C"
