#pragma once

#include <cstdint>

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/canopen/canopen_node.h"
#include "firmware_sim/canopen/cia402.h"
#include "firmware_sim/canopen/motor_data.h"
#include "firmware_sim/canopen/state_machine.h"
#include "firmware_sim/drive/motion.h"
#include "firmware_sim/drive/power_stage.h"
#include "firmware_sim/drive/release.h"
#include "firmware_sim/drive/winch.h"

namespace mantle::firmware_sim {

/// What a drive is built with.
struct DriveConfig {
  NodeId node{1};
  /// The spring-loaded cable of a drive without a plant: 20 mm of slack, then 500 N/m.
  CableLoad cable{0.0, 500.0, 0.02};
};

/// What can be broken, by Drive::Disturb or by a client through object 2201.
enum class Disturbance : std::uint8_t {
  kNone = 0,
  kWindingShort = 1,
  kEncoderBroken = 2,
  kOverVoltage = 3,
  kUnderVoltage = 4,
  kHotSurroundings = 5,
  kJammed = 6,  ///< the drum does not turn
};

/// What the plant gets from a drive.
struct WinchOutput {
  double reeled_m{0.0};
  double rate_m_s{0.0};
  double tension_n{0.0};     ///< that the drum felt over the last sub-step
  double cable_work_j{0.0};  ///< done on the cable since construction
};

/// One drive: CANopen node, CiA 402 state machine, loops, power stage, motor and winch.
///
/// It advances on its own clock: AdvanceTo runs the sub-steps of 0.1 ms (current regulator, motor,
/// winch) and the ticks of 1 ms (loops, supervision, heartbeat) up to a time, whatever the bus
/// does. A frame only leaves targets and commands; SYNC latches RPDOs and samples TPDOs. Frames to
/// send wait in a queue. Nothing here allocates or throws after construction.
class Drive {
 public:
  /// Powers up at `start_us`: the boot-up message waits in the queue. Throws std::invalid_argument
  /// for a node outside 1..126 and for a cable that SetCable refuses.
  Drive(const DriveConfig& config, std::int64_t start_us);

  /// Takes a frame that was on the bus at `time_us` (advances to it first).
  void OnFrame(const CanFrame& frame, std::int64_t time_us);
  void AdvanceTo(std::int64_t time_us);
  /// Takes the next frame to send; false where there is none.
  bool TakeFrame(CanFrame& frame) { return node_.TakeFrame(frame); }

  /// The cable around the plant's present state; refused (false) where it is not finite or its
  /// stiffness or damping is negative, the last one then stays.
  bool SetCable(const CableLoad& cable);
  void SetSupply(double supply_v) { supply_v_ = supply_v; }
  void SetAmbient(double ambient_c) { ambient_c_ = ambient_c; }
  void Disturb(Disturbance disturbance);

  WinchOutput output() const {
    return {winch_.reeled_m(), winch_.rate_m_s(), winch_.tension_n(), winch_.energy().cable_j};
  }
  DriveState state() const { return state_; }
  NmtState nmt_state() const { return node_.state(); }
  bool brake_closed() const { return stage_command_.brake_closed; }
  /// What the loops ask of the power stage [1/1000 of rated torque].
  double demanded_torque() const { return stage_command_.powered ? stage_command_.torque : 0.0; }
  const Winch& winch() const { return winch_; }
  const ObjectDictionary& objects() const { return node_.objects(); }
  std::int64_t now_us() const { return now_us_; }
  std::uint64_t frames_dropped() const { return node_.frames_dropped(); }

 private:
  // drive.cc: the clock, the motor.
  void SubStep();
  void Tick();
  void TickEncoder();
  void TickMotion();
  void FinishQuickStop(const Measured& measured);
  void RefreshObjects();
  std::uint16_t Statusword() const;
  StopKind WantedStop() const;
  ReleaseInputs GatherInputs() const;

  // drive_commands.cc: what frames ask for.
  void OnNmt(NmtCommand command);
  void OnSync();
  void OnSdoWrite(std::size_t slot);
  void OnControlword();
  void Enter(const Transition& transition);
  void FinishReset();

  // drive_supervision.cc: faults.
  void Supervise();
  bool Trips(EmcyCode code);
  bool Lasts(EmcyCode code);
  void OnFault(EmcyCode code);
  bool StageMayRun() const;
  void ResetFault();
  double Supply_v() const;
  double Ambient_c() const;

  /// From the end of the torque to the boot-up message of a reset: a processor starts.
  static constexpr std::int64_t kStartUpTime_us = 5'000;
  static constexpr MotorData kMotor{};
  static constexpr WinchData kWinch{};
  static constexpr PowerStageData kStage{};

  CanopenNode node_;
  Winch winch_;
  Surroundings around_{};
  CurrentRegulator regulator_;
  EncoderTracker tracker_;
  Motion motion_;
  Release release_;
  StageCommand stage_command_{};
  DriveState state_{DriveState::kNotReady};
  Disturbance disturbance_{Disturbance::kNone};
  double supply_v_;
  double ambient_c_{22.0};
  std::int64_t now_us_;
  std::int64_t next_tick_us_;
  std::int64_t stopping_since_us_{0};
  std::int64_t start_up_until_us_{0};  ///< of a reset: the boot-up message follows
  std::uint16_t last_controlword_{0};
  bool stage_tripped_{false};  ///< the over-current comparator switched the stage off
  bool encoder_broken_{false};
  bool reset_pending_{false};
  bool reset_communication_only_{false};
};

}  // namespace mantle::firmware_sim
