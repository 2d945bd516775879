#include "tools/mantle/standard_output.h"

#include <fcntl.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>

namespace mantle::tools {
namespace {

constexpr std::size_t kLongestLine = 2000;

CannotPrint Failure(int error) {
  return CannotPrint(fmt::format("standard output cannot be written: {}", std::strerror(error)));
}

std::string OneLine(std::string_view text) {
  std::string line;
  for (const char c : text.substr(0, kLongestLine)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\n') {
      line += "\\n";
    } else if (c == '\t') {
      line += "\\t";
    } else if (byte < 0x20 || byte == 0x7F) {
      fmt::format_to(std::back_inserter(line), "\\x{:02x}", byte);
    } else {
      line += c;
    }
  }
  if (text.size() > kLongestLine) line += "...";
  return line;
}

}  // namespace

void PrepareStandardStreams() {
  // What replaces a closed standard output cannot be written either.
  const int modes[] = {O_RDONLY, O_RDONLY, O_WRONLY};
  for (int fd = 0; fd < 3; ++fd) {
    if (fcntl(fd, F_GETFD) < 0) [[maybe_unused]]
      const int opened = open("/dev/null", modes[fd]);
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void PrintText(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) throw Failure(errno);
}

void PrintText(std::string_view text, int status) {
  try {
    PrintText(text);
  } catch (const CannotPrint&) {
    if (status == 0) throw;
  }
}

void FlushOutput() {
  const bool failed = std::fflush(stdout) != 0;
  if (failed || std::ferror(stdout) != 0) throw Failure(failed ? errno : EIO);
}

void ComplainText(std::string_view text, std::string_view speaker) {
  const std::string line = fmt::format("{}: {}\n", speaker, OneLine(text));
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace mantle::tools
