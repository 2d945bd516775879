#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/bus/socket_time.h"
#include "firmware_sim/master/master.h"
#include "tests/firmware_sim/rig.h"

/// A master on the wall clock, as a program that controls drives runs it.

namespace mantle::firmware_sim {

/// Options for tests that ask for something else than time-outs: patience with a machine that has
/// more work than processors, where everybody may stand still for some 100 ms.
inline MasterOptions PatientNodesOneTo(int count) {
  MasterOptions options = NodesOneTo(count);
  options.supervisor.settings.rpdo_timeout_us = 1'000'000;
  options.supervisor.settings.master_silence_us = 2'000'000;
  options.supervisor.heartbeat_loss_us = 3'000'000;
  return options;
}

class RealTimeMaster {
 public:
  RealTimeMaster(const std::string& spec, const MasterOptions& options)
      : bus(OpenBus(spec, nullptr, Master::Filters())),
        master(*bus, options),
        period_us_(options.supervisor.settings.period_us),
        next_cycle_us_(MonotonicTime_us()) {}

  void Enable() { master.Enable(MonotonicTime_us()); }
  void Stop() { master.Stop(MonotonicTime_us()); }

  /// Cycles on a fixed grid, polls whenever a frame is there.
  bool RunUntil(const std::function<bool()>& done, std::int64_t limit_us) {
    const std::int64_t end_us = MonotonicTime_us() + limit_us;
    for (std::int64_t now_us = MonotonicTime_us(); now_us < end_us; now_us = MonotonicTime_us()) {
      master.Poll(now_us);
      if (!complete_ && master.CycleComplete()) {
        complete_ = true;
        if (measure) answer_us.push_back(now_us - cycle_us_);
      }
      if (done()) return true;
      if (now_us >= next_cycle_us_) {
        if (measure) late_us.push_back(now_us - next_cycle_us_);
        master.Cycle(now_us);
        cycle_us_ = now_us;
        complete_ = false;
        // Cycles that were slept through are left out: a burst of them would help nobody.
        while (next_cycle_us_ <= now_us) next_cycle_us_ += period_us_;
      }
      bus->Wait(std::clamp<std::int64_t>(next_cycle_us_ - MonotonicTime_us(), 0, kPoll_us));
    }
    return done();
  }
  void RunFor(std::int64_t span_us) {
    RunUntil([] { return false; }, span_us);
  }
  bool RunUntilEnabled(std::int64_t limit_us = 10'000'000) {
    return RunUntil([this] { return master.enabled(); }, limit_us);
  }

  std::unique_ptr<Bus> bus;
  Master master;
  bool measure{false};
  std::vector<std::int64_t> answer_us;  ///< from sending a cycle to the last TPDO1 read
  std::vector<std::int64_t> late_us;    ///< of a cycle against its grid

 private:
  // The master's own clock: heartbeats and time-outs are looked at this often.
  static constexpr std::int64_t kPoll_us = 5'000;
  std::int64_t period_us_;
  std::int64_t next_cycle_us_;
  std::int64_t cycle_us_{0};
  bool complete_{true};
};

}  // namespace mantle::firmware_sim
