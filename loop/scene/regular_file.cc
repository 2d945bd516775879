#include "loop/scene/regular_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace mantle::scene {
namespace {

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

}  // namespace

std::string ReadRegularFile(const std::filesystem::path& file, std::uintmax_t most_bytes,
                            std::optional<std::uintmax_t> first_bytes) {
  if (file == "-") throw UnreadableFile("standard input is not taken: must be a file");
  const Descriptor in{open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)};
  if (in.fd < 0) {
    throw UnreadableFile(errno == ENOENT ? "no such file" : std::strerror(errno));
  }
  struct stat status {};
  if (fstat(in.fd, &status) != 0) throw UnreadableFile(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) throw UnreadableFile("is no regular file");
  const auto size = static_cast<std::uintmax_t>(status.st_size);
  const std::uintmax_t bytes = first_bytes.value_or(size);
  if (bytes > size) throw UnreadableFile(fmt::format("{} bytes, must be {} or more", size, bytes));
  if (bytes > most_bytes) {
    throw UnreadableFile(fmt::format("{} bytes, must be at most {}", bytes, most_bytes));
  }
  std::string text(static_cast<std::size_t>(bytes), '\0');
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t count = read(in.fd, text.data() + at, text.size() - at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw UnreadableFile(count < 0 ? std::strerror(errno) : "became shorter");
    at += static_cast<std::size_t>(count);
  }
  return text;
}

std::uint64_t Hash(std::string_view text, std::uint64_t hash) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

}  // namespace mantle::scene
