#pragma once

#include "tools/mantle/lcm_bridge.h"

namespace mantle::tools {

/// The functions of lcm_bridge.h as mantle_lcm.so hands them out, by `mantle_lcm_functions`. The
/// program's own definitions of them (lcm_from_module.cc) call these.
struct LcmFunctions {
  std::unique_ptr<LcmLink> (*open)(const LcmOptions&);
  LogEnd (*read_log)(const std::filesystem::path&, const std::function<void(const LogEvent&)>&);
  bool (*decode)(std::string_view, std::span<const std::uint8_t>, TelemetrySink&, const char**);
};

}  // namespace mantle::tools
