#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "tools/mantle/lcm_bridge.h"

/// The button "record": what is heard, as telemetry.lcmlog in a folder of its own, to be looked at
/// by `mantle report` like a run's.

namespace mantle::tools {

/// A recording ends by itself beyond this.
inline constexpr std::uint64_t kMostRecord_messages = 20'000'000;

class Recorder final : public TelemetrySink {
 public:
  /// Folders are made in `parent`, named by the wall clock's time.
  explicit Recorder(std::filesystem::path parent) : parent_(std::move(parent)) {}
  ~Recorder() override;

  /// The first message of every sample: a time that goes back is another run's.
  void Write(const StateTelemetry& m) override;
  void Write(const ReducedStateTelemetry& m) override { Keep(m); }
  void Write(const PlanTelemetry& m) override { Keep(m); }
  void Write(const DrivesTelemetry& m) override { Keep(m); }
  void Write(const EnergyTelemetry& m) override { Keep(m); }
  void Write(const StatusTelemetry& m) override { Keep(m); }
  void Write(const ShapeTelemetry& m) override { Keep(m); }
  void Write(const ControlTelemetry& m) override { Keep(m); }
  void Write(const WaterTelemetry& m) override { Keep(m); }
  void Write(const SessionTelemetry& m) override { Keep(m); }
  void Write(const SensorsTelemetry& m) override { Keep(m); }
  void Write(const CommandTelemetry& m) override { Keep(m); }
  void Write(const CycleTelemetry& m) override { Keep(m); }

  /// Begins or ends a recording. From any thread, as what follows.
  void Toggle();
  /// Ends one that is going on, with a reason for the viewers; else does nothing.
  void Finish(const std::string& why = {});

  struct Figures {
    bool on{false};
    std::string folder;  ///< of this recording, or of the last one
    std::uint64_t messages{0};
    std::string note;  ///< why the last one ended, where nobody asked it to
  };
  Figures figures() const;

 private:
  template <typename Message>
  void Keep(const Message& message);
  void Begin();
  void End(const std::string& why);

  const std::filesystem::path parent_;
  mutable std::mutex mutex_;
  std::unique_ptr<LcmLink> log_;
  Figures figures_;
  std::int64_t state_us_{0};
};

}  // namespace mantle::tools
