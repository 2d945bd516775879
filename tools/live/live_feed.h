#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "tools/live/live_frame.h"

/// From the messages of a run to what its viewers get:
///
///   receiver thread -> Write -> the instant that is being told, the newest one that is whole
///   every 40 ms     -> Publish -> one text for all viewers, the newest alone is kept
///   viewer threads  -> Next -> the newest that this viewer has not had
///
/// So work per message is a copy, work per viewer a write, and memory is bounded whatever comes:
/// one message of each type, one text, and kMostHistory_bytes of past rows for who comes later.

namespace mantle::tools {

inline constexpr std::size_t kMostHistory_bytes = 4'000'000;
/// Past rows are kept at least this far apart, the last ten minutes of them where they fit.
inline constexpr std::int64_t kHistory_us = 100'000;
inline constexpr std::size_t kMostHistory = 6'000;

class LiveFeed final : public TelemetrySink {
 public:
  using Clock = std::chrono::steady_clock;
  using Text = std::shared_ptr<const std::string>;

  // From the receiver's thread.
  void Write(const StateTelemetry& m) override { Keep(m, &LiveFrame::state); }
  void Write(const ReducedStateTelemetry&) override {}
  void Write(const PlanTelemetry& m) override;
  void Write(const DrivesTelemetry& m) override { Keep(m, &LiveFrame::drives); }
  void Write(const EnergyTelemetry& m) override { Keep(m, &LiveFrame::energy); }
  void Write(const StatusTelemetry& m) override { Keep(m, &LiveFrame::status); }
  void Write(const ShapeTelemetry& m) override;
  void Write(const ControlTelemetry& m) override { Keep(m, &LiveFrame::control); }
  void Write(const WaterTelemetry& m) override { Keep(m, &LiveFrame::water); }
  void Write(const SessionTelemetry& m) override;

  /// Makes the newest text where there is a newer instant, and puts `server`, what the server says
  /// of itself, into it where that has changed or a second has passed.
  void Publish(const Json& server, Clock::time_point now = Clock::now());

  /// As LiveSource::next. Null: nothing newer within `wait_ms`, or Close was called.
  Text Next(std::uint64_t* seen, int wait_ms);
  /// Nobody waits any more.
  void Close();

  struct Figures {
    std::uint64_t messages{0}, refused{0};  ///< refused: inconsistent in itself
    std::optional<double> age_s;            ///< since the last message; none: there was none yet
    /// How often time went back: another run, or the same log again.
    std::uint64_t restarts{0};
    std::optional<SessionTelemetry> session;  ///< of the last three seconds
    bool two_runs{false};                     ///< two processes said they were the run
  };
  Figures figures(Clock::time_point now = Clock::now()) const;

 private:
  template <typename Message>
  void Keep(const Message& m, std::optional<Message> LiveFrame::*slot);
  void Begin(std::int64_t utime);
  void Remember(const LiveFrame& frame);

  mutable std::mutex mutex_;
  std::condition_variable newer_;
  LiveFrame told_;                  ///< being told
  std::optional<LiveFrame> whole_;  ///< the newest that is whole, until it is published
  std::optional<PlanTelemetry> plan_;
  std::optional<SessionTelemetry> session_;
  Clock::time_point last_message_{}, last_session_{}, last_other_{}, last_server_{};
  std::uint64_t messages_{0}, refused_{0}, restarts_{0};
  std::uint64_t sequence_{1};  ///< 0 is a viewer that has had nothing
  bool any_{false}, closed_{false}, published_told_{false};
  std::deque<std::string> history_;
  std::size_t history_bytes_{0};
  std::int64_t remembered_us_{0};
  std::uint64_t frame_restarts_{0};
  std::string server_;
  /// Of which `sequence_` each is.
  struct Numbered {
    std::uint64_t sequence{0};
    Text text;
  };
  Numbered frame_text_, server_text_;
};

}  // namespace mantle::tools
