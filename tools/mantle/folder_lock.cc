#include "tools/mantle/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

constexpr mode_t kMode = 0666;  // less the umask

std::string Holder(int fd) {
  char text[32] = {};
  const ssize_t size = pread(fd, text, sizeof text - 1, 0);
  const std::string pid(text, size > 0 ? static_cast<std::size_t>(size) : 0);
  return pid.empty() ? "another process" : "process " + pid;
}

// Whether `file` is still the one that was opened: its holder removes it when it ends.
bool IsCurrent(int fd, const std::filesystem::path& file) {
  struct stat opened {
  }, named{};
  return fstat(fd, &opened) == 0 && lstat(file.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

FolderLock::FolderLock(std::filesystem::path file, const std::filesystem::path& folder)
    : file_(std::move(file)) {
  const auto refuse = [&](const std::string& why) {
    if (fd_ >= 0) close(fd_);
    return BadInput(fmt::format("--out: {}: {}", folder.string(), why));
  };
  for (;;) {
    fd_ = open(file_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, kMode);
    if (fd_ < 0) {
      throw refuse(fmt::format("cannot be locked: {}: {}", file_.string(), std::strerror(errno)));
    }
    if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      if (errno == EWOULDBLOCK) {
        throw refuse(
            fmt::format("{} writes there: must be a folder of this run alone", Holder(fd_)));
      }
      throw refuse(fmt::format("cannot be locked: {}: {}", file_.string(), std::strerror(errno)));
    }
    if (IsCurrent(fd_, file_)) break;
    close(fd_);
  }
  const std::string pid = std::to_string(getpid());
  // Who cannot read it is told "another process".
  if (ftruncate(fd_, 0) == 0) [[maybe_unused]]
    const ssize_t said = write(fd_, pid.data(), pid.size());
}

FolderLock::~FolderLock() {
  unlink(file_.c_str());
  close(fd_);
}

}  // namespace mantle::tools
