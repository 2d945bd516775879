#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "loop/scene/regular_file.h"
#include "tools/mantle/summary.h"

/// The file `checkpoint`: everything `mantle run --resume` needs to go on with the same bits. The
/// rows and messages written so far stay in the trajectory and the log beside it; the checkpoint
/// knows how many bytes of them count, and their hashes.
///
///   mantle-checkpoint 0.7.0 9f86d081884c7d65 1234     version of the program, hash and size of
///   what a3c5... 5678 0123... 1 9012 4567... 1 0.1 0.09 0.12   follows: scene, trajectory, log,
///                                                         volume
///   ...                                               the simulation
///
/// A single byte that is changed, missing or too many is noticed.

namespace mantle::tools {

struct RunCheckpoint {
  std::uint64_t fingerprint{0};  ///< Scene::fingerprint
  long trajectory_bytes{0};
  std::uint64_t trajectory_hash{scene::kEmptyHash};  ///< of these bytes
  int shape_every{0};                                ///< 0: there is no log
  long log_bytes{0};
  std::uint64_t log_hash{scene::kEmptyHash};
  VolumeRange volume;
  std::string simulation;  ///< model::Simulation::Checkpoint()
};

std::string CheckpointText(const RunCheckpoint& checkpoint);

/// Throws BadInput, which names `file`, where the text is damaged, of another scene or of another
/// version of the program.
RunCheckpoint ParseCheckpoint(const std::string& text, const std::filesystem::path& file,
                              std::uint64_t fingerprint);

/// The same from a file. Throws BadInput also where it cannot be read.
RunCheckpoint ReadCheckpoint(const std::filesystem::path& file, std::uint64_t fingerprint);

/// What the trajectory beside the checkpoint held when it was made. Throws BadInput where it is not
/// there, or another.
std::string TrajectoryBefore(const std::filesystem::path& checkpoint_file,
                             const RunCheckpoint& checkpoint);

/// The same of the log; empty where the run has none.
std::string LogBefore(const std::filesystem::path& checkpoint_file,
                      const RunCheckpoint& checkpoint);

}  // namespace mantle::tools
