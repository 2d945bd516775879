#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "loop/scene/scene.h"
#include "model/plant.h"
#include "tools/mantle/commands.h"

/// What every command that takes a scene shares: SCENE, --set, --json, and (where it writes) --out.

namespace mantle::tools {

struct SceneOptions {
  std::string scene_file;
  std::vector<std::string> overrides;
  bool json{false};
  std::string out;     ///< empty: results/SCENE
  bool report{false};  ///< --report

  /// Reads the scene. Throws scene::BadScene.
  scene::Scene Load() const;
  std::filesystem::path OutputFolder(const scene::Scene& scene) const;
};

void AddSceneOptions(CLI::App* command, SceneOptions* options);
void AddOutOption(CLI::App* command, SceneOptions* options);
void AddReportOption(CLI::App* command, bool* report);

/// Discretises the scene's robot; what the plant refuses is reported under the scene's name. Throws
/// scene::BadScene.
model::Plant BuildPlant(const SceneOptions& options, const scene::Scene& scene);

/// Calls `build`, which makes what the scene describes. All that its constructors refuse is the
/// scene's fault: rethrown as BadScene, prefixed with the scene's file name.
template <typename Build>
auto InScene(const SceneOptions& options, Build build) {
  const auto refusal = [&](const std::exception& error) {
    return scene::BadScene(std::filesystem::path(options.scene_file).filename().string() + ": " +
                           error.what());
  };
  try {
    return build();
  } catch (const scene::BadScene&) {
    throw;
  } catch (const std::invalid_argument& error) {
    throw refusal(error);
  } catch (const std::system_error& error) {
    throw refusal(error);
  }
}

}  // namespace mantle::tools
