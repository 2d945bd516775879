#pragma once

#include <filesystem>

/// A lock that ends with the process that holds it, however that ends: flock(2) on a file that
/// holds the process's id. The file itself may stay behind; it locks nothing.

namespace mantle::tools {

class FolderLock {
 public:
  /// Makes the file where there is none; never follows a link. Throws BadInput, which names
  /// `folder` and the process that holds the lock, where another one does, and where the file
  /// cannot be made or locked.
  FolderLock(std::filesystem::path file, const std::filesystem::path& folder);
  /// Removes the file and lets go.
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::filesystem::path file_;
  int fd_{-1};
};

}  // namespace mantle::tools
