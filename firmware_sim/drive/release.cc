#include "firmware_sim/drive/release.h"

#include <algorithm>

#include "firmware_sim/canopen/motor_data.h"

namespace mantle::firmware_sim {
namespace {

constexpr double kCountsPerMetre =
    WinchData{}.counts_per_turn * WinchData{}.gear_ratio / (1e-6 * WinchData{}.feed_um_per_turn);
constexpr double kPayOutSpeed_counts_s = kPayOutSpeed_m_s * kCountsPerMetre;

}  // namespace

void Release::Enter(ReleasePhase phase, std::int64_t time_us) {
  phase_ = phase;
  since_us_ = time_us;
}

void Release::Begin(ReleaseKind kind, const Motion& motion, std::int64_t time_us) {
  if (phase_ == ReleasePhase::kBraked) return;
  // A second cause may hasten a release under way, never hold it up.
  if (phase_ != ReleasePhase::kInactive && kind != ReleaseKind::kOpenWinding) return;
  // Slack now may be a ramp's ringing: wait, but pay out only a cable that is seen taut.
  if (phase_ == ReleasePhase::kInactive) last_taut_us_ = time_us - kPayOutMargin_us - 1;
  winding_open_ = kind == ReleaseKind::kOpenWinding;
  if (winding_open_) {
    if (phase_ != ReleasePhase::kPayingOut) Enter(ReleasePhase::kPayingOut, time_us);
    return;
  }
  torque_ = motion.torque();
  Enter(kind == ReleaseKind::kDecelerate ? ReleasePhase::kDecelerating : ReleasePhase::kRamping,
        time_us);
}

StageCommand Release::Tick(const ObjectDictionary& objects, const ReleaseInputs& inputs,
                           Motion& motion, std::int64_t time_us) {
  if (!inputs.slack) last_taut_us_ = time_us;
  if (holds_torque() && !inputs.stage_ok) Enter(ReleasePhase::kPayingOut, time_us);
  if (phase_ == ReleasePhase::kDecelerating) {
    const bool late = time_us - since_us_ > kDecelerationTimeout_us;
    if (inputs.encoder_ok && !late && !motion.at_standstill()) {
      torque_ = motion.Tick(objects, inputs.measured, StopKind::kQuick);
      return {true, false, torque_};
    }
    Enter(ReleasePhase::kRamping, time_us);
  }
  if (phase_ == ReleasePhase::kRamping) {
    if (time_us - since_us_ > kRampTimeout_us) torque_ = 0.0;
    const StageCommand command = Ramp(objects);
    if (torque_ == 0.0) {
      Enter(ReleasePhase::kPayingOut, time_us);
      motion.Start(OperationMode::kCyclicVelocity, inputs.measured, 0.0);
    }
    return command;
  }
  if (phase_ == ReleasePhase::kPayingOut) {
    const bool late = time_us - since_us_ > kPayOutTimeout_us;
    const bool follows = time_us - last_taut_us_ < kStaysSlack_us;
    if (follows && !late) return PayOut(inputs, motion, time_us);
    Enter(ReleasePhase::kBraked, time_us);
  }
  return {false, true, 0.0};
}

StageCommand Release::Ramp(const ObjectDictionary& objects) {
  const double step = static_cast<double>(objects.Number(Slot(object::kTorqueSlope))) * 1e-6 *
                      static_cast<double>(kControlTick_us);
  torque_ = torque_ > 0.0 ? std::max(0.0, torque_ - step) : std::min(0.0, torque_ + step);
  return {true, false, torque_};
}

StageCommand Release::PayOut(const ReleaseInputs& inputs, Motion& motion, std::int64_t time_us) {
  const bool waits = time_us - last_taut_us_ > kPayOutMargin_us;
  if (winding_open_ || waits || !inputs.stage_ok) return {false, false, 0.0};
  if (!inputs.encoder_ok) return {true, false, -kBlindPayOutTorque};
  return {true, false, motion.TickPayOut(-kPayOutSpeed_counts_s, inputs.measured, kPayOutTorque)};
}

}  // namespace mantle::firmware_sim
