#include "tools/studies/study_point.h"

#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>

#include "loop/scene/regular_file.h"
#include "loop/scene/scene.h"
#include "mantle/version.h"
#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

std::string Contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string Processor() {
  std::istringstream in(Contents("/proc/cpuinfo"));
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

// Of the scene as it is read; of its text where it is refused.
std::uint64_t SceneHash(const StudyPoint& point) {
  try {
    const scene::Scene scene = scene::LoadScene(point.scene, point.overrides);
    return scene::Hash(scene.name, scene.fingerprint);
  } catch (const scene::BadScene&) {
    std::uint64_t hash = scene::Hash(Contents(point.scene));
    for (const std::string& set : point.overrides) hash = scene::Hash(set + "\n", hash);
    return hash;
  }
}

}  // namespace

const std::string& ProgramHash() {
  static const std::string hash = fmt::format("{:016x}", scene::Hash(Contents("/proc/self/exe")));
  return hash;
}

std::string StudyPoint::Key() const {
  std::uint64_t hash = SceneHash(*this);
  for (const std::string& text : {ProgramHash(), kind, options.dump(), name}) {
    hash = scene::Hash(text + "\n", hash);
  }
  return fmt::format("{:016x}", hash);
}

Json ToJson(const StudyPoint& p) {
  return {{"kind", p.kind},   {"name", p.name},           {"family", p.family},
          {"scene", p.scene}, {"overrides", p.overrides}, {"options", p.options},
          {"shown", p.shown}};
}

StudyPoint PointFromJson(const Json& j) {
  try {
    StudyPoint p;
    p.kind = j.at("kind");
    p.name = j.at("name");
    p.family = j.at("family");
    p.scene = j.at("scene");
    p.overrides = j.at("overrides").get<std::vector<std::string>>();
    p.options = j.at("options");
    p.shown = j.at("shown");
    return p;
  } catch (const Json::exception& error) {
    throw BadInput(fmt::format("a point of a study: {}", error.what()));
  }
}

Json RowOf(const StudyPoint& p) {
  Json row = {{"name", p.name},
              {"family", p.family},
              {"ok", true},
              {"reason", ""},
              {"overrides", p.overrides}};
  row.update(p.shown);
  return row;
}

Json FailedRow(const StudyPoint& p, const std::string& reason) {
  Json row = RowOf(p);
  row["ok"] = false;
  row["reason"] = reason;
  return row;
}

Json StudyVersions() {
  utsname system{};
  uname(&system);
  return {{"mantle", kVersion},
          {"program", ProgramHash()},
          {"processor", Processor()},
          {"cores", sysconf(_SC_NPROCESSORS_ONLN)},
          {"system", fmt::format("{} {}", system.sysname, system.release)},
          {"date", Today()}};
}

fs::path CacheFolder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && fs::path(cache).is_absolute()) return fs::path(cache) / "mantle";
  const char* home = std::getenv("HOME");
  if (home != nullptr && fs::path(home).is_absolute()) return fs::path(home) / ".cache" / "mantle";
  return fs::temp_directory_path() / fmt::format("mantle-{}", getuid());
}

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace mantle::tools
