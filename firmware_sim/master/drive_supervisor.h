#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "firmware_sim/canopen/frame_batch.h"
#include "firmware_sim/canopen/sdo_client.h"
#include "firmware_sim/master/drive_configuration.h"
#include "firmware_sim/master/drive_report.h"

namespace mantle::firmware_sim {

/// What an object of a drive has to hold before the master enables it.
struct ExpectedObject {
  SdoObject object{};
  std::uint32_t value{0};
};

/// How patient the master is with a drive, and what it takes for one of its own.
struct SupervisorOptions {
  DriveSettings settings{};
  /// Read after 1000 and 1018 (each as one more SDO): a drive that holds another value is refused
  /// (DriveProblem::kWrongDevice).
  std::vector<ExpectedObject> expected{};
  std::int64_t sdo_timeout_us{50'000};
  int sdo_attempts{5};
  std::int64_t step_timeout_us{2'000'000};  ///< start, clear fault, enable, each stop step
  std::int64_t heartbeat_loss_us{350'000};  ///< drive silent for this long is lost
  std::int16_t rest_torque_permille{20};    ///< below it a ramp has ended
};

/// The master's half of one drive: brings it from power-on to operation enabled, keeps it there,
/// notices what it does by itself, and takes it down.
///
///   identify -> configure -> start -> (clear fault ->) enable -> enabled -> stop ramp -> stop
///      ^            boot-up message: from anywhere         |        disable -> stop NMT -> stopped
///      +---------------------------------------------------+
///
/// What stops it: a fault (until Enable), a missing heartbeat (until it is back), an SDO without
/// answer or refused, a step that takes too long (until a boot-up, or Enable). A drive that is
/// not enabled gets controlwords that never enable it and targets at rest. Time is an input;
/// nothing throws or allocates after construction.
class DriveSupervisor {
 public:
  /// Options have passed CheckSettings.
  DriveSupervisor(NodeId node, const SupervisorOptions& options);

  /// What the drive shall do. Enable also clears a fault and begins anew after a failure; its
  /// targets are at rest until SetTarget: no torque, no velocity, the position it is at.
  void Enable(std::int64_t now_us);
  void Stop(std::int64_t now_us);
  void SetTarget(const DriveTarget& target);
  void SetMode(OperationMode mode) { mode_ = mode; }

  /// Takes a frame of this node: TPDO, SDO reply, EMCY or heartbeat.
  void OnFrame(const CanFrame& frame, std::int64_t now_us);

  /// What is due between the cycles: SDOs, NMT commands, time-outs.
  void Advance(std::int64_t now_us, FrameBatch& out);

  /// Just before a SYNC: counts what the last one brought, adds this cycle's RPDOs.
  void Cycle(std::int64_t now_us, FrameBatch& out);

  const DriveReport& report() const { return report_; }
  /// A TPDO1 has come since the last SYNC, or none was due.
  bool complete() const { return !was_synced_ || answers_ > 0; }

 private:
  enum class Goal : std::uint8_t { kReady, kEnabled, kStopped };

  void EnterStep(DriveStep step, std::int64_t now_us);
  void Fail(DriveProblem problem, DriveStep next, std::int64_t now_us);
  void Restart(std::int64_t now_us);
  bool TakesRpdos() const;

  void OnHeartbeat(const CanFrame& frame, std::int64_t now_us);
  void OnBootUp(std::int64_t now_us);
  void OnStatusword(std::int64_t now_us);
  void AdvanceIdentify(std::int64_t now_us, FrameBatch& out);
  void AdvanceConfigure(std::int64_t now_us, FrameBatch& out);
  void AdvanceExamine(std::int64_t now_us, FrameBatch& out);
  void AdvanceNmt(NmtCommand command, std::int64_t now_us, FrameBatch& out);
  /// True where the SDO of this step ended badly and the step with it.
  bool SdoFailed(SdoResult result, std::int64_t now_us);
  void CheckTimes(std::int64_t now_us);

  std::uint16_t Controlword();

  SupervisorOptions options_;
  DriveReport report_;
  SdoClient sdo_;
  Goal goal_{Goal::kReady};
  OperationMode mode_;
  DriveTarget target_{};
  bool target_set_{false};
  std::size_t sub_step_{0};  ///< of identify and configure
  std::int64_t step_begin_us_{0};
  std::int64_t nmt_sent_us_{0};
  bool nmt_sent_{false};
  bool supervised_{false};  ///< heartbeats are expected
  bool was_synced_{false};  ///< operational at the last SYNC
  int answers_{0};          ///< TPDO1 since the last SYNC
  int syncs_in_window_{0};
  int answers_in_window_{0};
  int at_rest_{0};  ///< cycles without torque in the stop ramp
  bool reset_bit_{false};
};

}  // namespace mantle::firmware_sim
