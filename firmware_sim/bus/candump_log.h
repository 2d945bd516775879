#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <iosfwd>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_sim/bus/can_frame.h"

namespace mantle::firmware_sim {

/// No line needs more characters than this, with an interface name of 15.
inline constexpr std::size_t kCandumpLineBytes = 80;

/// Writes `frame` with a line feed and returns the number of characters; does not allocate. A
/// negative time is written as 0; of the interface name 15 characters are used.
std::size_t FormatCandumpLine(const CanFrame& frame, std::string_view interface,
                              std::span<char, kCandumpLineBytes> line);

enum class CandumpParse : std::uint8_t { kFrame, kFdFrame, kMalformed };

/// Reads one line (without its line feed, trailing direction letters allowed).
CandumpParse ParseCandumpLine(std::string_view line, CanFrame& frame);

/// The log format of `candump -l`, which canplayer and log2asc of can-utils read: a frame a line,
///
///   (1436509052.249713) vcan0 044#2A366C2BBA     seconds.microseconds, interface, id#data
///   (1436509052.249800) vcan0 1F334455#1122      29-bit ids have eight digits
///   (1436509052.249900) vcan0 701#R              remote frame; #R4 with a length
///   (1436509052.250000) vcan0 20000080#00000000000000A0   error frame: CAN_ERR_FLAG in the id
struct CandumpLog {
  std::vector<CanFrame> frames;
  std::size_t skipped{0};  ///< CAN FD frames: not for classic stations
};

/// Throws std::invalid_argument with the line number where a line is no log line. Empty lines are
/// passed over.
CandumpLog ReadCandumpLog(std::istream& in);

/// Writes frames to a log file, which is this process's alone while it does (flock). After
/// construction nothing throws or allocates.
class CandumpWriter {
 public:
  /// Empties the file. Throws std::system_error where `path` cannot be created or another process
  /// writes it.
  CandumpWriter(const std::string& path, std::string_view interface);

  void Write(const CanFrame& frame);
  /// Returns false once any write has failed (disk full).
  bool Flush();
  /// False once a write has failed that was handed to the system so far.
  bool good() const { return good_; }
  std::uint64_t written() const { return written_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string interface_;
  std::vector<char> buffer_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t written_{0};
  bool good_{true};
};

}  // namespace mantle::firmware_sim
