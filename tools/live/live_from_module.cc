#include "tools/live/live_server.h"
#include "tools/mantle/module.h"

// live_server.h for the program: by the module, loaded at the first call.

namespace mantle::tools {

std::unique_ptr<LiveServer> StartLiveServer(const LiveServerOptions& options, LiveSource source) {
  using Get = const LiveFunctions*();
  static const LiveFunctions* const functions =
      reinterpret_cast<Get*>(ModuleSymbol("mantle_live.so", "mantle_live_functions"))();
  return functions->start(options, std::move(source));
}

}  // namespace mantle::tools
