#pragma once

#include <string>

#include "firmware_sim/bus/bus.h"
#include "tools/mantle/scene_options.h"

/// What `mantle plant`, `mantle control` and `mantle hil` share (docs/hil.md).

namespace mantle::tools {

inline constexpr const char* kHilBus = "udp:239.74.163.2:43113@lo";
inline constexpr const char* kHilLcm = "udpm://239.255.76.67:7667?ttl=0";

struct ProgramOptions {
  SceneOptions scene;
  std::string bus;  ///< empty: the scene's, or where that is `loop` kHilBus
  std::string lcm{kHilLcm};

  /// Reads the scene. Throws BadScene where it has no [control] or no [time].
  scene::Scene Load() const;
  /// The bus that is meant.
  std::string Bus(const scene::Scene& scene) const;
};

/// SCENE, --set, --json, --bus, --lcm.
void AddProgramOptions(CLI::App* command, ProgramOptions* options);

/// A station on it. Throws BadInput, which names the option.
std::unique_ptr<firmware_sim::Bus> OpenStation(const std::string& spec, bool master);

}  // namespace mantle::tools
