#pragma once

#include <cstdint>

#include "firmware_sim/canopen/object_dictionary.h"
#include "firmware_sim/drive/motion.h"

namespace mantle::firmware_sim {

/// Paying out: 50 mm/s of cable, and for a moment longer than the cable is taut.
inline constexpr double kPayOutSpeed_m_s = 0.05;
inline constexpr std::int64_t kPayOutMargin_us = 50'000;
inline constexpr std::int64_t kStaysSlack_us = 500'000;
inline constexpr std::int64_t kPayOutTimeout_us = 5'000'000;
/// Largest torque that pushes cable out [1/1000 of rated]: some four times the static friction.
inline constexpr double kPayOutTorque = 150.0;
/// Without an encoder: half as much again as the static friction, open loop.
inline constexpr double kBlindPayOutTorque = 52.0;
/// Longest deceleration, and longest ramp of the torque: however flat 6085 and 6087 are, the torque
/// is gone after that.
inline constexpr std::int64_t kDecelerationTimeout_us = 1'000'000;
inline constexpr std::int64_t kRampTimeout_us = 1'000'000;

enum class ReleaseKind : std::uint8_t {
  kOpenWinding,  ///< torque gone at once
  kTorqueRamp,   ///< by 6087
  kDecelerate,   ///< by 6085, then as kTorqueRamp
};

enum class ReleasePhase : std::uint8_t { kInactive, kDecelerating, kRamping, kPayingOut, kBraked };

/// What a Release decides by.
struct ReleaseInputs {
  Measured measured{};
  bool slack{false};    ///< slack-rope switch
  bool stage_ok{true};  ///< the power stage may be used
  bool encoder_ok{true};
};

/// What the power stage is told.
struct StageCommand {
  bool powered{false};
  bool brake_closed{true};
  double torque{0.0};  ///< 1/1000 of rated
};

/// How a cable winch lets go. A brake that closes on a taut cable keeps the arm bent, so whatever
/// takes the drive out of operation runs the same sequence:
///
///   [decelerate by 6085, 1 s at most] -> ramp the torque to zero by 6087, 1 s at most -> pay out
///   until the slack-rope switch has stayed open for 0.5 s, 5 s at most -> brake closed, stage off
///
/// The cable goes slack long before a soft body has straightened: the winch follows it, paying out
/// again as often as the switch closes.
///
/// Where the power stage must not be used (over-current, supply out of range) or disable voltage
/// was commanded, the winding is open from the start and the cable pulls itself out.
class Release {
 public:
  ReleasePhase phase() const { return phase_; }
  /// The torque may still be other than what paying out needs.
  bool holds_torque() const {
    return phase_ == ReleasePhase::kDecelerating || phase_ == ReleasePhase::kRamping;
  }

  /// Starts from the torque `motion` applies now; where the brake is closed already, does nothing.
  void Begin(ReleaseKind kind, const Motion& motion, std::int64_t time_us);
  /// The drive was enabled again.
  void Cancel() { phase_ = ReleasePhase::kInactive; }

  StageCommand Tick(const ObjectDictionary& objects, const ReleaseInputs& inputs, Motion& motion,
                    std::int64_t time_us);

 private:
  void Enter(ReleasePhase phase, std::int64_t time_us);
  StageCommand Ramp(const ObjectDictionary& objects);
  StageCommand PayOut(const ReleaseInputs& inputs, Motion& motion, std::int64_t time_us);

  ReleasePhase phase_{ReleasePhase::kBraked};
  std::int64_t since_us_{0};
  std::int64_t last_taut_us_{0};
  double torque_{0.0};
  bool winding_open_{false};
};

}  // namespace mantle::firmware_sim
