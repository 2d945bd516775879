#include "tools/studies/study_store.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <system_error>

#include "tools/mantle/bad_input.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/summary.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

std::optional<Json> ReadJson(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return {};
  Json j = Json::parse(in, nullptr, false);
  if (j.is_discarded()) return {};
  return j;
}

}  // namespace

StudyStore::StudyStore(const fs::path& folder) : folder_(folder) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error || !fs::is_directory(folder_)) throw CannotWrite(folder_);
}

void StudyStore::Put(const StudyPoint& point, const std::string& key) {
  const std::string name = key + ".point.json";
  if (!fs::exists(folder_ / name)) WriteWhole(folder_, name, Dump(ToJson(point)));
}

StudyPoint StudyStore::Point(const std::string& key) const {
  const fs::path file = folder_ / (key + ".point.json");
  const auto j = ReadJson(file);
  if (!j) throw BadInput(fmt::format("{}: no point of a study", file.string()));
  return PointFromJson(*j);
}

void StudyStore::PutRow(const std::string& key, const Json& row) {
  WriteWhole(folder_, key + ".row.json", Dump(row));
}

std::optional<Json> StudyStore::Row(const std::string& key) const {
  return ReadJson(folder_ / (key + ".row.json"));
}

fs::path StudyStore::Log(const std::string& key) const { return folder_ / (key + ".log"); }

std::string StudyStore::LastWords(const std::string& key) const {
  std::ifstream in(Log(key));
  std::string last;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

void StudyStore::Remove() {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".json") || name.ends_with(".log") || name.ends_with(".txt") ||
        name.ends_with(".toml")) {
      fs::remove(entry.path(), error);
    }
  }
  fs::remove(folder_, error);
}

}  // namespace mantle::tools
