#pragma once

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>
#include <string_view>

#include "tools/mantle/bad_input.h"

/// Results on disk. A file is written as `name.partial` and appears under its own name by a rename
/// once it is whole; a run that stops early leaves the partial files.

namespace mantle::tools {

/// What a file is called until it is whole.
std::filesystem::path PartialPath(const std::filesystem::path& path);

/// What is thrown where a result cannot be written.
BadInput CannotWrite(const std::filesystem::path& path);

/// A text file that is written as NAME.partial until Publish().
class OutputFile {
 public:
  /// Starts the file anew; `begin` is written first. Throws BadInput where it cannot be written.
  OutputFile(const std::filesystem::path& folder, const std::string& name,
             std::string_view begin = {});

  void Write(std::string_view text);
  /// On disk as far as written. Throws std::runtime_error on a full disk.
  void Flush();
  long size_bytes() const { return size_bytes_; }
  void Publish();

 private:
  std::filesystem::path path_, partial_;
  std::ofstream out_;
  long size_bytes_{0};
};

/// Creates the folder (and its parents) where missing and proves that files can be written there.
/// Throws BadInput.
void PrepareFolder(const std::filesystem::path& folder);

/// What `mantle run` may leave.
inline constexpr std::initializer_list<const char*> kRunResults = {
    "summary.json", "trajectory.csv", "telemetry.lcmlog", "solver.csv"};

/// Removes what an earlier run left under these names, so that a folder describes one run.
void RemoveOldResults(const std::filesystem::path& folder,
                      std::initializer_list<const char*> names);

/// Writes a whole file at once, by rename.
void WriteWhole(const std::filesystem::path& folder, const std::string& name,
                std::string_view text);

}  // namespace mantle::tools
