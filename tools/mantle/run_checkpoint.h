#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tools/mantle/scene_options.h"
#include "tools/mantle/summary.h"

/// The file DIR/checkpoint: everything `mantle run --resume` needs to go on with the same bits. The
/// rows written so far stay in the trajectory beside it; the checkpoint knows how many bytes of it
/// count.

namespace mantle::tools {

struct RunCheckpoint {
  std::uint64_t fingerprint{0};  ///< of the scene's text and its overrides
  long trajectory_bytes{0};
  VolumeRange volume;
  std::string simulation;  ///< model::Simulation::Checkpoint()
};

std::uint64_t SceneFingerprint(const SceneOptions& options);

std::string CheckpointText(const RunCheckpoint& checkpoint);

/// Throws BadInput where the file is missing, damaged or of another scene.
RunCheckpoint ReadCheckpoint(const std::filesystem::path& file, std::uint64_t fingerprint);

/// The first `bytes` of the trajectory beside the checkpoint (partial or whole). Throws BadInput.
std::string TrajectoryBefore(const std::filesystem::path& checkpoint_file, long bytes);

}  // namespace mantle::tools
