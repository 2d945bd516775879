#include "tools/mantle/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

bool Contains(ResultNames names, const std::string& name) {
  return std::any_of(names.begin(), names.end(), [&](const char* n) { return name == n; });
}

// Without links, without a slash at the end, absolute.
fs::path Resolved(const fs::path& folder) {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(fs::absolute(folder, error), error);
  if (error) throw CannotWrite(folder);
  return path.has_filename() ? path : path.parent_path();
}

fs::path WithoutSlash(const fs::path& folder) {
  return folder.has_filename() || !folder.has_parent_path() ? folder : folder.parent_path();
}

bool Writable(const fs::path& folder) {
  return fs::is_directory(folder) && access(folder.c_str(), W_OK | X_OK) == 0;
}

bool IsMountPoint(const fs::path& folder) {
  struct stat here {
  }, above{};
  return stat(folder.c_str(), &here) != 0 || stat(folder.parent_path().c_str(), &above) != 0 ||
         here.st_dev != above.st_dev || here.st_ino == above.st_ino;
}

// The current folder or one above it: who stands in it would stand in a removed one.
bool HoldsCurrentFolder(const fs::path& folder) {
  std::error_code error;
  const fs::path current = fs::current_path(error);
  const auto [end, at] =
      std::mismatch(folder.begin(), folder.end(), current.begin(), current.end());
  return error || end == folder.end();
}

CannotGoOn CannotPublish(const fs::path& from, const fs::path& to, const std::string& why) {
  return CannotGoOn(fmt::format("--out: {}: cannot be put in place: {}; the results are in {}",
                                to.string(), why, from.string()));
}

fs::path PartialName(const fs::path& folder, bool inside) {
  return inside ? folder / "run.partial" : fs::path(fmt::format("{}.partial", folder.string()));
}

// Removes files of these names; what is no file of these names stays.
void RemoveResults(const fs::path& folder, ResultNames names, ResultNames kept) {
  std::error_code absent;
  for (const char* name : names) {
    if (!Contains(kept, name)) fs::remove(folder / name, absent);
    fs::remove(folder / fmt::format("{}.new", name), absent);
  }
}

}  // namespace

ResultFolder::ResultFolder(const fs::path& folder, ResultNames names, const Kept& kept)
    : shown_(WithoutSlash(folder)), folder_(Resolved(folder)), names_(names) {
  std::error_code error;
  if (!folder_.has_filename() || fs::is_symlink(fs::symlink_status(folder_))) {
    throw CannotWrite(folder);
  }
  fs::create_directories(folder_.parent_path(), error);
  const bool exists = fs::exists(folder_, error);
  if (exists && !Writable(folder_)) throw CannotWrite(folder);
  inside_ = exists && (IsMountPoint(folder_) || !Writable(folder_.parent_path()));
  if (!inside_ && !Writable(folder_.parent_path())) throw CannotWrite(folder);
  partial_ = PartialName(folder_, inside_);
  // A link's or "."'s own name says nothing of where the folder is.
  const bool plain = fs::absolute(shown_, error).lexically_normal() == folder_;
  shown_partial_ = plain ? PartialName(shown_, inside_) : partial_;
  lock_ = std::make_unique<FolderLock>(
      inside_ ? folder_ / ".run.lock"
              : folder_.parent_path() / fmt::format(".{}.lock", folder_.filename().string()),
      folder);
  const fs::file_status status = fs::symlink_status(partial_);
  if (fs::exists(status) && !fs::is_directory(status)) {
    throw BadInput(fmt::format("--out: {}: {} is in the way: must be a folder or absent",
                               folder.string(), shown_partial_.string()));
  }
  fs::create_directory(partial_, error);
  if (error || !Writable(partial_)) throw CannotWrite(shown_partial_);
  const bool goes_on = !kept.folder.empty() && fs::equivalent(kept.folder, partial_, error);
  RemoveResults(partial_, names_, goes_on ? kept.names : ResultNames());
}

ResultFolder::~ResultFolder() { rmdir(partial_.c_str()); }

bool ResultFolder::HoldsResultsAlone() const {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (!Contains(names_, entry.path().filename().string())) return false;
  }
  return !error;
}

void ResultFolder::Publish() {
  if (!fs::exists(folder_)) {
    if (rename(partial_.c_str(), folder_.c_str()) != 0) {
      throw CannotPublish(shown_partial_, shown_, std::strerror(errno));
    }
    return;
  }
  const bool exchanged =
      !inside_ && HoldsResultsAlone() && !HoldsCurrentFolder(folder_) &&
      renameat2(AT_FDCWD, partial_.c_str(), AT_FDCWD, folder_.c_str(), RENAME_EXCHANGE) == 0;
  if (!exchanged) return ReplaceFiles();
  RemoveResults(partial_, names_, {});  // now the old ones
}

void ResultFolder::ReplaceFiles() {
  std::error_code error;
  const std::string seal = names_.front();
  fs::remove(folder_ / seal, error);
  for (const char* name : names_) {
    if (name != seal && !fs::exists(partial_ / name)) fs::remove(folder_ / name, error);
  }
  // From the last to the first: the seal comes last.
  for (std::size_t i = names_.size(); i-- > 0;) {
    const fs::path from = partial_ / names_[i], to = folder_ / names_[i];
    if (!fs::exists(from)) continue;
    if (rename(from.c_str(), to.c_str()) != 0) {
      throw CannotPublish(shown_partial_, shown_, std::strerror(errno));
    }
  }
}

fs::path PartialOf(const fs::path& folder, const std::string& name) {
  return PartialName(WithoutSlash(folder), false) / name;
}

}  // namespace mantle::tools
