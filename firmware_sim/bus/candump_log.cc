#include "firmware_sim/bus/candump_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <istream>
#include <stdexcept>
#include <system_error>

namespace mantle::firmware_sim {

namespace {

constexpr std::uint32_t kErrorFlag = 0x2000'0000;  // CAN_ERR_FLAG of linux/can.h
constexpr std::size_t kFileBufferBytes = 1 << 16;

template <typename T>
bool Number(std::string_view text, T& value, int base) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc{} && end == text.data() + text.size() && !text.empty();
}

// Takes what stands before the first space off `text`, with the spaces.
std::string_view Word(std::string_view& text) {
  const std::size_t end = std::min(text.find(' '), text.size());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(std::min(text.find_first_not_of(' ', end), text.size()));
  return word;
}

bool ParseTime(std::string_view word, std::int64_t& time_us) {
  if (word.size() < 4 || word.front() != '(' || word.back() != ')') return false;
  word = word.substr(1, word.size() - 2);
  const std::size_t dot = word.find('.');
  if (dot == std::string_view::npos || word.size() - dot - 1 != 6) return false;
  std::uint64_t seconds = 0;
  std::uint64_t microseconds = 0;
  if (!Number(word.substr(0, dot), seconds, 10) ||
      !Number(word.substr(dot + 1), microseconds, 10) || seconds > 1'000'000'000'000ULL) {
    return false;
  }
  time_us = static_cast<std::int64_t>(seconds * 1'000'000 + microseconds);
  return true;
}

// Null, and errno, where the file cannot be had; emptied only once it is ours.
std::FILE* OpenAlone(const std::string& path) {
  constexpr mode_t kMode = 0666;  // less the umask
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kMode);
  if (fd < 0) return nullptr;
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
    close(fd);
    errno = EBUSY;
    return nullptr;
  }
  [[maybe_unused]] const int emptied = ftruncate(fd, 0);  // a device has no length
  return fdopen(fd, "w");
}

}  // namespace

std::size_t FormatCandumpLine(const CanFrame& frame, std::string_view interface,
                              std::span<char, kCandumpLineBytes> line) {
  const auto time_us = static_cast<std::uint64_t>(std::max<std::int64_t>(frame.time_us, 0));
  const int size = std::min<int>(frame.size, 8);
  char* out = line.data();
  out = fmt::format_to(out, "({:010}.{:06}) {} ", time_us / 1'000'000, time_us % 1'000'000,
                       interface.substr(0, 15));
  if (frame.error) {
    out = fmt::format_to(out, "{:08X}#", (frame.id & 0x1FFF'FFFFU) | kErrorFlag);
  } else if (frame.extended) {
    out = fmt::format_to(out, "{:08X}#", frame.id & 0x1FFF'FFFFU);
  } else {
    out = fmt::format_to(out, "{:03X}#", frame.id & 0x7FFU);
  }
  if (frame.remote) {
    *out++ = 'R';
    if (size > 0) out = fmt::format_to(out, "{}", size);
  } else {
    for (int i = 0; i < size; ++i) out = fmt::format_to(out, "{:02X}", frame.data[i]);
  }
  *out++ = '\n';
  return static_cast<std::size_t>(out - line.data());
}

CandumpParse ParseCandumpLine(std::string_view line, CanFrame& frame) {
  CanFrame out;
  if (!ParseTime(Word(line), out.time_us) || Word(line).empty()) return CandumpParse::kMalformed;
  const std::string_view text = Word(line);
  const std::size_t hash = text.find('#');
  std::uint32_t id = 0;
  if ((hash != 3 && hash != 8) || !Number(text.substr(0, hash), id, 16)) {
    return CandumpParse::kMalformed;
  }
  if (hash == 3) {
    if (id > 0x7FF) return CandumpParse::kMalformed;
    out.id = id;
  } else {
    out.error = (id & kErrorFlag) != 0;
    out.extended = !out.error;
    out.id = id & 0x1FFF'FFFFU;
  }
  std::string_view rest = text.substr(hash + 1);
  if (rest.starts_with('#')) return CandumpParse::kFdFrame;
  if (rest.starts_with('R')) {
    out.remote = true;
    unsigned size = 0;
    if (rest.size() > 1 && (!Number(rest.substr(1), size, 10) || size > 8)) {
      return CandumpParse::kMalformed;
    }
    out.size = static_cast<std::uint8_t>(size);
  } else {
    // candump may append the raw length code of eight-byte frames: "_9".."_F".
    rest = rest.substr(0, rest.find('_'));
    if (rest.size() % 2 != 0 || rest.size() > 16) return CandumpParse::kMalformed;
    out.size = static_cast<std::uint8_t>(rest.size() / 2);
    for (std::size_t i = 0; i < out.size; ++i) {
      if (!Number(rest.substr(2 * i, 2), out.data[i], 16)) return CandumpParse::kMalformed;
    }
  }
  frame = out;
  return CandumpParse::kFrame;
}

CandumpLog ReadCandumpLog(std::istream& in) {
  CandumpLog log;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (line.empty()) continue;
    CanFrame frame;
    switch (ParseCandumpLine(line, frame)) {
      case CandumpParse::kFrame:
        log.frames.push_back(frame);
        break;
      case CandumpParse::kFdFrame:
        ++log.skipped;
        break;
      case CandumpParse::kMalformed:
        throw std::invalid_argument(
            fmt::format("line {}: '{}' is no candump log line, which looks like "
                        "'(1436509052.249713) vcan0 044#2A366C2BBA'",
                        number, line));
    }
  }
  return log;
}

CandumpWriter::CandumpWriter(const std::string& path, std::string_view interface)
    : interface_(interface), buffer_(kFileBufferBytes), file_(OpenAlone(path)) {
  if (!file_) throw std::system_error(errno, std::generic_category(), "log file '" + path + "'");
  std::setvbuf(file_.get(), buffer_.data(), _IOFBF, buffer_.size());
}

void CandumpWriter::Write(const CanFrame& frame) {
  std::array<char, kCandumpLineBytes> line;
  const std::size_t size = FormatCandumpLine(frame, interface_, line);
  good_ = std::fwrite(line.data(), 1, size, file_.get()) == size && good_;
  ++written_;
}

bool CandumpWriter::Flush() {
  good_ = std::fflush(file_.get()) == 0 && good_;
  return good_;
}

}  // namespace mantle::firmware_sim
