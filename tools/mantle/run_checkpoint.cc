#include "tools/mantle/run_checkpoint.h"

#include <fmt/format.h>

#include <sstream>

#include "mantle/version.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/output_folder.h"

namespace mantle::tools {
namespace {

constexpr std::string_view kMagic = "mantle-checkpoint";
constexpr std::uintmax_t kMostBytes = 256 << 20;
constexpr std::uintmax_t kMostResultBytes = std::uintmax_t{4} << 30;

BadInput BadCheckpoint(const std::filesystem::path& file, const std::string& why) {
  return BadInput(fmt::format("--resume: {}: {}", file.string(), why));
}

std::string FirstLine(std::string_view body) {
  return fmt::format("{} {} {:016x} {}\n", kMagic, kVersion, scene::Hash(body), body.size());
}

std::string ReadWhole(const std::filesystem::path& file) {
  try {
    return scene::ReadRegularFile(file, kMostBytes);
  } catch (const scene::UnreadableFile& error) {
    std::string why = fmt::format("cannot be read: {}", error.what());
    const std::filesystem::path stopped = PartialOf(file.parent_path(), file.filename().string());
    std::error_code absent;
    if (std::filesystem::exists(stopped, absent)) {
      why += fmt::format("; a run that was stopped left {}", stopped.string());
    }
    throw BadCheckpoint(file, why);
  }
}

}  // namespace

std::string CheckpointText(const RunCheckpoint& c) {
  const std::string body =
      fmt::format("{:016x} {} {:016x} {} {} {:016x} {:d} {} {} {}\n", c.fingerprint,
                  c.trajectory_bytes, c.trajectory_hash, c.shape_every, c.log_bytes, c.log_hash,
                  c.volume.started, c.volume.initial_m3, c.volume.min_m3, c.volume.max_m3) +
      c.simulation;
  return FirstLine(body) + body;
}

RunCheckpoint ReadCheckpoint(const std::filesystem::path& file, std::uint64_t fingerprint) {
  return ParseCheckpoint(ReadWhole(file), file, fingerprint);
}

RunCheckpoint ParseCheckpoint(const std::string& text, const std::filesystem::path& file,
                              std::uint64_t fingerprint) {
  if (!text.starts_with(kMagic)) throw BadCheckpoint(file, "is not a checkpoint, or damaged");
  const std::size_t line_end = std::min(text.find('\n'), text.size() - 1) + 1;
  const std::string line = text.substr(0, line_end), body = text.substr(line_end);
  std::istringstream words(line);
  std::string magic, version;
  words >> magic >> version;
  // The line is compared as text, so that it may not be written in another way either.
  if (line != FirstLine(body)) {
    throw BadCheckpoint(file, magic == kMagic && version != kVersion
                                  ? fmt::format("is of version {} of the program, must be {}; or "
                                                "it is damaged",
                                                version, kVersion)
                                  : "is not a checkpoint, or damaged");
  }
  RunCheckpoint c;
  std::string initial, low, high;
  std::istringstream in(body);
  in >> std::hex >> c.fingerprint >> std::dec >> c.trajectory_bytes >> std::hex >>
      c.trajectory_hash >> std::dec >> c.shape_every >> c.log_bytes >> std::hex >> c.log_hash >>
      std::dec >> c.volume.started >> initial >> low >> high;
  if (!in) throw BadCheckpoint(file, "is not a checkpoint, or damaged");
  if (c.fingerprint != fingerprint) {
    throw BadCheckpoint(file,
                        "is of another scene, or the scene, a file that it reads or its --set "
                        "have changed since");
  }
  c.volume.initial_m3 = std::stod(initial);
  c.volume.min_m3 = std::stod(low);
  c.volume.max_m3 = std::stod(high);
  c.simulation = body.substr(body.find('\n') + 1);
  return c;
}

namespace {

// The first `bytes` of a file beside the checkpoint, which have this hash.
std::string Before(const std::filesystem::path& checkpoint_file, const char* name, const char* what,
                   long bytes, std::uint64_t hash) {
  const std::filesystem::path file = checkpoint_file.parent_path() / name;
  std::string text;
  try {
    text = scene::ReadRegularFile(file, kMostResultBytes, static_cast<std::uintmax_t>(bytes));
  } catch (const scene::UnreadableFile& error) {
    throw BadCheckpoint(checkpoint_file, fmt::format("the {} it continues, {}, cannot be read: {}",
                                                     what, file.string(), error.what()));
  }
  if (scene::Hash(text) != hash) {
    throw BadCheckpoint(checkpoint_file, fmt::format("{} is not the {} it continues, or damaged",
                                                     file.string(), what));
  }
  return text;
}

}  // namespace

std::string TrajectoryBefore(const std::filesystem::path& checkpoint_file, const RunCheckpoint& c) {
  return Before(checkpoint_file, "trajectory.csv", "trajectory", c.trajectory_bytes,
                c.trajectory_hash);
}

std::string LogBefore(const std::filesystem::path& checkpoint_file, const RunCheckpoint& c) {
  if (c.shape_every == 0) return {};
  return Before(checkpoint_file, "telemetry.lcmlog", "log", c.log_bytes, c.log_hash);
}

}  // namespace mantle::tools
