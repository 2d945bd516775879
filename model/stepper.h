#pragma once

#include <functional>
#include <memory>
#include <string>

#include "model/energy.h"
#include "model/plant.h"

namespace mantle::model {

enum class Integrator {
  kSdirk2,         ///< default: two stages, order 2, L-stable, stiffly accurate (Alexander 1977)
  kSdirk3,         ///< three stages, order 3, L-stable, stiffly accurate (Alexander 1977)
  kBackwardEuler,  ///< order 1, L-stable
  kRk4,            ///< explicit, order 4; refused beyond its stability limit
  kCvode           ///< SUNDIALS BDF, error-controlled: the accuracy reference
};

/// Called after the schedules were evaluated at time t, before every stage: what drives and
/// controllers use to set cable inputs. Empty: the scene's schedules alone.
using InputHook = std::function<void(double t_s, bool from_left, PlantInputs* inputs)>;

/// Which integrator, and how accurately it solves its equations.
struct StepperSettings {
  Integrator integrator{Integrator::kSdirk2};
  /// Implicit steps: share of the step's own error that Newton's iteration may leave.
  double newton_tolerance{0.05};
  int newton_max_iterations{12};  ///< of one stage
  /// Implicit steps: largest estimated error of one, in rad, body lengths, and per second; a step
  /// beyond is refused. 0: not estimated, every step is taken.
  double step_tolerance{0};
  double relative_tolerance{1e-6};  ///< CVODE
  double absolute_tolerance{1e-8};  ///< CVODE, in rad, body lengths, and per second
  InputHook input_hook;             ///< may be empty
};

/// What a stepper has done since it was made: steps taken and steps rejected, Newton's iterations,
/// factorisations of the iteration matrix, evaluations of the forces.
struct StepCounters {
  long steps{0}, rejected{0}, newton_iterations{0}, factorisations{0}, evaluations{0};
};

/// Outcome of one step; where it failed, why (body, node, cause).
struct StepStatus {
  bool ok{true};
  std::string reason;
  double error_ratio{0};  ///< estimated error over step_tolerance; 0 where it is not estimated
};

/// Time integration of q_dot = B(q) v, M v_dot = f(q, v, t) behind one seam. A step never crosses a
/// break point of a schedule (the caller aligns them); inputs at the end of a step are their limits
/// from the left.
class Stepper {
 public:
  virtual ~Stepper() = default;
  /// Advances `state` by h seconds and adds the work of every load to `energy` (may be null). On
  /// failure neither has changed.
  virtual StepStatus Step(double h, PlantState* state, EnergyAccount* energy) = 0;
  /// Acceleration v_dot at the end of the last step.
  virtual const VectorX& acceleration() const = 0;
  virtual const StepCounters& counters() const = 0;
  /// What was evaluated at the end of the last step, one negligible correction ago; null where the
  /// method evaluates nothing there. The energy account's powers are then of that instant.
  virtual const PlantWork* end_work() const { return nullptr; }

  /// What a restart needs to continue with the same bits (predictor and iteration-matrix state).
  virtual std::string SaveMemory() const = 0;
  virtual void RestoreMemory(const std::string& memory) = 0;
  /// Forget what was learned about the past: after a jump of the loads.
  virtual void Restart() {}
  /// The next step starts at a break point: loads may jump or have a kink there.
  virtual void CrossBreakpoint() {}
};

/// p of an error h^p of a run of fixed steps; CVODE's varies, 0.
int OrderOf(Integrator integrator);

std::unique_ptr<Stepper> MakeStepper(const Plant& plant, const StepperSettings& settings);

/// Largest step [s] for which explicit RK4 is stable at the initial state: from the spectral radii
/// of M^-1 D and M^-1 K (power iteration), the worst root of s^2 + d s + k on RK4's stability
/// region, with 5 % in hand ([physics.md] 7).
double ExplicitStepLimit(const Plant& plant);

/// The seams' implementations, one file each.
std::unique_ptr<Stepper> MakeImplicitStepper(const Plant& plant, const StepperSettings& settings);
std::unique_ptr<Stepper> MakeExplicitStepper(const Plant& plant, const StepperSettings& settings);
std::unique_ptr<Stepper> MakeCvodeStepper(const Plant& plant, const StepperSettings& settings);

}  // namespace mantle::model
