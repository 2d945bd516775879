#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/mantle/telemetry.h"

/// Telemetry on LCM (docs/telemetry.md): to and from a network, to and from event logs. The one
/// file behind this header includes LCM.
///
/// An event of a log (all big-endian): sync word 0xEDA1DA01, event number (8 bytes), time in us
/// (8), length of the channel's name (4), length of the message (4), name, message. The time is the
/// message's own utime, never the wall clock's: the same run gives the same bytes. Logs are read
/// and written here and not by liblcm, which allocates what a header claims and hears of a full
/// disk when the log is closed.

namespace mantle::tools {

/// A message and its channel's name fit into one UDP datagram (65 507 bytes) with LCM's header.
inline constexpr std::size_t kMaxMessage_bytes = 65'000;

inline constexpr const char* kTelemetryLogName = "telemetry.lcmlog";
inline constexpr const char* kLcmUrlHelp =
    "udpm://GROUP:PORT?ttl=N, e.g. udpm://239.255.76.67:7667?ttl=0 (ttl=0 stays on this machine)";

struct LcmOptions {
  /// An event log in this folder, which exists; none where it is not given.
  std::optional<std::filesystem::path> log_folder{};
  std::string log_name{kTelemetryLogName};
  /// Publishes there at once; empty: nowhere. memq:// is a queue within this link.
  std::string url{};
  /// Hears the channels of the URL, from the opening on; this link's own messages too.
  bool receive{false};
  /// Of the channels, these alone; all where it is empty.
  std::vector<std::string> channels{};
  /// So many messages of each channel wait until they are received; further ones are lost. As many
  /// as a burst of a replay at full speed has.
  int queued_messages{10'000};
};

struct LcmCounters {
  std::uint64_t written{0};           ///< messages to the log, to the network, or both
  std::uint64_t publish_failures{0};  ///< that the network refused
  std::uint64_t received{0};          ///< handed out by Receive
  std::uint64_t malformed{0};         ///< on our channels, but not of our types
};

/// Write encodes a message, appends it to the log and publishes it. It allocates nothing for the
/// log once it has seen a message of that size (liblcm itself allocates for the network). Throws
/// std::invalid_argument where lists that belong together differ in length or a text holds a zero
/// byte, BadInput where a message exceeds kMaxMessage_bytes: both are decided by the scene;
/// CannotGoOn where the disk takes no more.
class LcmLink : public TelemetrySink {
 public:
  /// Waits up to `timeout_ms` for a message, hands it and all that wait behind it to `to`; returns
  /// their number. Needs LcmOptions::receive. What `to` throws comes out of here.
  virtual int Receive(int timeout_ms, TelemetrySink& to) = 0;

  /// Starts a log in this folder, which exists; replaces one that is there. `begin`, whole events
  /// numbered from 0, is what it goes on from. Throws BadInput, CannotGoOn.
  virtual void StartLog(const std::filesystem::path& folder, std::string_view begin = {}) = 0;
  /// The system has all of the log so far; returns its size. Throws CannotGoOn.
  virtual long FlushLog() = 0;
  /// The disk has the log. Throws CannotGoOn where it has not.
  virtual void FinishLog() = 0;

  virtual const LcmCounters& counters() const = 0;
};

/// Throws BadInput: a log that cannot be written; a URL that is none, or that this machine cannot
/// open or hear.
std::unique_ptr<LcmLink> OpenLcm(const LcmOptions& options);

/// Valid during the call that hands it out.
struct LogEvent {
  std::int64_t time_us{0};
  std::string_view channel;
  std::span<const std::uint8_t> bytes;
};

struct LogEnd {
  std::int64_t events{0};
  /// Of a log that is cut short or damaged: where the last event handed out ends.
  std::optional<std::int64_t> damaged_at_byte;
};

/// No event of a log is longer; what claims to be is damage.
inline constexpr std::int64_t kMaxEvent_bytes = 64 << 20;

/// Hands out the events of a log in order until its end or the first damage: a header without its
/// sync word, or lengths beyond the end of the file or kMaxEvent_bytes. Allocates what an event
/// holds, never what it claims. Throws BadInput where the file is no regular one or cannot be read.
LogEnd ReadEventLog(const std::filesystem::path& file,
                    const std::function<void(const LogEvent&)>& on_event);

/// Decodes a message of ours into `to`. False: not a channel of ours, or not of its type, or with a
/// count or a length that does not fit into the message; `why`, where not null, then says which.
/// Allocates nothing before every length has been checked.
bool DecodeTelemetry(std::string_view channel, std::span<const std::uint8_t> bytes,
                     TelemetrySink& to, const char** why = nullptr);

}  // namespace mantle::tools
