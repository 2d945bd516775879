#pragma once

#include <cstdint>

#include "firmware_sim/canopen/cia402.h"
#include "firmware_sim/canopen/object_dictionary.h"

namespace mantle::firmware_sim {

inline constexpr std::int64_t kControlTick_us = 1000;
/// Below this a motor stands still: 4 mm/s of cable, some two counts a tick.
inline constexpr double kStandstill_counts_s = 1000.0;

enum class StopKind : std::uint8_t {
  kNone,    ///< follow the targets
  kRamp,    ///< by 6084 (10: by 6087)
  kQuick,   ///< by 6085 (10: by 6087)
  kAtOnce,  ///< velocity demand (10: torque) zero at once
};

/// The motor as its encoder shows it, at the motor shaft.
struct Measured {
  double position_counts{0.0};
  double velocity_counts_s{0.0};
  double load_counts_s2{0.0};  ///< acceleration that cable and friction give
};

/// The observer.
class EncoderTracker {
 public:
  EncoderTracker() = default;
  /// At rest at `counts`.
  explicit EncoderTracker(std::int64_t counts)
      : measured_{static_cast<double>(counts) + 0.5, 0.0, 0.0} {}
  /// One tick, with the torque of the tick before it [1/1000 of rated].
  void Update(std::int64_t counts, double torque);
  const Measured& measured() const { return measured_; }

 private:
  Measured measured_{};
};

/// Set-points and loops of an enabled drive, once a millisecond: from targets and the encoder to a
/// torque. Positive reels in. Torques are in 1/1000 of the rated torque, positions in counts.
///
///   cyclic torque    torque = 6071 + 60B2
///   cyclic velocity  demand runs linearly to 60FF within the period 60C2;
///                    torque = J (w_v (demand - v) - l) + 60B2
///   cyclic position  demand runs linearly to 607A within 60C2; velocity demand =
///                    k_x (demand - x) + d(demand)/dt, then as cyclic velocity
///   stopping         8, 9: velocity runs to zero by a deceleration, then the position is held;
///                    10: torque runs to zero by 6087
///
/// Always: |torque| <= 6072, no torque and no velocity beyond the limits 607D. Position x, velocity
/// v and load l (cable and friction, as an acceleration) come from an observer that knows the
/// torque, with three poles at w: e = counts - x,
///
///   x' = v + 3 w e,   v' = torque / J + l + 3 w^2 e,   l' = w^3 e
class Motion {
 public:
  /// Starts from what is measured, at `torque` (bumpless).
  void Start(OperationMode mode, const Measured& now, double torque);

  /// New targets came (a SYNC, or an SDO write): the demand runs to them within 60C2.
  void OnTargets(const ObjectDictionary& objects);

  /// One control tick; returns the torque.
  double Tick(const ObjectDictionary& objects, const Measured& now, StopKind stop);

  /// One control tick of paying out at a velocity demand (below zero): the torque stays within
  /// -max_torque and zero, so that it never holds the cable back.
  double TickPayOut(double demand_counts_s, const Measured& now, double max_torque);

  double torque() const { return torque_; }
  OperationMode mode() const { return mode_; }
  bool limited() const { return limited_; }
  /// Demand minus actual in mode 8 [counts], else zero.
  double following_error() const { return following_error_; }
  /// Stopped: the velocity demand (10: the torque) reached zero.
  bool at_standstill() const { return at_standstill_; }

 private:
  double PositionTick(const Measured& now);
  double VelocityTick(const ObjectDictionary& objects, const Measured& now);
  double StopTick(const ObjectDictionary& objects, const Measured& now, StopKind stop);
  static double VelocityLoop(double demand, const Measured& now);
  double ClipTorque(const ObjectDictionary& objects, const Measured& now, double torque);

  OperationMode mode_{OperationMode::kCyclicTorque};
  double demand_position_{0.0};
  double demand_velocity_{0.0};
  double goal_position_{0.0};
  double goal_velocity_{0.0};
  int ticks_to_goal_{0};
  double torque_{0.0};
  double following_error_{0.0};
  bool stopping_{false};
  bool limited_{false};
  bool at_standstill_{false};
};

}  // namespace mantle::firmware_sim
