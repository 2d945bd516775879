#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "controller/mpc.h"

/// A controller in the loop: it gets estimates, and commands a tension of every motor.

namespace mantle::controller {

/// The seam: a controller of a user's own derives from it (registry.h gives it a name). Command is
/// all that it has to have.
class Controller {
 public:
  virtual ~Controller() = default;

  /// At the beginning of a run, with the motors at their lower limits.
  virtual void Start(const ReducedState&) {}
  /// Every control period, with the estimate for now; null where there is none that is finite.
  /// `deadline_ns` as in SolveOptions. `tensions` are those commanded last [N].
  virtual void Update(double /*t_s*/, const ReducedState* /*estimate*/,
                      const Eigen::Ref<const VectorX>& /*tensions*/, std::int64_t /*deadline_ns*/) {
  }
  /// Before the measurement of t_s, when the next Update is due: what can be done without it.
  /// `tensions` are those commanded until then. Where it is left out, Update does it.
  virtual void Prepare(double, const Eigen::Ref<const VectorX>&) {}
  /// Before Prepare: what the model was found to miss. A controller without a model ignores it.
  virtual void SetDisturbance(const Disturbance&) {}
  /// The motors' limits from now on, where they change: those of lost motors are zero. What a
  /// controller commands beyond them is cut afterwards in any case.
  virtual void SetLimits(const std::vector<MotorLimits>&) {}
  /// Every SYNC: tensions [N, one per motor] to command at t_s, not yet limited: bounds and rates
  /// of the motors, and values that are not finite, are seen to afterwards. No allocation.
  virtual void Command(double t_s, const ReducedState* estimate, Eigen::Ref<VectorX> tensions) = 0;
  /// Null where the controller makes no plans.
  virtual const Mpc* mpc() const { return nullptr; }
  /// Start, Update, Prepare, SetDisturbance, SetLimits and mpc() may go on in a thread of their own
  /// beside Command: in real time they then do (loop/control_side/planner.h).
  virtual bool plans_apart() const { return false; }
};

/// What a controller is made of; all must outlive it.
struct ControllerParts {
  const ReducedModel& model;
  const reduced::StepSettings& step;
  const ControlOptions& options;
  const Reference& reference;
};

/// The receding-horizon controller with its fast loop: at a SYNC it commands
/// u(t) + K (x(s) - x_plan(s)), s the time of the estimate, and for tensions that fade where the
/// controller has given up.
std::unique_ptr<Controller> MakeMpcController(const ControllerParts& parts);

/// What options.controller names (registry.h): the one above, a baseline (baselines.h), or one that
/// was registered. Throws std::invalid_argument, listing the known names, where there is none.
std::unique_ptr<Controller> MakeController(const ControllerParts& parts);

}  // namespace mantle::controller
