#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "loop/scene/scene.h"

namespace mantle::python {

/// A scene that was read, with the file and the overrides that it was read from.
struct LoadedScene {
  /// Throws scene::BadScene.
  LoadedScene(std::string file_name, std::vector<std::string> sets)
      : file(std::move(file_name)),
        overrides(std::move(sets)),
        scene(scene::LoadScene(file, overrides)) {}

  std::string file;
  std::vector<std::string> overrides;
  scene::Scene scene;
};

/// Throws scene::BadScene where the scene has no table [time]; `who` needs it.
void DemandTime(const LoadedScene& loaded, const char* who);

/// Calls `build`, which makes what the scene describes. What its constructors refuse is the scene's
/// fault: rethrown as BadScene, with the name of its file.
template <typename Build>
auto InScene(const LoadedScene& loaded, Build build) {
  try {
    return build();
  } catch (const scene::BadScene&) {
    throw;
  } catch (const std::invalid_argument& error) {
    throw scene::BadScene(std::filesystem::path(loaded.file).filename().string() + ": " +
                          error.what());
  }
}

}  // namespace mantle::python
