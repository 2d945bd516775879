#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "firmware_sim/bus/spsc_ring.h"
#include "loop/control_side/control_side.h"
#include "loop/sensor_channel.h"
#include "loop/timing.h"

namespace mantle::loop {

/// Where the control side is with its vehicle.
enum class ControlPhase : std::uint8_t {
  kBringUp,   ///< the drives are identified, configured, enabled; slack is taken up
  kReady,     ///< the first message with a state and the first plan are awaited
  kRunning,   ///< in command
  kLost,      ///< no sensor message for too long: nothing is commanded
  kStopping,  ///< the drives are taken down
  kEnded,
};
const char* ToString(ControlPhase phase);

/// How long the fast loop runs, and what silence it bears.
struct FastLoopOptions {
  double end_s{0};         ///< time of the vehicle at which the run ends
  double silence_s{0.15};  ///< without a sensor message: the vehicle counts as lost
  double patience_s{0};    ///< that drives may take to appear on the bus
  int go_cycles{1};        ///< by which go_us is told before it
  /// In the loop's own thread, at every change of phase.
  std::function<void(ControlPhase)> on_phase{};
};

/// Figures of a fast loop's run.
struct FastLoopCounters {
  DurationHistogram lateness;  ///< of SYNC on the bus, after the instant at which it was due
  DurationHistogram command;   ///< from sensors at hand to the torques of all motors
  DurationHistogram turn;      ///< that, and what is told to the planner and to listeners
  long cycles{0};              ///< in command
  long late_cycles{0};         ///< of these, SYNCs late by more than a tenth of the period
  long missed_cycles{0};       ///< whose SYNC was left out, a whole period late
  long predicted{0};           ///< whose sensor message had not come in time
  long old_messages{0};        ///< sensor messages that were not newer than one before
  long lost{0};                ///< times at which the vehicle was lost
  long late_plans{0};          ///< ControlCounters
  long unheard{0};             ///< frames that nobody had room for
};

/// What a SYNC period of the control side has come to: plain values for telemetry and accounts.
struct ControlFrame {
  double time_s{0};  ///< of the SYNC; the vehicle's
  ControlPhase phase{ControlPhase::kBringUp};
  bool planned{false};    ///< a measurement went to the planner
  bool predicted{false};  ///< no sensor message had come
  reduced::ReducedState estimate;
  model::VectorX command_n, before_n;
  std::vector<MotorCommand> torques;
  controller::Disturbance disturbance{0};
  std::vector<firmware_sim::DriveReport> reports;  ///< one per motor
  std::vector<double> reeled_m;                    ///< MotorMaster::ReportedReel_m
  FastLoopCounters counters;                       ///< so far
  model::VectorX variance;  ///< Estimator::covariance's diagonal; empty where there is none
};

/// The control side in real time, in one thread: SYNC by an absolute clock, which never waits for
/// vehicle, planner or listener, and does not allocate, lock, log or write a file once it is in
/// command.
///
///   before a SYNC is due   reports and sensor messages are read as they come; the last message, or
///                          where none has come in time the prediction, makes the command
///   when it is due         RPDOs and SYNC leave
///
/// A vehicle whose messages cease is lost: the drives are told to pull nothing, and when messages
/// come again they are brought up again, wherever they are, and a new run begins at the time the
/// vehicle tells. Where a vehicle is held at its start (Sensors::held), it is released by
/// go_us().
class FastLoop {
 public:
  /// All must outlive it. `frames`, null for nobody, gets one per cycle.
  FastLoop(ControlSide& control, SensorSource& sensors, const FastLoopOptions& options,
           firmware_sim::SpscRing<ControlFrame>* frames);

  /// Until the run has ended, or `stop` and the drives are stopped. Fails where the drives cannot
  /// be brought up or do not stop, naming the drive.
  Status Run(const std::atomic<bool>& stop);

  // From any thread.

  ControlPhase phase() const { return phase_.load(std::memory_order_acquire); }
  /// CLOCK_REALTIME [us]: the first SYNC that leaves then or later is t = 0 of a vehicle that is
  /// held, half a period after it is when that is due; INT64_MAX until the control side is ready.
  std::int64_t go_us() const { return go_us_.load(std::memory_order_acquire); }
  /// Ends Run at once, the drives left to their watchdogs: the vehicle is gone.
  void Abandon() { abandoned_.store(true, std::memory_order_release); }
  /// The run came to options.end_s.
  bool complete() const { return complete_.load(std::memory_order_acquire); }

  // When Run has ended.

  const FastLoopCounters& counters() const { return counters_; }
  /// Why SCHED_FIFO was refused; empty where it was not.
  const std::string& refused() const { return refused_; }
  /// A frame of this vehicle's size.
  static ControlFrame MakeFrame(const ControlSide& control);

 private:
  void Enter(ControlPhase phase);
  void Listen(std::int64_t due_us);
  bool TakeMessages();
  Status Act(std::int64_t now_us, std::int64_t due_us, bool stop);
  Status ActBringUp(std::int64_t now_us);
  void Command();
  void Predict();
  void Tell();
  void SkipMissed(std::int64_t now_us, std::int64_t* due_us);

  ControlSide& control_;
  SensorSource& sensors_;
  FastLoopOptions options_;
  firmware_sim::SpscRing<ControlFrame>* frames_;
  std::int64_t period_us_;
  double period_s_;
  Sensors message_, newest_;  ///< one that comes; what is known now
  std::vector<MotorCommand> nothing_;
  ControlFrame frame_;
  FastLoopCounters counters_;
  std::string refused_;
  std::atomic<ControlPhase> phase_{ControlPhase::kBringUp};
  std::atomic<std::int64_t> go_us_{INT64_MAX};
  std::atomic<bool> complete_{false}, abandoned_{false};
  std::int64_t begin_us_{0};  ///< of the phase
  std::int64_t heard_us_{0};  ///< a message came last
  bool fresh_{false};         ///< newest_ was not used yet
  bool heard_{false};         ///< newest_ is a message
  int going_{0};              ///< cycles until the first in command; 0: not told
  double time_s_{0};          ///< of the last command
  double reserve_us_{0};      ///< what a command takes, as the last ones tell
  double told_s_{0};          ///< of the newest message
};

}  // namespace mantle::loop
