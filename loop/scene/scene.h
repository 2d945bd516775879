#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/options.h"
#include "loop/options.h"
#include "loop/scene/toml_document.h"
#include "model/robot.h"
#include "model/simulation.h"
#include "model/statics.h"
#include "reduced/reduction.h"

namespace mantle::scene {

/// A scene: what one TOML file says, checked. docs/scene.md lists every key, from the same
/// descriptions as this reader has them. Numbers are SI; texts carry a unit ("15 mm"). Unknown
/// keys, wrong types and units, numbers that are not finite or out of bound, and effects that
/// contradict the bodies are refused in one line that names scene, path, value, unit and bound. A
/// scene that `extends` another file is that one with its own tables merged over it.
struct Scene {
  std::string name;  ///< file name without extension, or the key `name`
  std::string description;
  model::Robot robot;
  model::RunSettings run;          ///< of the tables [time] and [output]
  model::StaticsSettings statics;  ///< of the table [statics]
  reduced::Reduction
      reduction;  ///< of the reduced model; defaults where the scene has no table [reduced]
  std::optional<controller::ControlOptions> control;  ///< where the scene has a table [control]
  loop::DriveOptions drives;                          ///< of the table [drives]
  controller::SensorOptions sensors;                  ///< of the table [sensors]
  loop::Mismatch mismatch;                            ///< of the plant from the controller's model
  bool has_time{false};     ///< the scene has a table [time]: it is meant to be run
  bool has_statics{false};  ///< the scene has a table [statics]: it is meant to be solved
  /// The scene as TOML with every default spelt out, overrides and what it extends merged in; read
  /// from the same directory it gives the same scene, bit for bit. What is said by the absence of a
  /// key stays absent.
  std::string text;
  std::vector<std::filesystem::path> files;  ///< that it extends or names, and that were read
  /// Of `text` and of what the files that it names hold: scenes that run differently have different
  /// ones; comments and layout do not count.
  std::uint64_t fingerprint{0};
};

/// Reads a file; `overrides` ("time.step=0.005") are applied before anything is checked, one of
/// `extends` before the others. Throws BadScene where the file is missing, unreadable or wrong.
Scene LoadScene(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

/// The same from a text. `name` stands in messages; files that the scene names are looked up in
/// `directory`.
Scene ParseScene(std::string_view toml, const std::string& name,
                 const std::filesystem::path& directory = ".",
                 const std::vector<std::string>& overrides = {});

}  // namespace mantle::scene
