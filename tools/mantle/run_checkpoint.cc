#include "tools/mantle/run_checkpoint.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

namespace mantle::tools {
namespace {

constexpr const char* kMagic = "mantle-run-1";

BadInput BadCheckpoint(const std::filesystem::path& file, const char* why) {
  return BadInput(fmt::format("--resume: {}: {}", file.string(), why));
}

std::string ReadAll(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

std::uint64_t SceneFingerprint(const SceneOptions& options) {
  std::string text = ReadAll(options.scene_file);
  for (const std::string& o : options.overrides) text += '\n' + o;
  std::uint64_t hash = 14695981039346656037ull;  // FNV-1a
  for (const unsigned char c : text) hash = (hash ^ c) * 1099511628211ull;
  return hash;
}

std::string CheckpointText(const RunCheckpoint& c) {
  return fmt::format("{}\n{:016x} {} {:d} {} {} {}\n", kMagic, c.fingerprint, c.trajectory_bytes,
                     c.volume.started, c.volume.initial_m3, c.volume.min_m3, c.volume.max_m3) +
         c.simulation;
}

RunCheckpoint ReadCheckpoint(const std::filesystem::path& file, std::uint64_t fingerprint) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw BadCheckpoint(file, "cannot be read");
  RunCheckpoint c;
  std::string magic, initial, low, high;
  in >> magic >> std::hex >> c.fingerprint >> std::dec >> c.trajectory_bytes >> c.volume.started >>
      initial >> low >> high;
  if (!in || magic != kMagic) throw BadCheckpoint(file, "is not a checkpoint, or damaged");
  if (c.fingerprint != fingerprint) {
    throw BadCheckpoint(file, "is of another scene, or the scene or its --set have changed since");
  }
  c.volume.initial_m3 = std::stod(initial);
  c.volume.min_m3 = std::stod(low);
  c.volume.max_m3 = std::stod(high);
  in.ignore(1);
  std::ostringstream rest;
  rest << in.rdbuf();
  c.simulation = rest.str();
  return c;
}

std::string TrajectoryBefore(const std::filesystem::path& checkpoint_file, long bytes) {
  const std::filesystem::path folder = checkpoint_file.parent_path();
  for (const char* name : {"trajectory.csv.partial", "trajectory.csv"}) {
    std::string text = ReadAll(folder / name);
    if (static_cast<long>(text.size()) < bytes) continue;
    text.resize(static_cast<std::size_t>(bytes));
    return text;
  }
  throw BadCheckpoint(checkpoint_file, "the trajectory it continues is not beside it");
}

}  // namespace mantle::tools
