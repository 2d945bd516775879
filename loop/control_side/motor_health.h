#pragma once

#include <span>
#include <vector>

#include "controller/options.h"
#include "controller/winch_map.h"
#include "firmware_sim/master/drive_report.h"
#include "reduced/reduced_model.h"

namespace mantle::loop {

/// What one motor did in the period that ended, as its drive and its cable tell.
struct MotorEvidence {
  const firmware_sim::DriveReport* drive;  ///< of the last SYNC
  double command_n{0};                     ///< at the drum, at the last SYNC
  double reckoned_n{0};  ///< at the drum, from reel and cable length (TensionLoop::tension_n)
};

/// What the motors really pull, and which of them are lost.
///
/// A drive's reported torque M leaves the friction's direction open: at the drum the tension lies
/// in
///
///   [T(M, sigma = 1), T(M, sigma = -1)]   (winch_map.h, stiction included),
///
/// widened by a share of the motor's range for what inertia takes, command and reports averaged
/// over a tenth of a second. Reel and cable length give a second interval, K e of the tension loop
/// as far to either side. What was commanded counts as actual where it lies in both, and else the
/// nearest value that the first allows, or failing that the second.
///
/// A motor is lost, and gets no tension, while its drive is not enabled; and for good where it has
/// pulled less than a third of a command above a tenth of its range for kDead_s, or where the
/// estimator says for as long that it pulls less than commanded by all that the estimate may say.
class MotorHealth {
 public:
  static constexpr double kDead_s = 0.3;
  static constexpr double kSaturated_s = 1.0;

  /// `gain_square`: G of every motor. Throws nothing.
  MotorHealth(const controller::WinchMap& map, const std::vector<controller::MotorLimits>& limits,
              std::vector<double> gain_square, double period_s);

  /// Every SYNC. No allocation.
  void Update(std::span<const MotorEvidence> evidence);
  /// What the estimator makes of the motors: bias of their tensions, and the most it may be (both
  /// per unit gain), negative where a motor pulls too little. For a period.
  void UpdateBias(const model::VectorX& bias_n, double most_share);

  /// Actual less commanded tension at the last SYNC [N, per unit gain]; zero where the commanded
  /// one agrees with the reports.
  const model::VectorX& missing_n() const { return missing_; }
  bool lost(int motor) const { return states_[static_cast<std::size_t>(motor)].lost(); }
  int lost_count() const;
  /// The motors' limits, those of lost ones at zero.
  const std::vector<controller::MotorLimits>& limits() const { return limits_; }
  /// Limits have changed since the last Update began.
  bool changed() const { return changed_; }

 private:
  struct State {
    bool disabled{false}, dead{false}, saturated{false};
    double dead_s{0}, saturated_s{0};
    bool fresh{true};  ///< the means begin with the next command
    double command_n{0}, reckoned_n{0}, least_n{0}, most_n{0};
    bool lost() const { return disabled || dead || saturated; }
  };
  void SetLimits();

  controller::WinchMap map_;
  std::vector<controller::MotorLimits> given_, limits_;
  std::vector<double> gain_square_;
  double period_s_;
  std::vector<State> states_;
  model::VectorX missing_;
  bool changed_{false};
};

}  // namespace mantle::loop
