#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/studies/study_point.h"

/// Where a study keeps its points while it goes on: the folder DIR.points beside its results. One
/// file POINT.json says what is to be done, ROW.json what came of it; a study that was stopped
/// finds the rows that it has. Processes, on this machine or others, share nothing else.
///
///   KEY.point.json   a point         KEY.row.json   its row, there when it is whole
///   KEY.log          what its process said

namespace mantle::tools {

class StudyStore {
 public:
  /// Makes the folder. Throws BadInput where it cannot be written.
  explicit StudyStore(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  /// Writes the point where it is not there yet.
  void Put(const StudyPoint& point, const std::string& key);
  StudyPoint Point(const std::string& key) const;
  void PutRow(const std::string& key, const Json& row);
  /// Empty where there is none, or it is no JSON.
  std::optional<Json> Row(const std::string& key) const;
  std::filesystem::path Log(const std::string& key) const;
  /// Last line of what the point's process said, for a reason.
  std::string LastWords(const std::string& key) const;
  /// Removes the folder and all in it that is a store's.
  void Remove();

 private:
  std::filesystem::path folder_;
};

}  // namespace mantle::tools
