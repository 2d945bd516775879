#include "tools/mantle/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace mantle::tools {
namespace {

constexpr mode_t kMode = 0666;  // less the umask
constexpr std::size_t kBuffer_bytes = 16'384;

std::filesystem::path NewPath(const std::filesystem::path& path) { return path.string() + ".new"; }

}  // namespace

BadInput CannotWrite(const std::filesystem::path& path) {
  return BadInput(fmt::format(
      "--out: {}: cannot be written: must be a folder with write permission", path.string()));
}

OutputFile::OutputFile(const std::filesystem::path& folder, const std::string& name,
                       std::string_view begin)
    : path_(folder / name) {
  const std::filesystem::path fresh = NewPath(path_);
  unlink(fresh.c_str());
  fd_ = open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kMode);
  if (fd_ < 0) throw CannotWrite(path_);
  buffer_.reserve(kBuffer_bytes);
  try {
    Write(begin);
    Flush();
    if (rename(fresh.c_str(), path_.c_str()) != 0) Fail(errno);
  } catch (...) {
    unlink(fresh.c_str());
    close(fd_);
    throw;
  }
}

OutputFile::~OutputFile() {
  if (fd_ < 0) return;
  try {
    Flush();
  } catch (const CannotGoOn&) {
  }
  close(fd_);
}

void OutputFile::Write(std::string_view text) {
  size_bytes_ += static_cast<long>(text.size());
  if (buffer_.size() + text.size() > kBuffer_bytes) Flush();
  if (text.size() > kBuffer_bytes) return HandOver(text);
  buffer_ += text;
}

void OutputFile::Flush() {
  HandOver(buffer_);
  buffer_.clear();
}

void OutputFile::HandOver(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = write(fd_, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) Fail(count < 0 ? errno : ENOSPC);
    text.remove_prefix(static_cast<std::size_t>(count));
    on_disk_bytes_ += static_cast<long>(count);
  }
  whole_bytes_ = on_disk_bytes_;
}

void OutputFile::Close() {
  Flush();
  // A file that cannot be synchronised (a pipe's, some network's) has been written all the same.
  const bool lost = fsync(fd_) != 0 && errno != EINVAL && errno != ENOTSUP;
  if (lost) Fail(errno);
  const int fd = fd_;
  fd_ = -1;
  if (close(fd) != 0 && errno != EINTR) Fail(errno);
}

void OutputFile::Fail(int error) {
  buffer_.clear();
  if (fd_ >= 0 && on_disk_bytes_ > whole_bytes_) {
    [[maybe_unused]] const int cut = ftruncate(fd_, whole_bytes_);
  }
  throw CannotGoOn(fmt::format("{}: cannot be written: {}; what was written before is kept",
                               path_.string(), std::strerror(error)));
}

void WriteWhole(const std::filesystem::path& folder, const std::string& name,
                std::string_view text) {
  OutputFile(folder, name, text).Close();
}

}  // namespace mantle::tools
