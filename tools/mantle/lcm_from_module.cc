#include "tools/mantle/lcm_functions.h"
#include "tools/mantle/module.h"

// lcm_bridge.h for the program: by the module, loaded at the first call.

namespace mantle::tools {
namespace {

const LcmFunctions& Functions() {
  using Get = const LcmFunctions*();
  static const LcmFunctions* const functions =
      reinterpret_cast<Get*>(ModuleSymbol("mantle_lcm.so", "mantle_lcm_functions"))();
  return *functions;
}

}  // namespace

std::unique_ptr<LcmLink> OpenLcm(const LcmOptions& options) { return Functions().open(options); }

LogEnd ReadEventLog(const std::filesystem::path& file,
                    const std::function<void(const LogEvent&)>& on_event) {
  return Functions().read_log(file, on_event);
}

bool DecodeTelemetry(std::string_view channel, std::span<const std::uint8_t> bytes,
                     TelemetrySink& to, const char** why) {
  return Functions().decode(channel, bytes, to, why);
}

}  // namespace mantle::tools
