#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "controller/winch_map.h"
#include "firmware_sim/master/master.h"
#include "loop/messages.h"
#include "loop/options.h"

namespace mantle::loop {

/// Before t = 0, from what the drives report alone: boot, configuration, enabling, and the end of
/// every cable's slack, found as a commissioning tool would find it: haul until the torque says
/// that the cable pulls. Where a reel at x, sliding at v, says a tension T, the slack ended at x -
/// (T - D v) / K; the mean over some reports is taken. Then the reel goes to where the cable pulls
/// with the pretension, and holds it by torque.
///
///   for (BringUp up(master, winch, drives); !up.done(); )
///     up.Turn(now_us), and unless it failed or is done: a SYNC period
class BringUp {
 public:
  /// `master` must outlive it.
  BringUp(firmware_sim::Master& master, const controller::WinchMap& winch,
          const DriveOptions& drives);

  /// Before every SYNC, at its time: looks at what the last one brought and sets the targets of the
  /// next. `cables`, one per motor, where the vehicle is not at its start, where all lengths are
  /// zero: the slack's end is then told as it would be there. Empty: it is. The reason of a failure
  /// names the drive.
  Status Turn(std::int64_t now_us, std::span<const CableReading> cables = {});
  /// From the beginning, wherever the drives are.
  void Restart();
  bool done() const { return phase_ == Phase::kDone; }
  /// Reported position where the slack of motor i ended; 0 until it was found.
  double zero_counts(int i) const { return zero_counts_[static_cast<std::size_t>(i)]; }

 private:
  enum class Phase : std::uint8_t { kBoot, kEnabling, kHauling, kSettling, kHolding, kDone };
  struct Search {
    int reports{0};
    double sum_counts{0};
    double last_rate_m_s{0};
  };

  Status CheckDrives() const;
  double Counts(double metres) const { return metres / winch_.metres_per_count; }
  void Enter(Phase phase, std::int64_t now_us);
  void Haul(std::int64_t now_us, std::span<const CableReading> cables);
  void GoToPretension(std::span<const CableReading> cables);
  void HoldPretension();

  firmware_sim::Master& master_;
  controller::WinchMap winch_;
  DriveOptions drives_;
  double haul_m_s_;
  Phase phase_{Phase::kBoot};
  std::int64_t begin_us_{0};  ///< of the phase
  std::vector<Search> searches_;
  bool found_{false};  ///< the end of every slack
  std::vector<double> zero_counts_;
};

}  // namespace mantle::loop
